"""Make the two drawings of docs/physics.md: excess.svg and ends.svg. Every length in excess.svg is computed by debulk.

This needs Matplotlib (extra "bench").
"""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

import debulk
from debulk.results.looks import VERDICT_COLOURS, VERDICT_SIGNS
from debulk.verdict import Verdict

matplotlib.use("svg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
MOLD, PLY = "#777777", "#0a3d91"
RECIPE = debulk.Recipe()
LIMIT_MM = RECIPE.verdict.max_ridge_mm
T_MM = RECIPE.material.thickness_mm
BUMPS = ((60.0, 6.0), (60.0, 4.0), (120.0, 6.0))  # width of the foot and height, mm


def bump(width_mm: float, height_mm: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a round bump's section from foot to foot."""
    x = np.linspace(-width_mm / 2, width_mm / 2, 201)
    return x, height_mm * np.cos(np.pi * x / width_mm) ** 2


def excess_of(x: NDArray[np.float64], z: NDArray[np.float64]) -> float:
    """Return how much longer the ply is than the flat mold below it."""
    return float(np.hypot(np.diff(x), np.diff(z)).sum() - (x[-1] - x[0]))


def draw_excess() -> None:
    """Three bumps above, at one scale, and below each what the vacuum leaves of it."""
    figure, axes = plt.subplots(2, 3, figsize=(10.5, 5.0), height_ratios=(1, 1.15))
    for (width_mm, height_mm), above, below in zip(BUMPS, *axes, strict=True):
        x, z = bump(width_mm, height_mm)
        excess_mm = excess_of(x, z)
        ridge_mm = debulk.ridge.ridge_height(width_mm + excess_mm, width_mm, T_MM)
        verdict = Verdict.CREASE if ridge_mm > LIMIT_MM else Verdict.CEASE
        draw_ply(above, np.r_[-80, x, 80], np.r_[0, z, 0])
        above.set(xlim=(-70, 70), ylim=(-2, 9), title=f"{width_mm:.0f} mm wide, {height_mm:.0f} mm high")
        above.annotate(f"{excess_mm:.2f} mm longer\nthan the mold", (0, 7.6), ha="center", va="center", fontsize=9)

        fold = debulk.section.fold(excess_mm, 40.0, RECIPE)
        along = fold.points_mm - (fold.points_mm[:, 0].mean(), 0)
        draw_ply(below, *along.T)
        below.axhline(LIMIT_MM, color="#c0006a", lw=1, ls="--")
        below.annotate(f"limit {LIMIT_MM:.2f}", (-7.8, LIMIT_MM + 0.08), color="#c0006a", fontsize=8)
        below.add_patch(plt.Rectangle((-T_MM, 0), 2 * T_MM, ridge_mm, color=VERDICT_COLOURS[verdict], alpha=0.9))
        below.annotate(
            f"{VERDICT_SIGNS[verdict]} {verdict.name}: ridge {ridge_mm:.2f} mm",
            (0, 2.95),
            ha="center",
            fontsize=10,
            weight="bold",
            color=VERDICT_COLOURS[verdict],
        )
        below.set(xlim=(-8, 8), ylim=(-0.5, 3.4), xlabel="mm")
    axes[0, 0].set_ylabel("scanned, mm")
    axes[1, 0].set_ylabel("under vacuum, mm")
    save(figure, "excess.svg")


def draw_ply(axes: Axes, x: NDArray[np.float64], z: NDArray[np.float64]) -> None:
    """Draw a ply above the flat mold."""
    axes.fill_between((x.min(), x.max()), -2, 0, color=MOLD, alpha=0.35, lw=0)
    axes.plot(x, z, color=PLY, lw=1.8)
    axes.spines[["top", "right"]].set_visible(False)


def draw_ends() -> None:
    """What holds the ends of a fibre: ply on both sides, an edge, or a hollow that it is too short for."""
    figure, (inside, edge, hollow) = plt.subplots(1, 3, figsize=(10.5, 2.4))
    x, z = bump(60.0, 6.0)
    draw_ply(inside, np.r_[-80, x, 80], np.r_[0, z, 0])
    draw_ply(edge, np.r_[-80, x, 42], np.r_[0, z, 0])
    edge.fill_between((42, 80), -2, 0, color=MOLD, alpha=0.35, lw=0)
    for axes, foot in ((inside, -30), (inside, 30), (edge, -30)):
        axes.annotate("held by friction", (foot + np.sign(foot) * 20, 0.7), ha="center", fontsize=8)
    edge.annotate("", (66, 1.2), (43, 1.2), arrowprops={"arrowstyle": "->", "color": "#009e73", "lw": 2})
    edge.annotate("slides out", (55, 2.3), ha="center", fontsize=8)

    # Taut under a pressure, the ply is an arc; it touches the mold at 38 mm from the middle without a kink.
    ground, touches = np.linspace(-80, 80, 400), 38.0
    mold = -8 * np.cos(np.pi * ground.clip(-50, 50) / 100) ** 2
    slope, level = 0.08 * np.pi * np.sin(np.pi * touches / 50), -8 * np.cos(np.pi * touches / 100) ** 2
    arc = level + slope * (ground**2 - touches**2) / (2 * touches)
    hollow.fill_between(ground, -11, mold, color=MOLD, alpha=0.35, lw=0)
    hollow.plot(ground, np.where(abs(ground) < touches, arc, mold), color=PLY, lw=1.8)
    hollow.annotate("bridge", (0, -6.6), ha="center", fontsize=8)
    for axes, title, low in (
        (inside, "Inside the ply: the excess stays", -2),
        (edge, "At the edge: it can leave", -2),
        (hollow, "Over a hollow: the ply is too short", -11),
    ):
        axes.set(title=title, xlim=(-70, 70), ylim=(low, low + 11.5), xticks=(), yticks=())
        axes.spines[:].set_visible(False)
    save(figure, "ends.svg")


def save(figure: plt.Figure, name: str) -> None:
    """Write a drawing, the same bytes from the same numbers."""
    figure.tight_layout()
    figure.savefig(HERE / name, metadata={"Date": None}, facecolor="white")
    print(f"{name}: {(HERE / name).stat().st_size} bytes")


if __name__ == "__main__":
    plt.rcParams.update(
        {"svg.hashsalt": "debulk", "svg.fonttype": "none", "font.family": "sans-serif", "path.simplify": True}
    )
    draw_excess()
    draw_ends()
