"""Check of the two cameras with the projector as a third view.

A camera that is turned about the vertical axis by 0.01 degrees moves all points by millimetres in depth, yet all rows
still agree. But the phase of a point says where it lies in the projector's field, and that is determined by the place
of the point if the projector has not moved. So the depth from the two cameras and the depth from the left camera and
the projector must agree.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from debulk.arrays import Floats, Singles
from debulk.scanner.calibration import Rectified
from debulk.scanner.decode import Phase
from debulk.scanner.epipolar import even
from debulk.scanner.inputs import InputError
from debulk.scanner.projector import Projector, lens_terms, through_pinhole

MOST_DISAGREEMENT = 2e-4
"""Limit relative to the depth, 0.5 mm of 2.4 m: if it is exceeded, a camera or the projector was moved."""
_SAMPLES = 40_000
_LEAST_SAMPLES = 500
_LEAST_RELIEF = 2e-3  # root mean square distance of points from one plane, relative to the depth
_LEAST_PARALLAX = 0.01  # share of the field that a point moves by for its whole depth
_ROUNDS = 6


def learn(seen: Sequence[tuple[Floats, Floats]]) -> Projector:
    """Fit a projector to (points, places in the field) of several scans; an InputError if they do not determine it."""
    points, places = (np.concatenate([pair[k] for pair in seen]) for k in (0, 1))
    if len(points) < _LEAST_SAMPLES:
        raise InputError(f"views: expected surfaces that fill the image, but only {len(points)} points were seen")
    relief = _relief(points)
    if relief < _LEAST_RELIEF:
        raise InputError(
            f"views: expected surfaces at several depths, or one of some relief, but all points lie on one plane "
            f"within {100 * relief:.2f} % of their depth: scan a plate at three distances"
        )
    pinhole, lens, keep = _first_pinhole(points, places), np.zeros(7), np.ones(len(points), bool)
    for _ in range(_ROUNDS):  # Gauss-Newton, without points on edges
        p = through_pinhole(pinhole, points)
        terms, slopes = lens_terms(p, points)
        below = points @ pinhole[1, :3] + pinhole[1, 3]
        by_p = ((1 + slopes @ lens) / below)[:, None] * np.column_stack([points, np.ones(len(points))])
        off = places - p - terms @ lens
        keep = np.abs(off) <= 4 * 1.4826 * np.median(np.abs(off)) + 1e-12
        slope = np.hstack([by_p, -p[:, None] * by_p, terms])
        size = np.linalg.norm(slope, axis=0)
        # Parameters that the points hardly determine, such as a lens that acts like a slant, keep their values.
        step = np.linalg.lstsq(slope[keep] / size, off[keep], rcond=1e-4)[0] / size
        pinhole, lens = pinhole + step[:8].reshape(2, 4), lens + step[8:]
    found = Projector(pinhole, lens, float("nan"))
    parallax, off_mm = _depth_errors(found, points, places)
    if np.median(np.abs(parallax)) < _LEAST_PARALLAX:
        raise InputError("views: expected a projector beside the left camera, but it sees as that camera does")
    return Projector(pinhole, lens, float(np.sqrt(np.mean(off_mm[keep] ** 2))))


def disagreement(points: Singles, left: Phase, rectified: Rectified, projector: Projector) -> tuple[float, str]:
    """Depth by which cameras and projector disagree, mm, and what is wrong if it is too much; NaN: too few points."""
    there, places = sampled(points, left, rectified)
    if len(there) < _LEAST_SAMPLES:
        return float("nan"), ""
    _, off_mm = _depth_errors(projector, there, places)
    middle = np.median(there, axis=0)
    shares = np.column_stack([(there[:, :2] - middle[:2]) / (np.ptp(there[:, :2], axis=0) + 1e-9), off_mm])
    error_mm = float(np.sqrt(np.mean(even(shares) ** 2)))
    if error_mm <= MOST_DISAGREEMENT * middle[2]:
        return error_mm, ""
    return error_mm, (
        f"depths from the two cameras and from the projector's fringes differ by {error_mm:.2f} mm: a camera or the "
        f"projector was moved since the calibration; calibrate again (if only the projector was moved: it alone)"
    )


def sampled(points: Singles, left: Phase, rectified: Rectified) -> tuple[Floats, Floats]:
    """Sample a scan: points in the left camera's own frame, and their places in the field according to the phase."""
    height, width = points.shape[:2]
    step = max(1, round(np.sqrt(height * width / _SAMPLES)))
    rows, columns = (a.ravel() for a in np.mgrid[step // 2 : height : step, step // 2 : width : step])
    there = points[rows, columns].astype(np.float64)
    x, y = (rectified.maps[k][rows, columns].astype(np.float64) for k in (0, 1))
    tall, wide = left.phase_rad.shape
    fine = np.isfinite(there[:, 2]) & (x >= 0) & (y >= 0) & (x <= wide - 2) & (y <= tall - 2)
    there, x, y = there[fine], x[fine], y[fine]
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - i, y - j
    p = left.phase_rad
    phase = (1 - v) * ((1 - u) * p[j, i] + u * p[j, i + 1]) + v * ((1 - u) * p[j + 1, i] + u * p[j + 1, i + 1])
    known = np.isfinite(phase)
    return there[known] @ rectified.rotation, phase[known] / (2 * np.pi * left.periods[0])


def _depth_errors(projector: Projector, points: Floats, places: Floats) -> tuple[Floats, Floats]:
    """How far a point's place moves over its whole depth along the left camera's ray, and each depth's error, mm."""
    here = projector.at(points)
    parallax = (projector.at(points * 1.001) - here) / 0.001
    with np.errstate(divide="ignore", invalid="ignore"):
        off = points[:, 2] * (here - places) / parallax
    return parallax, np.nan_to_num(off, nan=0.0, posinf=0.0, neginf=0.0)


def _relief(points: Floats) -> float:
    """Distance of points from one plane, relative to their depth; on a plane, 1 / z is linear in x / z and y / z."""
    x, y, z = points.T
    basis = np.column_stack([np.ones_like(z), x / z, y / z])
    near = 1 / z
    fit = basis @ np.linalg.lstsq(basis, near, rcond=None)[0]
    return float(np.sqrt(np.mean((near / fit - 1) ** 2)))


def _first_pinhole(points: Floats, places: Floats) -> Floats:
    """Fit a pinhole by the linear equations, with each point weighted by its effect in the field."""
    middle, scale = points.mean(axis=0), float(points.std())
    ones = np.column_stack([(points - middle) / scale, np.ones(len(points))])
    weight = np.ones(len(points))
    for _ in range(3):
        equations = np.hstack([ones, -places[:, None] * ones]) * weight[:, None]
        _, vectors = np.linalg.eigh(equations.T @ equations)
        rows = vectors[:, 0].reshape(2, 4)
        weight = 1 / np.abs(ones @ rows[1])
    change = np.eye(4)
    change[:3, :3] /= scale
    change[:3, 3] = -middle / scale
    rows = rows @ change
    return np.asarray(rows / np.linalg.norm(rows[1, :3]))
