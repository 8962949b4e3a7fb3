"""Bridges by sections of their own, against the verdicts: python bench/trust/bridges.py [CASE ...] [--out FILE].

Layups of the trust bench (seed 0) that are CREASE by a bridge though no held excess comes near the limit. Along every
fibre of such a pocket that is too short for the mold below it, the ply is a string under the tension T and the vacuum
P: it lies on the mold or stands off it in arcs of the radius T/P, the one at which its length is what it has. Friction
holds T up to μ P d, d being the way to the ply's edge (docs/model.md, section 5); where T is more it is drawn in.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cases import draw, make, truly
from numpy.typing import NDArray

import debulk
from debulk import Inspector, Recipe, pocket
from debulk.inspection.fibre_angles import angles_at
from debulk.results.report import PocketReport
from debulk.scenes import VariedLayup

Floats = NDArray[np.float64]

CASES = (59, 65, 72, 107, 157, 220, 314, 849)
STEP_MM, APART_MM = 0.5, 4.0  # along a fibre, and from one to the next
AROUND_MM = 40.0  # of laid ply round a pocket, over which it may come off the mold as well
LAID_MM = 0.03  # lower is on the mold
SHORT_MM = 0.005  # a fibre that lacks less is not too short
RADII_MM = (1.0, 1e5)
FAR_MM = 1500.0


@dataclass(frozen=True)
class Section:
    """A fibre that is too short: what it lacks, and the string of that length over the mold."""

    short_mm: float
    radius_mm: float  # T/P; inf: even the straightest string is too long
    held_mm: float  # μ d, the radius up to which friction holds it
    bridge_mm: float  # nan where the radius is inf

    @property
    def held(self) -> bool:
        """Whether friction holds it."""
        return self.radius_mm < self.held_mm


def string(s: Floats, z: Floats, radius_mm: float) -> Floats:
    """Heights of a string over a section of the mold, pressed on it: its upper hull by arcs of a radius."""
    flat = z - s * s / (2 * radius_mm)
    on: list[int] = []
    for k in range(len(s)):
        while len(on) > 1:
            a, b = on[-2], on[-1]
            if (flat[b] - flat[a]) * (s[k] - s[a]) > (flat[k] - flat[a]) * (s[b] - s[a]):
                break
            on.pop()
        on.append(k)
    return np.interp(s, s[on], flat[on]) + s * s / (2 * radius_mm)


def length(s: Floats, z: Floats) -> float:
    """Length of a section."""
    return float(np.hypot(np.diff(s), np.diff(z)).sum())


def solved(s: Floats, z: Floats, short_mm: float) -> tuple[float, float]:
    """Radius at which the string is so much shorter than the mold, and how high it stands then."""
    low, high = RADII_MM
    whole = length(s, z)
    if whole - length(s, string(s, z, high)) < short_mm:
        return np.inf, np.nan
    for _ in range(24):
        middle = float(np.sqrt(low * high))
        if whole - length(s, string(s, z, middle)) < short_mm:
            low = middle
        else:
            high = middle
    return high, float((string(s, z, high) - z).max())


def sections(layup: VariedLayup, found: PocketReport, friction: float) -> list[Section]:
    """All fibres over a pocket that are too short."""
    foot = found.foot_outline_mm
    centre = 0.5 * (foot.min(axis=0) + foot.max(axis=0))
    reach = 0.5 * float(np.hypot(*np.ptp(foot, axis=0))) + AROUND_MM
    s = np.arange(-reach, reach, STEP_MM)
    short = []
    for angle in np.radians(angles_at(np.array(layup.fibre_angles_deg), centre)):
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        for aside in np.arange(-reach, reach, APART_MM):
            xy = centre + s[:, None] * along + aside * across
            gap = np.maximum(layup.truth.ply_height_above_mold(xy) - layup.truth.thickness_mm, 0.0)
            up = _over(gap > LAID_MM, pocket.inside(foot, xy))
            if not up.any():
                continue
            mold = layup.truth.mold_height(xy)
            lacks = length(s, mold) - length(s, mold + np.where(up, gap, 0.0))
            if lacks > SHORT_MM:
                first, last = np.flatnonzero(up)[[0, -1]]
                ways = [_way_to_edge(layup, xy[k], sign * along) for k, sign in ((first, -1), (last, 1))]
                radius, high = solved(s, mold, lacks)
                short.append(Section(lacks, radius, friction * min(ways), high))
    return short


def _over(up: NDArray[np.bool_], foot: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Those pieces of a fibre that stand up and reach over the foot."""
    pieces = np.cumsum(np.diff(up, prepend=False))
    return up & np.isin(pieces, pieces[up & foot])


def _way_to_edge(layup: VariedLayup, start: Floats, along: Floats) -> float:
    t = np.arange(0.0, FAR_MM, 5.0)
    beside = ~pocket.inside(layup.ply_outline, start + t[:, None] * along)
    return float(t[np.argmax(beside)]) if beside.any() else FAR_MM


def line(found: PocketReport, short: list[Section], limit_mm: float) -> tuple[str, str]:
    """What becomes of a pocket, and a line of the table."""
    held = [one for one in short if one.held]
    shown = max(held or short, key=lambda one: -1.0 if np.isnan(one.bridge_mm) else one.bridge_mm, default=None)
    if shown is None:
        return "not short", f"{found.id:6}{found.bridge_height_mm or 0:9.2f}{0:7}{0:6}   no fibre is too short"
    high = "as high" if shown.bridge_mm > limit_mm else "held, lower"
    what = high if held else "drawn in"
    return what, (
        f"{found.id:6}{found.bridge_height_mm or 0:9.2f}{len(short):7}{len(held):6}{shown.bridge_mm:9.2f}"
        f"{shown.short_mm:8.3f}{shown.radius_mm:9.0f}{shown.held_mm:7.0f}   {what}"
    )


def main() -> None:
    """Look at all cases, print the table, and write it where it is wanted."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=int, nargs="*", default=CASES, help="of the trust bench, without a mistake")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pixels", default="1280x960")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    recipe = Recipe()
    limit = recipe.verdict.max_ridge_mm
    rows, of_layups = list[str](), dict[int, list[str]]()
    for number in args.cases:
        case = draw(number, args.seed)
        if case.mistake is not None or case.family != "varied":
            parser.error(f"case {number} has a mistake, or is of the first family")
        layup, given = make(case, (width, height))
        inspector = Inspector(
            recipe, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
        )
        report = inspector.inspect(given.scan)
        true = max((s.ridge_mm for s in truly(case, layup)), default=0.0)
        head = f"{number:5}  {layup.truth.mold_kind:8}{report.verdict.value:>10}{true:8.2f}"
        for found in report.pockets:
            if found.verdict.value == "crease" and "bridge" in found.reason.split(";")[0]:
                what, row = line(found, sections(layup, found, recipe.material.friction), limit)
                of_layups.setdefault(number, []).append(what)
                rows.append(head + row)
        if number not in of_layups:
            rows.append(f"{head}      -  {report.reason}"[:160])
    firsts = [
        next(w for w in ("as high", "held, lower", "drawn in", "not short") if w in of) for of in of_layups.values()
    ]
    text = "\n".join(
        [
            f"{len(args.cases)} layups of the trust bench (seed {args.seed}, {args.pixels}, debulk "
            f"{debulk.__version__}), no held excess near the limit: {len(of_layups)} are CREASE by a bridge",
            "",
            f"held by friction, and above {limit:g} mm by its own section  {firsts.count('as high'):3}",
            f"held by friction, but lower                          {firsts.count('held, lower'):3}",
            f"would be drawn in                                    {firsts.count('drawn in'):3}",
            f"no fibre is too short                                {firsts.count('not short'):3}",
            "",
            "Of each pocket: the bridge of the report; how many fibres are too short, and how many of them friction",
            "holds; of the highest of these, or of all where none is held, its height, what it lacks, its radius T/P,",
            "and μ d, up to which friction holds it; mm.",
            "",
            " case  mold       verdict   true  pocket bridge  short  held  section  lacks      T/P    μ d",
            *rows,
        ]
    )
    print(text)
    if args.out:
        args.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
