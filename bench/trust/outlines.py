"""Outlines that are not the ply's: python bench/trust/outlines.py [--layups 5] [--only NAME] [--out FILE].

On each layup one pocket with a true ridge above the limit lies where a wrong outline leaves it out, or at the ply's
edge. None may pass. Right outlines of a ply that lies flat must not be refused. Molds, scanners and the truth are those
of stranger.py.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import numpy as np
from numpy.typing import NDArray
from stranger import MOLDS, Plane, Surface, dome, scaled, scanned

from debulk import InputError, inspect

Floats = NDArray[np.float64]
RIDGE_MM = 0.75  # true ridge of each pocket; the limit is 0.60 mm
WIDE_MM, HIGH_MM = 300.0, 220.0
LETTER = {"cease": "PASSED", "crease": "C", "undecided": "U", "invalid": "I"}
PLIES = ("fourier", "plate", "sandwich", "cone", "spline")
SHORT_MM = (5, 10, 15, 20, 30, 40, 80, 160)


@dataclass(frozen=True, eq=False)
class Way:
    """A way to give an outline.

    Attributes
    ----------
    name
        What the table calls it.
    ply, given
        (M, 2) corners of the ply and of the outline that is given.
    pocket_mm
        Middle and radius of the pocket; None: the ply lies flat, and the outline is right.
    """

    name: str
    ply: Floats
    given: Floats
    pocket_mm: tuple[float, float, float] | None = None


def box(left: float, low: float, right: float, high: float) -> Floats:
    """Return a rectangle, counter-clockwise."""
    return np.array([[left, low], [right, low], [right, high], [left, high]])


def with_hole(outer: Floats, x: float, y: float, radius: float, slit_mm: float) -> Floats:
    """Return a rectangle from `box` with a round hole, joined to its lower side by a slit."""
    a = 0.5 * slit_mm / radius
    turn = np.linspace(-0.5 * np.pi + a, 1.5 * np.pi - a, 60)
    hole = np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=1)
    low = outer[0, 1]
    return np.array([outer[0], (x - slit_mm / 2, low), *hole[::-1], (x + slit_mm / 2, low), *outer[1:]])


def ways() -> Iterator[Way]:
    """Yield all ways; most cut off the right side, which is where their pocket lies."""
    w, h = 0.5 * WIDE_MM, 0.5 * HIGH_MM
    ply = box(-w, -h, w, h)
    odd = np.array([[-w, -h], [w, -h], [w, 0.1 * h], [0.2 * w, h], [-w, h]])
    strip = box(-w, -50, w, 50)
    yield Way("right", ply, ply)
    yield Way("right, clockwise", ply, ply[::-1])
    yield Way("right, first corner repeated", ply, np.concatenate([ply, ply[:1]]))
    yield Way("right, of five corners", odd, odd)
    yield Way("right, of a strip of 100 mm", strip, strip)
    holed = with_hole(ply, 30, 0, 30, 1.0)
    yield Way("right, a hole with a slit", holed, holed)
    yield Way("right, 3 mm short all round", ply, box(3 - w, 3 - h, w - 3, h - 3))
    yield Way("right, 3 mm long all round", ply, box(-3 - w, -3 - h, w + 3, h + 3))
    inner = (20.0, 10.0, 22.0)
    yield Way("twice in a row", ply, np.concatenate([ply, ply]), inner)
    yield Way("twice, once backwards", ply, np.concatenate([ply, ply[:1], ply[::-1]]), inner)
    for radius in (12, 20, 40):
        hole = with_hole(ply, 30, 0, radius, 1.0)
        yield Way(f"a hole of {2 * radius} mm that the ply has not", ply, hole, (30.0, 0.0, max(11.0, radius - 8.0)))
        yield Way(f"the hole without a slit, {2 * radius} mm", ply, with_hole(ply, 30, 0, radius, 0.0),
                  (30.0, 0.0, max(11.0, radius - 8.0)))  # fmt: skip
    for d in SHORT_MM:
        away = max(d - 20.0, 0.5 * d)  # of the pocket's middle from the ply's edge
        given = box(-w, -h, w - d, h)
        yield Way(f"{d} mm short, the pocket outside", ply, given, (w - 0.5 * d, 10.0, float(np.clip(0.45 * d, 9, 25))))
        yield Way(f"{d} mm short, the pocket at it", ply, given, (w - d, -20.0, 20.0))
        yield Way(f"{d} mm short, the pocket at the edge", ply, given, (w - 5.0, 0.0, 25.0))
        yield Way(f"a strip of 100 mm, {d} mm short", strip, box(-w, -50, w - d, 50), (w - away, 0.0, 20.0))
    for d in (5, 15, 40, 160):
        yield Way(f"{d} mm long", ply, box(-w, -h, w + d, h), (w - 10.0, 0.0, 22.0))
    for d in (5, 10, 20, 60, 160):
        yield Way(f"{d} mm shifted", ply, ply - [d, 0], (w - 0.5 * min(d, 60), 10.0, 20.0))
        yield Way(f"{d} mm shifted, along a corner", ply, ply - [0.7 * d, 0.7 * d], (w - 12.0, h - 12.0, 20.0))
    yield Way("of the mirrored ply", odd, odd[::-1] * [-1, 1], (w - 25.0, -0.5 * h, 22.0))
    yield Way("a corner of 40 mm left out", ply, np.array([[-w, -h], [w, -h], [w, h - 40], [w - 40, h], [-w, h]]),
              (w - 12.0, h - 12.0, 15.0))  # fmt: skip
    notch = np.array([[-w, -h], [w, -h], [w, -30], [w - 40, -30], [w - 40, 30], [w, 30], [w, h], [-w, h]])
    yield Way("a notch of 60 by 40 mm that the ply has not", ply, notch, (w - 20.0, 0.0, 18.0))
    for wide in (60, 100):
        yield Way(f"a strip of {wide} mm of it", ply, box(-w, -wide / 2, w, wide / 2), (0.0, wide / 2 + 25.0, 22.0))
        yield Way(
            f"a window of {wide} mm", ply, box(-wide / 2, -wide / 2, wide / 2, wide / 2), (wide / 2 + 25, 0.0, 22.0)
        )
        yield Way(f"a window of {wide} mm, far from it", ply, box(20 - w, 20 - h, 20 - w + wide, 20 - h + wide),
                  (60.0, 40.0, 22.0))  # fmt: skip


def said(way: Way, mold_kind: str, number: int) -> tuple[str, str]:
    """Return a letter for the verdict, and the reason."""
    rng = np.random.default_rng([91, number])
    mold = MOLDS[mold_kind](rng)
    on = Plane(way.ply)
    size = np.array([WIDE_MM, HIGH_MM])
    gap: Surface = lambda x, y: 0.0 * x  # noqa: E731
    if way.pocket_mm is not None:
        x, y, radius = way.pocket_mm
        # The whole bell makes the ridge, also where the ply's edge cuts through it.
        gap = scaled(dome(x, y, radius, radius, 1.0), RIDGE_MM, mold, Plane(way.ply * 1.5), 1.5 * size, 0.0)
    scan, reference, pose, _ = scanned(rng, mold, gap, on, size)
    try:
        report = inspect(scan, reference, None, way.given, (0.0, 90.0), pose)
        if way.pocket_mm is not None and report.passed:
            right = inspect(scan, reference, None, way.ply, (0.0, 90.0), pose)
            return "p" if right.passed else "PASSED", report.reason
    except InputError as error:
        return "-", str(error)
    return LETTER[report.verdict.value], report.reason


def main() -> None:
    """Print the table, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--layups", type=int, default=len(PLIES))
    parser.add_argument("--only", default="", help="part of the names of the ways that are wanted")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    began = time.perf_counter()
    rows: dict[Way, list[tuple[str, str]]] = {}
    for way in ways():
        if args.only not in way.name:
            continue
        cells = [said(way, kind, number) for number, kind in enumerate(PLIES[: args.layups])]
        rows[way] = cells
        print(f"{way.name:44}{' '.join(letter for letter, _ in cells)}  {cells[0][1][:150]}", flush=True)
    text = table(rows, PLIES[: args.layups])
    print(text, f"\n{time.perf_counter() - began:.0f} s")
    if args.out:
        args.out.write_text(text)


def table(rows: dict[Way, list[tuple[str, str]]], molds: tuple[str, ...]) -> str:
    """Return the table of the letters and reasons of each way, one for each mold."""
    right: Counter[str] = Counter()
    wrong: Counter[str] = Counter()
    for way, cells in rows.items():
        (right if way.pocket_mm is None else wrong).update(letter for letter, _ in cells)
    about = (
        f"{len(rows)} ways to give an outline, on the molds {', '.join(molds)}. In each way that is not "
        f"right, a pocket with a true ridge of {RIDGE_MM:g} mm, above the limit, lies outside the outline or at it. C: "
        "CREASE, U: UNDECIDED, I: INVALID, -: refused by an error that names what is wrong; p: passed, as with the "
        "right outline, for the pocket leaves through the ply's edge. The reason is the first's."
    )
    lines = ["OUTLINES THAT ARE NOT THE PLY'S", "", fill(about, 110), ""]
    lines += [
        f"with a pocket: passed {wrong['PASSED']}; CREASE {wrong['C']}, UNDECIDED {wrong['U']}, INVALID {wrong['I']}, "
        f"refused {wrong['-']}, "
        f"as with the right outline {wrong['p']}",
        f"right and flat: passed {right['PASSED']}; others {sum(right.values()) - right['PASSED']}",
        "",
    ]
    for way, cells in rows.items():
        marks = " ".join(f"{'P' if letter == 'PASSED' else letter:<2}" for letter, _ in cells)
        lines.append(f"  {way.name:<46}{marks}  {' '.join(cells[0][1].split())[:110]}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
