"""Bridges by sections of the true ply, against the verdicts: python bench/trust/bridges.py [CASE ...] [--out FILE].

The layups are those of the trust bench, by default some of its seed 0 that have no held excess near the limit, so that
only a bridge could put a pocket above it. lab/varied/bridges.py says how the true ply is judged.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from cases import draw, make, truly

import debulk
from debulk import Inspector, Recipe
from debulk.results.report import PocketReport
from lab.varied.bridges import Section, sections

CASES = (59, 65, 72, 107, 157, 220, 314, 849)
WHAT = ("above the limit", "lower", "drawn in", "not short")


def line(found: PocketReport, short: list[Section], limit_mm: float) -> tuple[str, str]:
    """Return what becomes of a pocket, and its line of the table."""
    known = found.bridge_section
    own = "-" if known is None else f"{known.range_mm[0]:.2f}-{known.range_mm[1]:.2f}"
    row = f"{found.id:6}  {found.verdict.value:10}{found.bridge_height_mm or 0:6.2f}  {own:>9}"
    if not short:
        return WHAT[3], f"{row}{0:7}{0:6}   {WHAT[3]}"
    shown = max(short, key=lambda one: (one.bridge_mm, one.short_mm))
    what = WHAT[0] if shown.bridge_mm > limit_mm else WHAT[1] if shown.bridge_mm > 0 else WHAT[2]
    return what, (
        f"{row}{len(short):7}{sum(one.held for one in short):6}{shown.bridge_mm:9.2f}{shown.short_mm:8.3f}"
        f"{shown.radius_mm:9.0f}{shown.held_mm:7.0f}   {what}"
    )


def main() -> None:
    """Run all cases, print the table, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=int, nargs="*", default=CASES, help="of the trust bench, without a mistake")
    parser.add_argument(
        "--below", type=int, help="all layups of the second family without a mistake, up to this number"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pixels", default="1280x960")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    if args.below:
        drawn = [draw(number, args.seed) for number in range(args.below)]
        args.cases = [case.number for case in drawn if case.mistake is None and case.family == "varied"]
    width, height = map(int, args.pixels.split("x"))
    recipe = Recipe()
    limit = recipe.verdict.max_ridge_mm
    rows, of_layups, verdicts = list[str](), dict[int, list[str]](), list[tuple[str, str]]()
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
        head = f"{number:5}  {layup.truth.mold_kind:8}{report.verdict.value:10}{true:6.2f}"
        for found in report.pockets:
            if found.bridge_section is not None:
                what, row = line(found, sections(layup, found.foot_outline_mm, recipe), limit)
                of_layups.setdefault(number, []).append(what)
                verdicts.append((what, found.verdict.value))
                rows.append(head + row)
        if number not in of_layups and not args.below:
            rows.append(f"{head}      -  {report.reason}"[:160])
    text = "\n".join(
        [
            f"{len(args.cases)} layups of the trust bench (seed {args.seed}, {args.pixels}, debulk "
            f"{debulk.__version__}): in {len(of_layups)} a pocket might bridge up to {limit:g} mm",
            "",
            "by sections of the true ply   pockets   CREASE   UNDECIDED   CEASE",
            *(
                f"{what:29}{sum(w == what for w, _ in verdicts):8}"
                f"{verdicts.count((what, 'crease')):9}{verdicts.count((what, 'undecided')):12}"
                f"{verdicts.count((what, 'cease')):8}"
                for what in WHAT
            ),
            "",
            "Of each pocket: its verdict; the bridge of its net, and what the package makes of the sections of",
            "its fibres in the scan; by those of the true ply: how many are too short, and how many of them",
            "friction holds as laid; of the highest, or the shortest where all lie down, its height, what it",
            "lacks, its radius T/P, and μ d, up to which friction holds it; mm.",
            "",
            " case  mold    layup      ridge  pocket verdict     net   sections  short  held     true   lacks"
            "      T/P    μ d",
            *rows,
        ]
    )
    print(text)
    if args.out:
        args.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
