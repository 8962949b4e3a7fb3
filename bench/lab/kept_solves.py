"""Solves written to a file, so that they can be repeated elsewhere: python -m lab.kept_solves FILE..., in bench/."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from debulk import _core
from debulk.files.replacing import write_text
from debulk.recipe import Recipe
from debulk.sheet import Sheet
from debulk.solve import Solution, minimise
from debulk.surface import Reference

FORMAT = "debulk-solve-2"
_MARGIN = 20  # grid spacings around the nodes: the effect of the spline's border falls by a factor of 4 per spacing
_OPTIONS = {"method", "starts", "first_start", "seed", "tolerance", "max_iterations", "stiffness"}


def dump(path: str | Path, sheet: Sheet, solution: Solution, **options: Any) -> None:
    """Write a solve to one JSON file: the net, the mold around it, the ply, the options, and how it ended."""
    reference = sheet.reference
    heights, origin, step = reference.heights_mm, np.asarray(reference.origin_mm), reference.spacing_mm
    xy = (sheet.start_mm[:, :2] - origin) / step
    # A Reference has at least 4 by 4 heights; nodes may lie outside.
    size = np.array(heights.shape)[::-1]
    first = np.clip(np.floor(xy.min(axis=0)).astype(int) - _MARGIN, 0, size - 4)
    last = np.clip(np.ceil(xy.max(axis=0)).astype(int) + _MARGIN, first + 3, size - 1)
    data = {
        "format": FORMAT,
        "sheet": [
            *(values.tolist() for values in (sheet.start_mm, sheet.neighbours, sheet.kinds)),
            sheet.spacing_mm,
            sheet.area_mm2,
        ],
        "edge_mm": None if sheet.edge_mm is None else sheet.edge_mm.tolist(),
        "reference": [
            heights[first[1] : last[1] + 1, first[0] : last[0] + 1].tolist(),
            (origin + first * step).tolist(),
            step,
        ],
        "ply": sheet.ply,
        "options": options,
        "ended": _ended(solution),
    }
    write_text(Path(path), json.dumps(data))


def load(path: str | Path) -> tuple[Sheet, dict[str, Any], dict[str, Any]]:
    """Read a file that `dump` wrote: the sheet, the options of `debulk.solve.minimise`, and how the solve ended."""
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
        if data["format"] != FORMAT or not data["options"].keys() <= _OPTIONS:
            raise ValueError
        ply = SimpleNamespace(**data["ply"])
        recipe: Recipe = SimpleNamespace(material=ply, loads=ply)  # type: ignore[assignment]
        given = *data["sheet"], Reference(*data["reference"]), recipe, data["edge_mm"]
        return Sheet(*given), data["options"], data["ended"]
    except OSError as error:
        raise _core.InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise _core.InputError(f"{path}: expected a solve that debulk kept ({FORMAT}); was it edited?") from None


def _ended(solution: Solution) -> dict[str, Any]:
    return {
        "status": solution.status,
        "certified": solution.certified,
        "failure": solution.certificate.failure,
        "energy_mj": solution.energy_mj,
        "iterations": solution.iterations,
    }


def main(paths: list[Path]) -> int:
    """Repeat each file's solve and print how it ended then and now; return 1 if a solve is not certified now."""
    code = 0
    for path in paths:
        sheet, options, ended = load(path)
        started = time.perf_counter()
        solution = minimise(sheet, **options)
        print(f"{path}: {1e3 * (time.perf_counter() - started):.1f} ms")
        print(f"  then: {ended}")
        print(f"  now:  {_ended(solution)}")
        code = code if solution.certified else 1
    return code


if __name__ == "__main__":
    sys.exit(main([Path(name) for name in sys.argv[1:]]))
