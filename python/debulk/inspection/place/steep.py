"""Where the mold below the ply is too steep for heights along z, or for the camera's rays, to show the ply.

Heights and their noise grow by the tangent of the slope, and the points of a scan lie farther apart on the mold by the
cosine of the angle between a ray and the mold's normal. On spars of 15 to 80 mm radius plies were judged right with
slopes up to 66 degrees and rays up to 70; beyond 70, scan and reference have gaps (bench/trust/steep.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk import pocket
from debulk.arrays import Floats
from debulk.inspection.evidence.pieces import pieces_of
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.results.finding import Finding
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm, xy_of


@dataclass(frozen=True)
class Limits:
    """Of a mold below the ply; bench/trust/steep.py has spars up to the slopes at which plies were judged right."""

    slope_deg: float = 65.0  # largest angle of the mold's normal to z
    ray_deg: float = 70.0  # largest angle of the mold's normal to the ray that sees it
    least_mm2: float = 200.0  # of the mold's surface in one piece: an edge of a mold, or of plies below, is no flank


LIMITS = Limits()


def too_steep(setup: Setup) -> Finding | None:
    """Return what is wrong if a piece of the mold below the ply is too steep for a verdict, else None.

    If the reference is the image of a camera, the angle to its rays counts as well. Without an outline it is not known.
    """
    prepared, ply_outline = setup.prepared, setup.outline
    if ply_outline is None:
        return None
    low, high = prepared.reference.box_mm
    cell_mm = prepared.reference.spacing_mm
    low, high = np.maximum(low, ply_outline.min(axis=0)), np.minimum(high, ply_outline.max(axis=0))
    x, y = (np.arange(a, b, cell_mm) for a, b in zip(low, high, strict=True))
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    slope = prepared.reference.gradient(xy)
    upright = np.sqrt(1 + (slope**2).sum(axis=1))
    to_z, to_ray = _degrees(1 / upright), np.zeros(len(xy))
    if prepared.image is not None:
        ray = setup.pose[:3, 3] - np.column_stack([xy, prepared.reference.height(xy)])
        facing = ray[:, 2] - (slope * ray[:, :2]).sum(axis=1)
        to_ray = _degrees(facing / upright / np.linalg.norm(ray, axis=1))
    beyond = np.maximum(to_z - LIMITS.slope_deg, to_ray - LIMITS.ray_deg)
    steep = (beyond > 0) & pocket.inside(ply_outline, xy)
    labels = pieces_of(steep.reshape(len(y), len(x)), 8).labels.ravel()
    area_mm2 = np.bincount(labels, np.where(steep, upright, 0.0)) * cell_mm**2
    largest = int(np.argmax(area_mm2))
    if area_mm2[largest] < LIMITS.least_mm2:
        return None
    piece = np.flatnonzero(labels == largest)
    worst = piece[np.argmax(beyond[piece])]
    by_slope = to_z[worst] - LIMITS.slope_deg >= to_ray[worst] - LIMITS.ray_deg
    degrees, limit, what = (to_z, LIMITS.slope_deg, "z") if by_slope else (to_ray, LIMITS.ray_deg, "the scanner's rays")
    reason = (
        f"the mold is too steep below the ply: over {in_cm2(area_mm2[largest])} round {in_mm(xy[worst])} its "
        f"normal leans by up to {degrees[worst]:.0f} degrees from {what}, limit {limit:g}: heights are not sure there; "
        "mask a frame or clamp that stands beside the ply there, turn the mold's frame or the scanner so that it looks "
        "more squarely at it, or inspect that side by itself"
    )
    return Finding("steep_mold", Verdict.INVALID, reason, float(degrees[worst]), limit, "°", xy_of(xy[worst]))


def _degrees(cosine: Floats) -> Floats:
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
