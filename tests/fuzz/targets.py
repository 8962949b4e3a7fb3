"""What is fuzzed in Python: every loader of a file, by the ending that chooses it. A loader loads or raises InputError.

`tests/fuzz/fuzz.py` drives these with Atheris; `tests/python/test_fuzz_found.py` replays the inputs that were found.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from debulk import Chain, Comparison, InputError, Recipe, Report, files
from debulk.batch import layups
from debulk.history import History
from debulk.results.approval import approvals
from debulk.scanner import Calibration

CLOUDS = (".pcd", ".ply", ".npy", ".npz", ".xyz", ".csv", ".ptx")
MOST_BYTES = 1 << 17

TARGETS: dict[str, tuple[tuple[str, ...], Callable[[Path], Any]]] = {
    "cloud": (CLOUDS, files.load_cloud),
    "heights": ((".csv", ".png", ".npy"), lambda path: files.load_heights(path, (10.0, -10.0))),
    "outline": ((".csv", ".dxf"), files.load_outline),
    "angles": ((".csv",), files.load_angles),
    "pose": ((".txt", ".npy", ".json"), files.load_pose),
    "mask": ((".png", ".npy"), files.load_mask),
    "report": ((".json",), Report.load),
    "comparison": ((".json",), Comparison.load),
    "recipe": ((".toml",), Recipe.load),
    "approvals": ((".toml",), approvals),
    "chain": ((".json",), Chain.load),
    "calibration": ((".json",), Calibration.load),
    "layup": ((".toml",), lambda path: layups(path.parent)),
    "history": ((".sqlite",), lambda path: History(path).check()),
}
FOLDER = Path(tempfile.mkdtemp(prefix="fuzz"))


def one_input(target: str, data: bytes) -> bool:
    """Load the bytes, of which the first chooses the ending; return whether they were accepted."""
    endings, load = TARGETS[target]
    ending, data = endings[data[0] % len(endings)] if data else endings[0], data[1:]
    path = FOLDER / target / ("layup.toml" if target == "layup" else f"file{ending}")
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            load(path)
    except InputError as error:
        assert str(error).strip() and len(str(error)) < 5000
        return False
    return True
