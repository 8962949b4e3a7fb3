"""A ply over a spar: round crest, straight flanks, hollow fillets, and a table; seen straight from above."""

from __future__ import annotations

import numpy as np

FILLET_MM, FLANK_MM, TABLE_MM, STEP_MM = 25.0, 20.0, 60.0, 0.05
HALF_LENGTH_MM, BARE_MM, PITCH_MM = 90.0, 20.0, 0.8  # of the ply along the spar; of mold seen beside the ply


def curve(radius_mm, slope_deg, lift_mm=0.0, thickness_mm=0.0):
    """(N, 2) x and z of a parallel of the lower side of a ply that stands off the crest by a lift; and its length."""
    slope = np.radians(slope_deg)
    arc, fillet = radius_mm * slope, FILLET_MM * slope
    s = np.arange(-round((arc + FLANK_MM + fillet + TABLE_MM + 40) / STEP_MM), 0) * STEP_MM
    s = np.concatenate([s, [0.0], -s[::-1]])
    along = np.abs(s)
    angle = -np.sign(s) * slope * (np.clip(along / arc, 0, 1) - np.clip((along - arc - FLANK_MM) / fillet, 0, 1))
    x, z = (
        np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1])) * STEP_MM]) for v in (np.cos(angle), np.sin(angle))
    )
    lower = np.stack([x - x[len(s) // 2], z - z[len(s) // 2]], axis=1)
    off = lift_mm * np.maximum(0.0, 1 - (s / (1.2 * arc)) ** 2) ** 2
    lower += off[:, None] * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    way = np.gradient(lower, axis=0)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    length = np.linalg.norm(np.diff(lower, axis=0), axis=1).sum()
    return lower + thickness_mm * np.stack([-way[:, 1], way[:, 0]], axis=1), length


def true_ridge_mm(radius_mm, slope_deg, lift_mm, thickness_mm):
    """The ridge that the excess of the middle section makes (docs/model.md, section 9), by quadrature."""
    excess = curve(radius_mm, slope_deg, lift_mm)[1] - curve(radius_mm, slope_deg)[1]
    return excess / 2 + (2 - np.pi / 2) * thickness_mm


def clouds(radius_mm, slope_deg, thickness_mm, lift_mm=0.0, noise_mm=0.02, seed=0):
    """Scan and reference, (H, W, 3), mold frame, and the ply's outline."""
    rng = np.random.default_rng(seed)
    slope = np.radians(slope_deg)
    half = (radius_mm + FILLET_MM) * np.sin(slope) + FLANK_MM * np.cos(slope) + TABLE_MM
    xs, ys = (np.arange(-h - BARE_MM, h + BARE_MM, PITCH_MM) for h in (half, HALF_LENGTH_MM))
    x, y = np.meshgrid(xs, ys)
    steps = 24
    fade = np.clip((75 - np.abs(ys)) / 45, 0, 1)  # the lift fades out between 30 and 75 mm from the middle
    row = fade * fade * (3 - 2 * fade) * steps
    table = np.array(
        [np.interp(xs, *curve(radius_mm, slope_deg, lift_mm * k / steps, thickness_mm)[0].T) for k in range(steps + 1)]
    )
    low = np.minimum(row.astype(int), steps - 1)
    top = table[low] + (row - low)[:, None] * (table[low + 1] - table[low])
    mold = np.broadcast_to(np.interp(xs, *curve(radius_mm, slope_deg)[0].T), x.shape)
    on = (np.abs(x) < half) & (np.abs(y) < HALF_LENGTH_MM)
    scan, reference = (
        np.dstack([x, y, z + rng.normal(0, noise_mm, x.shape)]).astype(np.float32)
        for z in (np.where(on, top, mold), mold)
    )
    return scan, reference, np.array([half, HALF_LENGTH_MM]) * [(-1, -1), (1, -1), (1, 1), (-1, 1)]
