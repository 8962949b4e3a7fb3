"""Plies too short for a dish of the mold, against closed forms: python bench/trust/dishes.py [--out FILE].

A ply lies on a plane with a dish of radius R and half width a, and is flatter than the dish by a factor. When it is
pressed down, its fibres are strings of the radius T/P, which friction holds up to μ d. The string over the middle
stands a²/2 (1/R - P/T) off the dish.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import debulk

Floats = NDArray[np.float64]

DISHES_MM = ((40.0, 15.0), (60.0, 25.0), (100.0, 25.0), (100.0, 35.0), (150.0, 45.0), (250.0, 60.0))  # R, a
FLATTER = (1.15, 1.3, 1.5, 2.0)
HALF_PLY_MM, PITCH_MM, NOISE_MM = 600.0, 1.5, 0.02
OUTLINE = HALF_PLY_MM * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


def clouds(radius_mm: float, half_width_mm: float, flatter: float) -> tuple[Floats, Floats]:
    """Return the points of the mold and of the ply, each with noise of its own."""
    rng = np.random.default_rng(0)
    x = np.arange(-HALF_PLY_MM - 40, HALF_PLY_MM + 41, PITCH_MM)
    xx, yy = (v.ravel() for v in np.meshgrid(x, x))
    sag = np.maximum(0.0, half_width_mm**2 - xx**2 - yy**2) / (2 * radius_mm)
    on_ply = np.maximum(np.abs(xx), np.abs(yy)) < HALF_PLY_MM
    top = np.where(on_ply, debulk.Recipe().material.thickness_mm - sag / flatter, -sag)
    mold, ply = (np.column_stack([xx, yy, z + rng.normal(0, NOISE_MM, z.shape)]) for z in (-sag, top))
    return mold, ply


def bridge_mm(radius_mm: float, half_width_mm: float, flatter: float) -> float:
    """Return the height of the remaining bridge, including the ply; 0 if it is drawn in."""
    material = debulk.Recipe().material
    held_mm = material.friction * (HALF_PLY_MM - half_width_mm)
    gap_mm = half_width_mm**2 / 2 * (1 / radius_mm - 1 / min(flatter * radius_mm, held_mm))
    return gap_mm + material.thickness_mm / material.bulk_factor if gap_mm > 0 else 0.0


def line(radius_mm: float, half_width_mm: float, flatter: float) -> str:
    """Return one row of the table."""
    mold, ply = clouds(radius_mm, half_width_mm, flatter)
    report = debulk.Inspector(None, mold, OUTLINE).inspect(ply)
    section = next((p.bridge_section for p in report.pockets if p.bridge_section), None)
    told = "" if section is None else f"{section.range_mm[0]:.2f}-{section.range_mm[1]:.2f}"
    as_laid_mm = half_width_mm**2 / (2 * radius_mm) * (1 - 1 / flatter)
    true_mm = bridge_mm(radius_mm, half_width_mm, flatter)
    figures = f"{radius_mm:5.0f}{half_width_mm:6.0f}{flatter:7.2f}{as_laid_mm:9.2f}{true_mm:8.2f}"
    return f"{figures}   {told:<11}{report.verdict.value}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    limit_mm = debulk.Recipe().verdict.max_ridge_mm
    lines = [
        f"Plies too short for a dish, debulk {debulk.__version__}; a bridge above {limit_mm:g} mm creases",
        "",
        "R, a: the dish's; laid: how far the ply stands off it in the scan; bridge: what stays of that, with the",
        "ply's 0.25 mm; sections: the report's range for it; mm.",
        "",
        "    R     a  flatter    laid  bridge   sections   verdict",
        *(line(*dish, flatter) for dish, flatter in product(DISHES_MM, FLATTER)),
    ]
    text = "\n".join(lines) + "\n"
    print(text)
    if args.out:
        args.out.write_text(text)


if __name__ == "__main__":
    main()
