"""Score every criterion on the referee's table: python bench/referee/score.py. Writes referee.txt and referee.png.

The truth about a pocket is a share: the share of the referee's members (perturbed starts of our own fine nets, noisy
runs of MuJoCo) whose worst fold has gathered more excess than a ridge at the limit holds. This is right for an elastic
sheet with the table's E, but never for a real part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from textwrap import fill

import figures
import numpy as np
from members import changes, ensembles, refusals
from pockets import LIMIT_EXCESS_MM, LIMIT_MM
from tables import HERE
from truth import Truth, extrapolated_excess, ridge, truths

RMS_LIMIT_MM = 0.30
MARGIN_MM = 0.02  # margin of the ridge height by excess within which the rule decides nothing
SURE = 0.9  # share of creasing members above which a CEASE is false without doubt


@dataclass(frozen=True)
class Criterion:
    """A figure, its limit, and the margin round the limit within which the figure decides nothing."""

    name: str
    figure: Callable[[Truth], float]
    limit: float
    margin: float

    def forecast(self, truth: Truth) -> float:
        """Return the verdict as a number: 1 for CREASE, 0 for CEASE, 0.5 for UNDECIDED."""
        value = self.figure(truth)
        return 1.0 if value > self.limit + self.margin else 0.0 if value <= self.limit - self.margin else 0.5


def _excess(column: str) -> Callable[[Truth], float]:
    return lambda t: ridge(t.value(column))


def _extrapolated(truth: Truth) -> float:
    return ridge(extrapolated_excess(truth))


def _verdict(truth: Truth) -> float:
    return {"crease": 1.0, "cease": 0.0}.get(truth.row["verdict"], 0.5)


CRITERIA = (
    Criterion("RMS (the paper's)", lambda t: t.value("rms_mm"), RMS_LIMIT_MM, 0.01),
    Criterion("ridge of the coarse minimum", lambda t: t.value("ridge_mm"), LIMIT_MM, 0.05),
    Criterion("both over all starts (today)", _verdict, 0.5, 0.01),
    Criterion("excess, held fibres", _excess("excess_mm"), LIMIT_MM, MARGIN_MM),
    Criterion("excess, all fibres", _excess("excess_all_mm"), LIMIT_MM, MARGIN_MM),
    Criterion("excess at half the spacing", _excess("excess_half_spacing_mm"), LIMIT_MM, MARGIN_MM),
    Criterion("excess, extrapolated", _extrapolated, LIMIT_MM, MARGIN_MM),
    *(
        Criterion(f"excess in a window of {w:.0f} mm", _excess(f"excess_window_{w:.0f}_mm"), LIMIT_MM, MARGIN_MM)
        for w in figures.WINDOWS_MM
    ),
)


def auc(values: np.ndarray, shares: np.ndarray) -> float:
    """Return the chance that a creasing pocket has a larger figure than a ceasing one, weighted by the shares."""
    above = (values[:, None] > values[None, :]) + 0.5 * (values[:, None] == values[None, :])
    weight = shares[:, None] * (1 - shares[None, :])
    return float((above * weight).sum() / weight.sum()) if weight.sum() > 0 else float("nan")


def scores(title: str, chosen: list[Truth], referee: str) -> list[str]:
    """Return the criteria's table for some pockets."""
    judged = [(t, t.share(referee)) for t in chosen]
    pairs = [(t, s) for t, s in judged if s is not None]
    if not pairs:
        return []
    shares = np.array([s for _, s in pairs])
    members = sum(len(g) for t, _ in pairs for r, g in t.gathered.items() if referee in (r, "both"))
    split = int(((shares > 0) & (shares < 1)).sum())
    lines = [
        "",
        f"{title}: {len(pairs)} pockets with {members} members, {int((shares == 1).sum())} crease and "
        f"{int((shares == 0).sum())} cease in every member, {split} in some",
        f"  {'':<30} {'false CEASE':>11} {'of them sure':>12} {'false CREASE':>12} {'UNDECIDED':>9} {'Brier':>6} "
        f"{'AUC':>6}",
    ]
    for criterion in CRITERIA:
        said = np.array([criterion.forecast(t) for t, _ in pairs])
        values = np.array([criterion.figure(t) for t, _ in pairs])
        lines.append(
            f"  {criterion.name:<30} {int(((said == 0) & (shares > 0.5)).sum()):>11} "
            f"{int(((said == 0) & (shares >= SURE)).sum()):>12} {int(((said == 1) & (shares < 0.5)).sum()):>12} "
            f"{int((said == 0.5).sum()):>9} {np.mean((said - shares) ** 2):>6.3f} {auc(values, shares):>6.3f}"
        )
    return lines


def confusion(chosen: list[Truth], referee: str) -> list[str]:
    """Return the verdicts against the outcomes of those pockets whose members all agree."""
    lines = ["", f"Pockets on which all members agree ({referee}): CREASE, UNDECIDED, CEASE said of those that"]
    lines.append(f"  {'':<30} {'crease':>16} {'cease':>16}")
    for criterion in CRITERIA:
        cells = []
        for outcome in (1.0, 0.0):
            said = [criterion.forecast(t) for t in chosen if t.share(referee) == outcome]
            cells.append("/".join(f"{said.count(v):>3}" for v in (1.0, 0.5, 0.0)))
        lines.append(f"  {criterion.name:<30} {cells[0]:>16} {cells[1]:>16}")
    return lines


def heights(chosen: list[Truth], referee: str) -> list[str]:
    """Return the comparison of the elastic fold of the whole excess with the members' heights."""
    ratio, spread, error = [], [], []
    for t in chosen:
        members = t.heights.get(referee, [])
        predicted = t.value("elastic_height_mm")
        if len(members) < 2 or not predicted > 0:
            continue
        ratio.append(np.mean(members) / predicted)
        spread.append(float(np.std(members, ddof=1)))
        error.append(abs(np.mean(members) - predicted))
    if not ratio:
        return []
    ratio = np.array(ratio)
    quantiles = np.quantile(ratio, [0.1, 0.5, 0.9])
    z = np.median(np.array(error) / np.maximum(spread, 0.01))
    return [
        "",
        f"Height over section.fold of the largest excess ({referee}, {len(ratio)} pockets with two members or more): "
        f"median {quantiles[1]:.2f}, 10 to 90 % {quantiles[0]:.2f} to {quantiles[2]:.2f}; spread of the members "
        f"{np.median(spread):.3f} mm in the median; error over spread (at least 0.01 mm) {z:.1f} in the median",
    ]


def shared(chosen: list[Truth], referee: str) -> list[str]:
    """Return the share of the largest excess that one fold gathers."""
    parts = [np.array(t.gathered[referee]) / extrapolated_excess(t) for t in chosen if t.gathered.get(referee)]
    parts = [p for p in parts if np.isfinite(p).all()]
    if not parts:
        return []
    every = np.concatenate(parts)
    largest = np.array([p.max() for p in parts])
    low, middle, high = np.quantile(every, [0.1, 0.5, 0.9])
    return [
        f"Gathered by the worst fold, of the largest excess, extrapolated ({referee}): median {middle:.2f}, 10 to 90 % "
        f"{low:.2f} to {high:.2f} of the members; largest member of a pocket {np.median(largest):.2f} in the median"
    ]


def agreement(chosen: list[Truth]) -> list[str]:
    """Return the comparison of both referees on the same pockets."""
    both = [t for t in chosen if t.share("own") is not None and t.share("mujoco") is not None]
    if not both:
        return []
    a, b = (np.array([np.mean(t.gathered[r]) for t in both]) for r in ("own", "mujoco"))
    same = sum((t.share("own") > 0.5) == (t.share("mujoco") > 0.5) for t in both)
    return [
        f"Both referees on {len(both)} pockets: the same side of the limit for {same}; mean gathered excess, MuJoCo "
        f"over own: median {np.median(b / a):.2f}, {np.min(b / a):.2f} to {np.max(b / a):.2f}"
    ]


def text(every: list[Truth]) -> str:
    """Return the report as text."""
    inner, edge = [t for t in every if not t.at_edge], [t for t in every if t.at_edge]
    about = (
        "Truth: the share of the members whose worst fold gathers more excess than a ridge of 0.60 mm holds "
        f"({LIMIT_EXCESS_MM:.3f} mm, by h = dL/2 + 0.43 t). False CEASE: a CEASE where more than half of the members "
        "crease; sure: 9 in 10 or more. Brier: of 1 for CREASE, 0.5 for UNDECIDED, 0 for CEASE. It proves a criterion "
        "right for an elastic sheet with E = 360 MPa, never right for a part."
    )
    lines = ["THE REFEREE", "", fill(about, 110)]
    for title, chosen in (("Inside the ply", inner), ("At the ply's edge", edge)):
        for referee, name in (("own", "own fine nets"), ("mujoco", "MuJoCo"), ("both", "members of both")):
            lines += scores(f"{title}, {name}", chosen, referee)
    for referee in ("own", "mujoco"):
        lines += confusion(inner, referee)
        lines += heights(inner, referee)
        lines += shared(inner, referee)
    lines += ["", *agreement(every), *ensembles(every), *refusals(), *changes(every)]
    return "\n".join(fill(line, 116) if len(line) > 116 else line for line in lines) + "\n"


def picture(every: list[Truth]) -> None:
    """Draw the ridge by the rule against the referee's result, with one mark per member."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.2, 7.2))
    top = 1.55
    axes.axvspan(LIMIT_MM - MARGIN_MM, LIMIT_MM + MARGIN_MM, color="0.88", lw=0, label="undecided by the rule")
    axes.fill_between([0, LIMIT_MM - MARGIN_MM], LIMIT_MM, top, color="#f6d5d0", lw=0)
    axes.text(0.12, top - 0.03, "false CEASE: the rule lets\nit pass, a fold stands", va="top", color="#8c2d19")
    axes.text(top - 0.02, 0.52, "false CREASE", ha="right", color="0.35")
    axes.plot([0, top], [0, top], color="0.6", lw=0.8)
    axes.axhline(LIMIT_MM, color="0.3", lw=0.8)
    styles = {
        ("own", False): ("o", "#2b6ca3", "own fine nets, inside"),
        ("own", True): ("o", "#9cc3e0", "own fine nets, at the ply's edge"),
        ("mujoco", False): ("D", "#d9822b", "MuJoCo, inside"),
        ("mujoco", True): ("D", "#f0c08a", "MuJoCo, at the ply's edge"),
    }
    for (referee, edge), (mark, colour, label) in styles.items():
        x, y = [], []
        for t in every:
            if t.at_edge == edge:
                members = t.gathered.get(referee, [])
                x += [min(_extrapolated(t), top)] * len(members)
                y += [min(ridge(g), top) for g in members]
        if x:
            axes.scatter(x, y, 16, c=colour, marker=mark, alpha=0.75, lw=0, label=f"{label} ({len(x)} members)")
    axes.set(
        xlim=(0.1, top), ylim=(0.1, top), aspect="equal",
        xlabel="ridge by the largest excess of a held fibre of the laid net (extrapolated), mm",
        ylabel="ridge by the excess that the referee's worst fold gathered, mm",
    )  # fmt: skip
    axes.set_title(
        "What the rule says before the solve, and what converged physics does\n"
        "(an elastic sheet with E = 360 MPa; no part was tested)",
        fontsize=11,
    )
    axes.legend(loc="lower right", fontsize=8)
    figure.savefig(HERE / "referee.png", dpi=110, bbox_inches="tight")


def main() -> None:
    """Write the text and the picture."""
    every = truths()
    report = text(every)
    (HERE / "referee.txt").write_text(report, encoding="utf-8")
    picture(every)
    print(report)


if __name__ == "__main__":
    main()
