"""Fuzzes the loaders in Python: python tests/fuzz/fuzz.py TARGET CORPUS [-max_total_time=60 ...].

CORPUS is a folder; further options are those of libFuzzer. It receives seeds, and what raised the coverage. An input
that ends in anything but a result or an InputError is written to the current folder (crash-...): put it into
tests/fuzz/found/TARGET/, where a test replays it.
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["debulk", "ezdxf"]):
    from targets import MOST_BYTES, TARGETS, one_input

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))


def seeds(target: str) -> list[bytes]:
    """Return right files to begin with, each after the byte that chooses its ending."""
    import numpy as np

    import cloud_files
    import debulk

    endings = TARGETS[target][0]
    points = np.random.default_rng(1).normal(0, 300, (4, 5, 3)).astype(np.float32)
    old = Path(__file__).resolve().parents[1] / "python" / "results" / "old"
    if target == "cloud":
        made = [*cloud_files.all_kinds(points), *cloud_files.of_producers(points)]
        named = [(Path(name).suffix, data) for name, data, *_ in made]
        return [bytes([endings.index(ending)]) + data for ending, data in named if ending in endings]
    if target in ("report", "comparison"):
        return [b"\0" + gzip.decompress(path.read_bytes()) for path in sorted(old.glob(f"{target}*.json.gz"))]
    text = {
        "outline": "x,y\n0,0\n100,0\n100,80\n0,80\n",
        "pose": "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
        "recipe": debulk.Recipe().to_toml(),
        "approvals": '[[approved]]\nname = "A"\ntime_utc = "2026-01-01T00:00:00Z"\nrecipe_sha256 = "00"\n',
        "layup": 'scan = "s.npy"\nreference = "r.npy"\nangles_deg = [0, 90]\n[context]\npart = "A"\n',
    }.get(target, "{}")
    return [b"\0" + text.encode()]


def main() -> None:
    """Fuzz one target until the time is over or an input fails."""
    target, corpus = sys.argv[1], Path(sys.argv[2])
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(seeds(target)):
        (corpus / f"seed{number:03}").write_bytes(seed)
    atheris.Setup(
        [sys.argv[0], str(corpus), f"-max_len={MOST_BYTES}", *sys.argv[3:]],
        lambda data: bool(one_input(target, data)) and None,
    )
    atheris.Fuzz()


if __name__ == "__main__":
    main()
