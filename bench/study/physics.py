"""What each optional term of the energy changes, and costs: python bench/study/physics.py. Writes physics.txt.

Pockets of virtual layups are evaluated without the terms and with each of them: those at the ply's edge as an
inspection does, where the net decides with its rim slipping and held, and those inside by the paper's criterion, where
the excess would decide. Other seeds show what the choice of starts alone changes.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from debulk import Inspector, Recipe, _core, scenes
from debulk.inspection.evaluate.evaluation import evaluate
from debulk.results.report import PocketReport

EDGE_LAYUPS, INNER_LAYUP, INNER = range(110, 120), 110, 8
T, B, K = 0.36, 36.0, 1.0  # N mm, N mm, N/mm3: docs/model.md, section 3.1
NORMAL = {"loads": {"pressure_direction": "normal"}}
ALL = {"torsion_n_mm": T, "in_plane_bending_n_mm": B, "tack_n_mm3": K}
SETTINGS: dict[str, Mapping[str, Any]] = {
    "none (default)": {},
    "none, another seed": {"solve": {"seed": 1}},
    "none, a third seed": {"solve": {"seed": 2}},
    f"torsion {T:g} N mm": {"material": {"torsion_n_mm": T}},
    f"in-plane bending {B:g} N mm": {"material": {"in_plane_bending_n_mm": B}},
    "pressure along the normal": NORMAL,
    f"tack {K:g} N/mm3": {"material": {"tack_n_mm3": K}},
    "all four": {"material": ALL, **NORMAL},
}
SHOWN = ("CEASE", "UNDECIDED", "CREASE")


def recipe(at_edge: bool, setting: Mapping[str, Any]) -> Recipe:
    """Return the recipe of a pocket."""
    solve = {"when": "always", **setting.get("solve", {})}
    return Recipe(**{**setting, "solve": solve, "verdict": {} if at_edge else {"criterion": "paper"}})


def results() -> list[tuple[bool, dict[str, tuple[PocketReport, float]]]]:
    """Return for each pocket whether it is at the edge, and by setting its report and the CPU time in ms."""
    out = []
    for seed in EDGE_LAYUPS:
        layup = scenes.layup(seed)
        inspector = Inspector(Recipe(), layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
        inside = 0
        for found in inspector.find(layup.scan).pockets:
            at_edge = found.foot.touches_ply_edge
            inside += not at_edge
            if not at_edge and (seed != INNER_LAYUP or inside > INNER):
                continue
            evaluate(found, inspector.ply, _core.Stop())  # so that no setting pays for what is done once
            by_setting = {}
            for name, setting in SETTINGS.items():
                ply = replace(inspector.ply, recipe=recipe(at_edge, setting))
                began = time.process_time()
                report = evaluate(found, ply, _core.Stop()).report
                by_setting[name] = report, 1e3 * (time.process_time() - began)
            out.append((at_edge, by_setting))
            print(seed, found.number, [report.verdict.name for report, _ in by_setting.values()], flush=True)
    return out


def row(name: str, at_edge: bool, found: list[tuple[bool, dict[str, tuple[PocketReport, float]]]]) -> str:
    """Return the row of a setting, of the pockets at the edge or of those inside."""
    pairs = [(by[name][0], by["none (default)"][0]) for edge, by in found if edge == at_edge]
    cpu_ms = [by[name][1] for edge, by in found if edge == at_edge]
    verdicts = Counter(one.verdict.name for one, _ in pairs)
    turned = sum(one.verdict is not plain.verdict for one, plain in pairs)
    certified = sum(one.solve is not None and one.solve.certified for one, _ in pairs)
    figures = np.array([[(p.ridge_height_mm, p.rms_mm) for p in pair] for pair in pairs], dtype=float)
    change = (figures[:, 0] - figures[:, 1]).T
    changes = [f"{np.nanmedian(v).round(3) + 0:>+7.3f} {np.nanmax(np.abs(v)):>6.3f}" for v in change]
    cells = " ".join(f"{verdicts[v]:>9}" for v in SHOWN)
    counts = f"{cells} {turned:>9} {f'{certified} of {len(pairs)}':>9}"
    return f"  {name:<26} {counts} {' '.join(changes)} {np.mean(cpu_ms):>6.0f}"


def main() -> None:
    """Write the table."""
    found = results()
    about = (
        f"Pockets at the edge of layups {EDGE_LAYUPS[0]} to {EDGE_LAYUPS[-1]}, judged as in an inspection, and the "
        f"{INNER} largest inside layup {INNER_LAYUP}, judged by the paper's criterion. Turned: verdicts that differ "
        "from those without the terms. Ridge and RMS of the minimum, mm: median and largest change from those without. "
        "CPU: ms per pocket, mean, net and post-processing included, on a machine at other work."
    )
    columns = " ".join(f"{v:>9}" for v in (*SHOWN, "turned", "certified"))
    head = f"  {'':<26} {columns} {'ridge':>14} {'RMS':>14} {'CPU':>6}"
    lines = ["OPTIONAL TERMS OF THE ENERGY", "", fill(about, 110)]
    for at_edge in (True, False):
        lines += ["", "At the ply's edge" if at_edge else "Inside the ply, by the paper's criterion", head]
        lines += [row(name, at_edge, found) for name in SETTINGS]
    text = "\n".join(lines) + "\n"
    Path(__file__).with_name("physics.txt").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
