"""Solves written to a file, so that they can be repeated elsewhere with ``debulk replay FILE`` (docs/solver.md)."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from debulk import _core
from debulk.sheet import Sheet
from debulk.solve import Solution, minimise
from debulk.surface import Reference

if TYPE_CHECKING:
    from debulk.recipe import Recipe

FORMAT = "debulk-solve-1"
MARGIN = 20  # grid spacings around the nodes: the effect of the spline's border falls by a factor of 4 per spacing
_KEYS = ("nodes_mm", "neighbours", "kinds", "spacing_mm", "area_mm2", "reference", "ply", "options", "ended")
OPTIONS = ("method", "starts", "first_start", "seed", "tolerance", "max_iterations", "stiffness")


def dump(path: str | Path, sheet: Sheet, solution: Solution | None = None, **options: Any) -> None:
    """Write a solve to one JSON file: the net, the mold around it, the ply, the options, and how it ended.

    Parameters
    ----------
    path
        Path of the file.
    sheet
        The ply.
    solution
        Result of the solve; its status and its energy are written too, for comparison.
    options
        Keyword arguments of `debulk.solve.minimise`: method, starts, first_start, seed,
        tolerance, max_iterations, stiffness.

    Raises
    ------
    InputError
        An unknown option.

    Examples
    --------
    >>> import numpy as np, debulk, tempfile
    >>> reference = debulk.surface.Reference(np.zeros((4, 4)), (-10, -10), 10.0)
    >>> nodes = [[-4.9, 0, 0], [0, 0, 1.0], [4.9, 0, 0]]
    >>> fibre = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> sheet = debulk.sheet.Sheet(nodes, fibre, [1, 0, 1], 5.0, 75.0, reference)
    >>> with tempfile.NamedTemporaryFile(suffix=".json") as file:
    ...     dump(file.name, sheet, starts=2)
    ...     again, options = load(file.name)
    >>> bool(np.all(again.start_mm == sheet.start_mm)), options
    (True, {'starts': 2})
    """
    unknown = sorted(set(options) - set(OPTIONS))
    if unknown:
        raise _core.InputError(f"options: expected some of {', '.join(OPTIONS)}, but got {', '.join(unknown)}")
    reference = sheet.reference
    heights, origin, step = reference.heights_mm, np.asarray(reference.origin_mm), reference.spacing_mm
    xy = (sheet.start_mm[:, :2] - origin) / step
    # A Reference has at least 4 by 4 heights; nodes may lie outside.
    size = np.array(heights.shape)[::-1]
    first = np.clip(np.floor(xy.min(axis=0)).astype(int) - MARGIN, 0, size - 4)
    last = np.clip(np.ceil(xy.max(axis=0)).astype(int) + MARGIN, first + 3, size - 1)
    data = {
        "format": FORMAT,
        "nodes_mm": sheet.start_mm.tolist(),
        "neighbours": sheet.neighbours.tolist(),
        "kinds": sheet.kinds.tolist(),
        "spacing_mm": sheet.spacing_mm,
        "area_mm2": sheet.area_mm2,
        "edge_mm": None if sheet.edge_mm is None else sheet.edge_mm.tolist(),
        "reference": {
            "heights_mm": heights[first[1] : last[1] + 1, first[0] : last[0] + 1].tolist(),
            "origin_mm": (origin + first * step).tolist(),
            "spacing_mm": step,
        },
        "ply": sheet.ply,
        "options": options,
        "ended": None if solution is None else _ended(solution),
    }
    Path(path).write_text(json.dumps(data))


def load(path: str | Path) -> tuple[Sheet, dict[str, Any]]:
    """Read a file written by `dump`: the sheet, and the options for `debulk.solve.minimise`."""
    data = _read(path)
    return _sheet(data), data["options"]


def replay(path: str | Path) -> Solution:
    """Repeat a dumped solve."""
    sheet, options = load(path)
    return minimise(sheet, **options)


def _read(path: str | Path) -> dict[str, Any]:
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise _core.InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        data = None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise _core.InputError(
            f"path: expected a file written by debulk.inspection.minima.replay.dump ({FORMAT}), but got {path}"
        )
    lacking = [key for key in _KEYS if key not in data]
    if lacking:
        raise _core.InputError(f"{path}: {', '.join(lacking)} missing; was the file edited?")
    return data


def _sheet(data: dict[str, Any]) -> Sheet:
    # Files from before the lumping could be chosen hold solves with the paper's lumping.
    grid, ply = data["reference"], SimpleNamespace(**{"lumping": "paper", **data["ply"]})
    recipe: Recipe = SimpleNamespace(material=ply, loads=ply)  # type: ignore[assignment]
    return Sheet(
        data["nodes_mm"],
        data["neighbours"],
        data["kinds"],
        data["spacing_mm"],
        data["area_mm2"],
        Reference(np.array(grid["heights_mm"]), grid["origin_mm"], grid["spacing_mm"]),
        recipe,
        data.get("edge_mm"),
    )


def _ended(solution: Solution) -> dict[str, Any]:
    return {
        "status": solution.status,
        "certified": solution.certified,
        "failure": solution.certificate.failure,
        "energy_mj": solution.energy_mj,
        "iterations": solution.iterations,
    }


def main(arguments: list[str]) -> int:
    """Repeat each file's solve and print how it ended then and now; return 1 if a solve is not certified now."""
    code = 0
    for path in arguments:
        data = _read(path)
        sheet = _sheet(data)
        started = time.perf_counter()
        solution = minimise(sheet, **data["options"])
        print(f"{path}: {1e3 * (time.perf_counter() - started):.1f} ms")
        print(f"  then: {data['ended']}")
        print(f"  now:  {_ended(solution)}")
        code = code if solution.certified else 1
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
