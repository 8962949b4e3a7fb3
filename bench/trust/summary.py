"""The trust bench's outcomes as text and as one picture."""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
from cases import MARGIN_MM, Outcome

from debulk.recipe import Recipe

SAID = ("cease", "undecided", "crease", "invalid", "InputError", "other error", "crash", "hang")
# The verdicts in the colours of the page.
COLOURS = ("#00775a", "#efb32c", "#d55e00", "#8b3f75", "#4a6fa5", "#8a3b12", "#000000", "#9a9a96")


def said(outcome: Outcome) -> str:
    """Return the class of an outcome; all exceptions except InputError form one class."""
    return outcome.said if outcome.said in SAID else "other error"


def text(outcomes: list[Outcome], seed: int, pixels: str) -> str:
    """Return the text: counts first, then every mistake, then every case with a wrong outcome."""
    spoiled = [o for o in outcomes if o.mistake]
    good = [o for o in outcomes if o.good]
    unspoiled = [o for o in outcomes if not o.mistake]
    seconds = np.array([o.seconds for o in outcomes if np.isfinite(o.seconds)] or [np.nan])
    limit = Recipe().verdict.max_ridge_mm
    creasing = [o for o in outcomes if o.creases]
    lines = [
        f"{len(outcomes)} scenes (seed {seed}, {pixels}), {sum(o.family == 'varied' for o in outcomes)} of the second "
        f"family, {len(spoiled)} with a mistake; a layup creases if a true excess ridge or bridge exceeds "
        f"{limit:g} mm by {MARGIN_MM:g} mm",
        "",
        f"false CEASE (passed, though a pocket creases)        "
        f"{sum(o.false_cease for o in outcomes):5} of {len(creasing)}",
        f"  of these without any mistake                       "
        f"{sum(o.false_cease for o in unspoiled):5} of {sum(o.creases for o in unspoiled)}",
        f"blind CEASE (passed with a mistake that hides all)   {sum(o.blind_cease for o in outcomes):5} of "
        f"{sum(o.blind and not o.creases for o in outcomes)}",
        f"creasing pockets not found, or said to close         {sum(o.missed for o in unspoiled):5} (layups without a "
        f"mistake; whatever the layup's verdict)",
        f"false alarms (INVALID or refused, nothing wrong)     {sum(o.false_alarm for o in outcomes):5} of {len(good)}",
        f"CREASE, nothing wrong, no ridge or bridge near limit "
        f"{sum(o.false_crease for o in outcomes):5} of {sum(o.closes for o in outcomes)}",
        f"UNDECIDED, nothing wrong, truth clear of the limit   "
        f"{sum(o.needlessly_undecided for o in outcomes):5} of {sum(o.clear for o in outcomes)}",
        f"exceptions other than InputError                     {sum(said(o) == 'other error' for o in outcomes):5}",
        f"crashes                                              {sum(o.said == 'crash' for o in outcomes):5}",
        f"over the limit of time                               {sum(o.said == 'hang' for o in outcomes):5}",
        f"CPU time of an inspection, s: median {np.median(seconds):.2f}, 99 of 100 {np.quantile(seconds, 0.99):.2f}, "
        f"most {seconds.max():.2f}",
        "",
        "what was said",
        f"{'mistake':30}" + "".join(f"{name:>12}" for name in SAID),
    ]
    for mistake, counts in table(outcomes).items():
        lines.append(f"{mistake:30}" + "".join(f"{counts[name] or '-':>12}" for name in SAID))
    lines += [
        "",
        "cases that should not be; each again by: python bench/trust/trust.py "
        f"--seed {seed} --pixels {pixels} --case N",
    ]
    for what, wrong in (
        ("FALSE CEASE", [o for o in outcomes if o.false_cease]),
        ("BLIND CEASE", [o for o in outcomes if o.blind_cease]),
        ("FALSE ALARM", [o for o in outcomes if o.false_alarm]),
        ("FALSE CREASE", [o for o in outcomes if o.false_crease]),
        ("MISSED", [o for o in unspoiled if o.missed and not o.false_cease]),
        ("ERROR", [o for o in outcomes if said(o) in ("other error", "crash", "hang")]),
    ):
        for o in wrong:
            place = f"{o.mistake or 'right'}{' ' + o.note if o.note else ''}, {o.family} {o.layup_seed} on {o.mold}"
            truth = f"ridge {o.true_ridge_mm:.2f} ({o.true_kinds}), bridge {o.true_bridge_mm:.2f}"
            lines.append(f"{what:13}{o.number:5}  {place}: {truth}, said {o.said}: {o.reason}"[:230])
    return "\n".join(line.rstrip() for line in lines) + "\n"


def table(outcomes: list[Outcome]) -> dict[str, Counter[str]]:
    """Return the counts of the verdicts, for right layups first, then for each mistake."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for o in sorted(outcomes, key=lambda o: (o.mistake != "", o.mistake)):
        counts[o.mistake or ("right, all seen" if o.good else "right, not all seen")][said(o)] += 1
    return dict(sorted(counts.items(), key=lambda item: not item[0].startswith("right")))


def picture(outcomes: list[Outcome], path: Path) -> None:
    """Draw the verdicts on each mistake (left) and the verdict over the true ridge, wrong passes in red (right)."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    counts = table(outcomes)
    fig, (left, right) = plt.subplots(1, 2, figsize=(13, 1.6 + 0.2 * len(counts)), width_ratios=[1.2, 1])
    start = np.zeros(len(counts))
    places = np.arange(len(counts))[::-1]
    totals = np.array([sum(c.values()) for c in counts.values()])
    for name, colour in zip(SAID, COLOURS, strict=True):
        share = np.array([c[name] for c in counts.values()]) / totals
        left.barh(places, share, left=start, color=colour, label=name, height=0.8)
        start += share
    left.set_yticks(places, [f"{k} ({n})" for k, n in zip(counts, totals, strict=True)], fontsize=8)
    left.set_xlim(0, 1)
    left.set_xlabel("share of the scenes (their number in brackets)")
    left.legend(ncol=4, fontsize=7, loc="lower center", bbox_to_anchor=(0.4, 1.0), frameon=False)
    limit = Recipe().verdict.max_ridge_mm
    order = {name: k for k, name in enumerate(SAID)}
    rng = np.random.default_rng(0)
    for o in outcomes:
        wrong = o.false_cease or o.blind_cease
        y = order[said(o)] + rng.uniform(-0.32, 0.32)
        right.plot(
            o.true_ridge_mm,
            y,
            "x" if wrong else "o" if o.mistake else "s",
            ms=6 if wrong else 3,
            color="#d03b3b" if wrong else "#9a9a96" if o.mistake else "#1c5cab",
        )
    right.axvline(limit, color="#444", lw=0.8)
    right.text(limit, len(SAID) - 0.6, " limit", fontsize=8, va="top")
    right.set_yticks(range(len(SAID)), SAID)
    right.set_ylim(-0.5, len(SAID) - 0.5)
    right.set_xscale("log")
    right.set_xticks([0.2, 0.5, 1, 2, 4], ["0.2", "0.5", "1", "2", "4"])
    right.minorticks_off()
    right.set_xlabel("highest true ridge, ΔL/2 + 0.43 t of the held excess, mm")
    right.set_title("what was said: blue right layups, grey with a mistake,\nred × passed wrongly", fontsize=9)
    for axis in (left, right):
        axis.spines[["top", "right"]].set_visible(False)
    fig.tight_layout()
    fig.savefig(path, dpi=110)
