"""Score any program's answers on the open benchmark: python bench/open/scorer.py ANSWERS.csv [...]. Needs NumPy only.

An answer is a row with the number of a `scene` and at least one of `verdict` (CREASE, CEASE, UNDECIDED or INVALID),
`score` (larger: more likely to crease, in any unit) and `probability` (of creasing). With `x_mm` and `y_mm` it is about
a pocket at that place of the mold's frame, without them about the whole ply. docs/open_benchmark.md has the rules.
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
SCENES = 200
VERDICTS = {"CEASE": 0.0, "UNDECIDED": 1.0, "INVALID": 1.0, "CREASE": 2.0}
SAID = ("verdict", "score", "probability")
WIDTHS = {
    "escapes": 8,
    "at most": 9,
    "false alarms": 14,
    "UNDECIDED": 11,
    "AUC": 7,
    "alarms at no escape": 21,
    "Brier": 8,
}
Columns = dict[str, np.ndarray]  # one value per row of a file; NaN: the row does not say


def truths(path: Path = HERE / "pockets.csv") -> tuple[Columns, np.ndarray]:
    """Return the pockets, and for each of the scenes the share of members in which its worst pocket creases."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    names = ("scene", "x_mm", "y_mm", "radius_mm", "share")
    pockets = {name: np.array([float(row[name]) for row in rows]) for name in names}
    plies = np.zeros(SCENES)
    np.maximum.at(plies, pockets["scene"].astype(int), pockets["share"])
    return pockets, plies


def read(path: Path) -> Columns:
    """Return the columns of a file of answers; a row that cannot be understood is a ValueError that names it."""
    rows = []
    with path.open(newline="") as file:
        for line, row in enumerate(csv.DictReader(file), 2):
            try:
                rows.append(_row({k: (v or "").strip() for k, v in row.items() if k}))
            except ValueError as error:
                raise ValueError(f"{path}, line {line}: {error}") from None
    names = ("scene", "x_mm", "y_mm", *SAID)
    return dict(zip(names, np.array(rows).reshape(-1, len(names)).T, strict=True))


def _row(row: dict[str, str]) -> list[float]:
    verdict = row.get("verdict", "").upper()
    if verdict and verdict not in VERDICTS:
        raise ValueError(f"verdict: expected one of {', '.join(VERDICTS)}, but got {verdict}")
    x, y, score, probability = (float(row.get(k) or "nan") for k in ("x_mm", "y_mm", "score", "probability"))
    if not (math.isnan(probability) or 0 <= probability <= 1):
        raise ValueError(f"probability: expected a number from 0 to 1, but got {probability}")
    if math.isnan(x) != math.isnan(y):
        raise ValueError("x_mm, y_mm: expected both or none")
    if not 0 <= (scene := int(row.get("scene", ""))) < SCENES:
        raise ValueError(f"scene: expected a number from 0 to {SCENES - 1}, but got {scene}")
    return [scene, x, y, VERDICTS[verdict] if verdict else math.nan, score, probability]


def _worst(said: Columns, rows: np.ndarray) -> list[float]:
    """Return the largest verdict, score and probability of some rows; NaN where none says any."""
    return [float(np.nanmax(v)) if np.isfinite(v := said[name][rows]).any() else math.nan for name in SAID]


def of_plies(said: Columns, scenes: int) -> Columns:
    """Return what was said about each ply: by its own row, else by the worst of its pockets'."""
    own = np.isnan(said["x_mm"])
    mine = [said["scene"] == k for k in range(scenes)]
    return dict(zip(SAID, np.array([_worst(said, m & own if (m & own).any() else m) for m in mine]).T, strict=True))


def of_pockets(said: Columns, pockets: Columns) -> Columns:
    """Return what was said about each pocket: by the worst of the rows within its radius."""
    found = []
    for scene, x, y, radius in zip(*(pockets[k] for k in ("scene", "x_mm", "y_mm", "radius_mm")), strict=True):
        near = np.hypot(said["x_mm"] - x, said["y_mm"] - y) <= radius
        found.append(_worst(said, near & (said["scene"] == scene)))
    return dict(zip(SAID, np.array(found).T, strict=True))


def upper_bound(events: int, trials: int, confidence: float = 0.95) -> float:
    """Return the one-sided upper bound of a rate by Clopper and Pearson."""
    if events >= trials:
        return 1.0
    low, high = events / trials, 1.0
    for _ in range(60):
        p = 0.5 * (low + high)
        below = sum(math.comb(trials, k) * p**k * (1 - p) ** (trials - k) for k in range(events + 1))
        low, high = (p, high) if below > 1 - confidence else (low, p)
    return high


def score(said: Columns, share: np.ndarray) -> dict[str, float]:
    """Return the figures by their headings; what is missing counts as CEASE, the lowest score and probability 0."""
    creases = share > 0
    out: dict[str, float] = {}
    verdict, figure, probability = (said[name] for name in SAID)
    if np.isfinite(verdict).any():
        escapes = int((creases & ~(verdict > VERDICTS["CEASE"])).sum())
        out["escapes"], out["at most"] = escapes, upper_bound(escapes, int(creases.sum()))
        out["false alarms"] = int((~creases & (verdict == VERDICTS["CREASE"])).sum())
        out["UNDECIDED"] = int((verdict == VERDICTS["UNDECIDED"]).sum())
    figure = figure if np.isfinite(figure).any() else probability
    if np.isfinite(figure).any() and 0 < creases.sum() < len(creases):
        figure = np.where(np.isnan(figure), -np.inf, figure)
        a, b = figure[creases][:, None], figure[~creases][None, :]
        out["AUC"] = float(((a > b) + 0.5 * (a == b)).mean())
        out["alarms at no escape"] = int((b >= a.min()).sum())
    if np.isfinite(probability).any():
        out["Brier"] = float(np.mean((np.nan_to_num(probability) - share) ** 2))
    return out


def table(files: list[Path]) -> str:
    """Return the table of some files of answers, by ply and by pocket."""
    pockets, plies = truths()
    lines = []
    for about, share in (("plies", plies), ("pockets", pockets["share"])):
        title = f"{len(share)} {about}, {(share > 0).sum()} crease"
        lines.append(f"{title:<30}" + "".join(f"{name:>{width}}" for name, width in WIDTHS.items()))
        for path in files:
            said = read(path)
            if about == "plies" or np.isfinite(said["x_mm"]).any():
                found = score(of_plies(said, SCENES) if about == "plies" else of_pockets(said, pockets), share)
                lines.append(f"  {path.stem:<28}" + "".join(_cell(found.get(n), n, w) for n, w in WIDTHS.items()))
        lines.append("")
    return "\n".join(lines)


def _cell(value: float | None, name: str, width: int) -> str:
    if value is None:
        return f"{'-':>{width}}"
    text = f"{100 * value:.1f} %" if name == "at most" else f"{value:.3f}" if isinstance(value, float) else str(value)
    return f"{text:>{width}}"


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        print(table([Path(name) for name in sys.argv[1:]]))
    except (OSError, ValueError) as problem:
        sys.exit(f"scorer: {problem}")
