"""Verdicts on scans that are too high, too low, tilted, bowed or warped: python bench/trust/offsets.py [--out FILE].

The layups are one of the first family and two of the second, one of which has only pockets that close.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from debulk import InputError, Inspector, scenes
from lab.varied import varied_layup
from lab.varied.given import Floats, Given, given_right, moved, shift, turn
from lab.varied.mistaken_clouds import raised

OFFSETS_MM = (0.1, 0.25, 0.5, 1, 2, 2.5, 5, 10, 20)
TILTS_DEG = (0.02, 0.05, 0.1, 0.2, 0.5, 1)
BENDS_MM = (0.25, 0.5, 1, 2)


def faults(given: Given) -> Iterator[tuple[str, Given]]:
    """Yield every fault with its size in words; the first is the scan with nothing wrong."""
    yield "nothing wrong", given
    for size in OFFSETS_MM:
        for sign in (1, -1):
            yield f"{sign * size:+g} mm", _moved(given, shift(z=sign * size))
    middle = np.nanmean(given.in_mold(given.reference)[::16, ::16].reshape(-1, 3), axis=0)
    for size in TILTS_DEG:
        yield f"tilt {size:g} deg", _moved(given, turn((0.6, 0.8, 0.0), size, middle))
    for size in BENDS_MM:
        for sign in (1, -1):
            yield (
                f"bow {sign * size:+g} mm",
                replace(given, scan=raised(given, given.scan, lambda u, v, a=sign * size: a * (1 - u * u))),
            )
        yield f"warp {size:g} mm", replace(given, scan=raised(given, given.scan, lambda u, v, a=size: a * u * v))


def _moved(given: Given, motion: Floats) -> Given:
    return replace(given, scan=moved(given.scan, given.motion_of_scanner(motion)).astype(np.float32))


def main() -> None:
    """Print the table, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--pixels", default="1280x960")
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    size = (width, height)
    layups: dict[str, Any] = {
        "first, creases": scenes.layup(0, size),
        "varied, creases": varied_layup(0, size, mold="saddle", severity="any", pockets=4, borders=0, clamp=False),
        "varied, ceases": varied_layup(2, size, mold="dome", severity="benign", pockets=3, borders=0, clamp=False),
    }
    rows: dict[str, list[str]] = {}
    for layup in layups.values():
        given = given_right(layup)
        inspector = Inspector(
            None, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
        )
        for name, spoiled in faults(given):
            try:
                report = inspector.inspect(spoiled.scan)
                said = f"{report.verdict.value.upper()} ({len(report.pockets)}): {report.reason}"
            except InputError as error:
                said = f"InputError: {error}"
            rows.setdefault(name, []).append(said)
    lines = []
    for k, name in enumerate(layups):
        lines += [f"--- {name}", *(f"{fault:16}{cells[k][:200]}" for fault, cells in rows.items()), ""]
    print("\n".join(lines))
    if args.out:
        args.out.write_text("\n".join(lines))


if __name__ == "__main__":
    main()
