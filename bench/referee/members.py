"""The referee's single runs: MuJoCo's ensembles, the runs that were refused, and the effect of changed physics."""

from __future__ import annotations

from collections import defaultdict

import mujoco_runs
import numpy as np
import own
from mujoco_ply import MOST_STRAIN
from pockets import LIMIT_EXCESS_MM
from truth import Truth, extrapolated_excess, ridge


def ensembles(every: list[Truth]) -> list[str]:
    """Return MuJoCo's members of each pocket beside the rule's ridge and our own nets, nearest to the limit first."""
    judged = sorted(
        (t for t in every if t.gathered.get("mujoco")), key=lambda t: abs(extrapolated_excess(t) - LIMIT_EXCESS_MM)
    )
    if not judged:
        return []
    lines = [
        "",
        f"MuJoCo's members, by the rule's distance from the limit ({LIMIT_EXCESS_MM:.3f} mm of excess): largest excess "
        "of a held fibre, extrapolated; ridge by it; members that crease, of all; what their worst folds gathered, and "
        "the first member's at half the speed of the ramp, and those of the own nets, mm. E: at the ply's edge.",
        f"  {'pocket':<13} {'excess':>6} {'ridge':>6} {'crease':>8} {'gathered':>16} {'half speed':>10} "
        f"{'own nets':>16}",
    ]
    slow = {
        r["pocket"]: [float(r["gathered_mm"])]
        for r in mujoco_runs.table().rows()
        if r["variant"] == "half speed" and r["accepted"] == "1"
    }
    for t in judged:
        members, fine = t.gathered["mujoco"], t.gathered.get("own", [])
        excess = extrapolated_excess(t)
        crease = f"{sum(g > LIMIT_EXCESS_MM for g in members)} of {len(members)}"
        lines.append(
            f"  {t.name + (' E' if t.at_edge else ''):<13} {excess:>6.3f} {ridge(excess):>6.3f} {crease:>8} "
            f"{span(members):>16} {span(slow.get(t.name, [])):>10} {span(fine):>16}"
        )
    counts = np.array([len(t.gathered["mujoco"]) for t in judged])
    reached = ", ".join(f"{int((counts >= n).sum())} with {n}" for n in range(1, int(counts.max()) + 1))
    return [*lines, f"  Pockets with so many members or more: {reached}"]


def span(values: list[float]) -> str:
    """Return the least and the greatest value as text, or the only one."""
    if not values:
        return ""
    return f"{min(values):.3f}" + (f" to {max(values):.3f}" if len(values) > 1 else "")


def refusals() -> list[str]:
    """Return as text how many runs do not count, and why."""
    lines = ["", "Runs refused:"]
    for name, rows, good in (
        ("own", own.table().rows(), "certified"),
        ("mujoco", mujoco_runs.table().rows(), "accepted"),
    ):
        for kind, chosen in (
            ("the table's", [r for r in rows if not r["variant"]]),
            ("variants", [r for r in rows if r["variant"]]),
        ):
            refused = [r for r in chosen if r[good] != "1"]
            which = ", ".join(f"{_case(r)}{_why(r)}" for r in refused)
            lines.append(f"  {name:<7} {kind:<12} {len(refused)} of {len(chosen)}{': ' + which if which else ''}")
    return lines


def _case(row: dict[str, str]) -> str:
    return " ".join(filter(None, (row["pocket"], row.get("member") or row.get("start"), row["variant"])))


def _why(row: dict[str, str]) -> str:
    if "strain" not in row:
        return ""
    strain, speed = float(row["strain"]), float(row["speed_mm_per_step"])
    return f" (strain {strain:.1e})" if not strain <= MOST_STRAIN else f" (in motion, {speed:.2e} mm a step)"


def changes(every: list[Truth]) -> list[str]:
    """Return how much each change affects the gathered excess and the height, and which pockets change sides."""
    lines = []
    known = {t.name: t for t in every}
    for referee, table in (("own", own.table()), ("mujoco", mujoco_runs.table())):
        good = "certified" if referee == "own" else "accepted"
        moved: dict[tuple[str, str], list[tuple[float, float, str]]] = defaultdict(list)
        for r in table.rows():
            t = known.get(r["pocket"])
            if not r["variant"] or r[good] != "1" or t is None or not t.gathered.get(referee):
                continue
            gathered, before = float(r["gathered_mm"]), float(np.mean(t.gathered[referee]))
            crossed = ""
            if (gathered > LIMIT_EXCESS_MM) != (before > LIMIT_EXCESS_MM):
                crossed = f"{t.name} {before:.2f} to {gathered:.2f}"
            height = float(r["height_mm"]) / float(np.mean(t.heights[referee]))
            moved["at the edge" if t.at_edge else "inside", r["variant"]].append((gathered / before, height, crossed))
        for (place, variant), found in moved.items():
            ratios, heights = (np.array([f[k] for f in found]) for k in (0, 1))
            crossed = "; ".join(f[2] for f in found if f[2])
            lines.append(
                f"  {referee:<7} {place:<11} {variant:<16} {len(found):>3} runs: gathered x {np.median(ratios):.2f} "
                f"({ratios.min():.2f} to {ratios.max():.2f}), height x {np.median(heights):.2f} "
                f"({heights.min():.2f} to {heights.max():.2f})"
            )
            if crossed:
                lines.append(f"          other side: {crossed}")
    return ["", "What a change does, over the mean of the pocket's members:", *lines] if lines else []
