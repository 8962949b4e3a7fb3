"""Fuzzes the loaders in Python, two at a time: python tests/fuzz/fuzz.py FOLDER [TARGET ...] [-max_total_time=60 ...].

Without targets it takes all. FOLDER/TARGET receives seeds, and what raised the coverage; FOLDER/TARGET.log what was
printed; further options are those of libFuzzer. An input that ends in anything but a result or an InputError is written
to FOLDER/failed/TARGET-...: put it into tests/fuzz/found/TARGET/, where a test replays it.
"""

from __future__ import annotations

import gzip
import json
import os
import random
import sys
import tempfile
from pathlib import Path
from typing import Any

import atheris
import cv2
import numpy as np

with atheris.instrument_imports(include=["debulk", "ezdxf"]):
    from targets import MOST_BYTES, TARGETS, one_input

    import debulk

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
        "angles": "x,y,first,second\n0,0,0,90\n10,0,1,91\n0,10,2,92\n",
        "heights": "Unit,mm\nY/X,0,10,20\n0,1.5,1.6,---\n10,1.4,1.5,1.7\n20,1.4,1.6,1.8\n",
        "outline": "x,y\n0,0\n100,0\n100,80\n0,80\n",
        "pose": "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
        "recipe": debulk.Recipe().to_toml(),
        "approvals": '[[approved]]\nname = "A"\ntime_utc = "2026-01-01T00:00:00Z"\nrecipe_sha256 = "00"\n',
        "layup": 'scan = "s.npy"\nreference = "r.npy"\nangles_deg = [0, 90]\n[context]\npart = "A"\n',
        "mask": cv2.imencode(".png", np.eye(8, dtype=np.uint8) * 255)[1].tobytes(),
        **_written(),
    }
    data = text[target]
    return [b"\0" + (data if isinstance(data, bytes) else data.encode())]


def _written() -> dict[str, bytes]:
    """Return a chain, a calibration and a history as they are saved."""
    from debulk.chain import Chain, Figure
    from debulk.history import History
    from debulk.scanner import Calibration

    turned = np.eye(3), np.array([-200.0, 0.0, 0.0])
    cameras = Calibration([np.diag([500.0, 500.0, 1.0])] * 2, np.zeros((2, 5)), *turned, (64, 48))
    report = debulk.Report(verdict=debulk.Verdict.INVALID, reason="nothing was checked", pockets=())
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / name for name in ("chain.json", "calibration.json", "history.sqlite")]
        figures = (Figure(name="noise_mm", mean=0.05, sd=0.0, low=0.03, high=0.07),)
        made = Chain(name="cell", made_utc="2026-03-01T12:00:00.000Z", debulk="0.1.0", scans=10, figures=figures)
        made.save(paths[0])
        cameras.save(paths[1])
        History(paths[2]).add(report)
        return {path.stem: path.read_bytes() for path in paths}


# What stands where a number, a word or a list is expected.
ODD = (None, True, -1, 0, 0.5, 1e308, 10**30, float("nan"), float("inf"), "", "NaN", "x" * 300, "\ud800", [], [[]], {})


def mutated(data: bytes, most_bytes: int, seed: int) -> bytes:
    """Change one value in a JSON file; in other files, and in every fourth one, some bytes."""
    rng = random.Random(seed)
    try:
        whole = [json.loads(data[1:])]
    except (ValueError, RecursionError):
        whole = []
    if not whole or rng.random() < 0.25:
        return bytes(atheris.Mutate(data, most_bytes))
    # Each value's container and key; more come while they are walked through.
    places: list[tuple[Any, Any]] = [(whole, 0)]
    for container, key in places:
        value = container[key]
        if isinstance(value, (dict, list)):
            places += [(value, k) for k in (value if isinstance(value, dict) else range(len(value)))]
    (container, key), (other, there) = rng.choice(places), rng.choice(places)
    choice = rng.randrange(4)
    if choice == 0 and container is not whole:
        del container[key]
    else:
        container[key] = rng.choice(ODD) if choice < 3 else json.loads(json.dumps(other[there]))
    text = data[:1] + json.dumps(whole[0]).encode()
    return text if len(text) <= most_bytes else data


def fuzz(target: str, folder: Path, options: list[str]) -> None:
    """Fuzz one target until the time is over or an input fails; this ends the process."""
    with (folder / f"{target}.log").open("w") as log:
        for stream in (1, 2):
            os.dup2(log.fileno(), stream)
    corpus = folder / target
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(seeds(target)):
        (corpus / f"seed{number:03}").write_bytes(seed)
    atheris.Setup(
        [sys.argv[0], str(corpus), f"-max_len={MOST_BYTES}", f"-artifact_prefix={folder}/failed/{target}-", *options],
        lambda data: bool(one_input(target, data)) and None,
        custom_mutator=mutated,
    )
    atheris.Fuzz()


def main() -> int:
    """Fuzz each target in a fork of this process: what was instrumented takes ten seconds to import."""
    folder, arguments = Path(sys.argv[1]), sys.argv[2:]
    options = [word for word in arguments if word.startswith("-")]
    targets = [word for word in arguments if word not in options] or list(TARGETS)
    (folder / "failed").mkdir(parents=True, exist_ok=True)
    statuses = []
    for number, target in enumerate(targets):
        if number >= 2:
            statuses.append(os.wait()[1])
        if os.fork() == 0:
            fuzz(target, folder, options)
    statuses += [os.wait()[1] for _ in targets[:2]]
    return int(any(statuses))


if __name__ == "__main__":
    sys.exit(main())
