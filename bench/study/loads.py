"""Loads, friction and energies of one pocket over the spacing: python bench/study/loads.py. Writes loads.txt.

A bell 80 mm wide and 6 mm high is laid at several spacings, with six turned and shifted nets at each. A consistent
energy is the same for every net.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np

from debulk import net, sheet, solve, surface
from debulk.recipe import Recipe

RADIUS_MM, HEIGHT_MM, EDGE_MM = 40.0, 6.0, 50.0
SPACINGS_MM = (10.0, 8.0, 5.0, 3.0, 2.0, 1.5, 1.0)
SOLVED_FROM_MM = 3.0  # least spacing that is solved: finer nets take minutes
NETS = 6


def pocket() -> tuple[surface.Reference, surface.Reference]:
    """Return the mold and the ply on it."""
    x = np.arange(-80.0, 81.0)
    r = np.hypot(*np.meshgrid(x, x))
    foot = RADIUS_MM + 2
    bell = np.where(r < foot, HEIGHT_MM * np.cos(np.pi * r / (2 * foot)) ** 2, 0.0)
    return surface.Reference(np.zeros_like(bell), (x[0], x[0]), 1.0), surface.Reference(bell, (x[0], x[0]), 1.0)


def figures(spacing_mm: float, lumping: str) -> np.ndarray:
    """Return (NETS, 4) nodes, work of the vacuum and energy of a minimum in mJ, largest friction force in N."""
    mold, ply = pocket()
    turn = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    outline = RADIUS_MM * np.column_stack([np.cos(turn), np.sin(turn)])
    edge = np.array([(-300, -300), (EDGE_MM, -300), (EDGE_MM, 300), (-300, 300)])
    out = []
    for k in range(NETS):
        centre, angle = spacing_mm * np.array([0.17 * k - 0.4, 0.11 * k]), 7.0 * k
        laid = net.fibre_net(ply, mold, centre, (angle, angle + 90), spacing_mm, outline, edge, mold_tol_mm=0.25)
        model = sheet.Sheet.of_net(laid, mold, Recipe(loads={"lumping": lumping}))
        down, aside = laid.nodes_mm.copy(), laid.nodes_mm.copy()
        down[:, 2] = 0.0
        aside[:, 0] += 1.0  # moved by one millimetre, the energy of friction equals its force
        least = solve.minimise(model, starts=2, first_start=1) if spacing_mm >= SOLVED_FROM_MM else None
        energy = -least.energy_mj if least is not None and least.certified else np.nan
        out.append((len(laid.nodes_mm), model.terms(down)["vacuum"], energy, model.terms(aside)["friction"]))
    return np.array(out)


def in_columns(cells: list[str]) -> str:
    """Return pairs of cells in columns: own areas, paper."""
    return "".join(f"  {own:>14} {paper:>13}" for own, paper in zip(cells[::2], cells[1::2], strict=True))


def main() -> None:
    """Write the table."""
    about = (
        f"A bell of {2 * RADIUS_MM:g} mm, {HEIGHT_MM:g} mm high, {EDGE_MM - RADIUS_MM:g} mm from the ply's edge; mean "
        f"of {NETS} nets of each spacing, and the scatter among them. Work of the vacuum through the way down to the "
        "mold; by how much the energy of a certified minimum from a perturbed start lies below that of the net as "
        "laid; force with which friction holds the free nodes. By the net's own areas and by the paper's lumping."
    )
    lines = ["LOADS OVER THE SPACING", "", fill(about, 110), ""]
    lines.append(f"  {'':>14}" + "".join(f"  {t:^28}" for t in ("vacuum, mJ", "minimum, mJ", "friction, N")))
    lines.append(f"  {'spacing':>7} {'nodes':>6}" + 3 * f"  {'own areas':>14} {'paper':>13}")
    means = []
    for spacing in SPACINGS_MM:
        own, paper = figures(spacing, "consistent"), figures(spacing, "paper")
        values = [v[:, c] for c in (1, 2, 3) for v in (own, paper)]
        means.append([v.mean() for v in values])
        lines.append(
            f"  {spacing:>7g} {own[:, 0].mean():>6.0f}"
            + in_columns(["–" if np.isnan(v).any() else f"{v.mean():.4g} ± {v.std():.2g}" for v in values])
        )
    span = [f"{100 * (np.nanmax(c) / np.nanmin(c) - 1):.1f} %" for c in zip(*means, strict=True)]
    lines.append(f"  {'most over least':>14}" + in_columns(span)[1:])
    text = "\n".join(lines) + "\n"
    Path(__file__).with_name("loads.txt").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
