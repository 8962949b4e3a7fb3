"""Checks that a reference can be in the mold's frame and in mm, so that a forgotten pose or unit factor is noticed."""

from __future__ import annotations

import numpy as np

from debulk import pocket
from debulk._core import InputError
from debulk.arrays import LARGEST_MM, Floats
from debulk.inspection.clouds.enough import PLACES
from debulk.surface import Reference

_LEAST_PITCH_MM = 0.03
_MOST_TILT_DEG = 40.0
_LEAST_PLY_SHARE = 0.002  # of the reference: an outline in inches covers 1/645 of the area that it covers in mm


def pose_needed() -> InputError:
    """Return the error for an image of a camera at the origin that comes without a pose, so in the scanner's frame."""
    return InputError(
        "mold_from_scanner: expected a pose, but got None, and the reference is the image of a camera at the origin: "
        "it is in the scanner's frame; give the (4, 4) motion into the mold's, with z up from the mold, or np.eye(4) "
        "where the mold's frame is the scanner's (on the command line: --pose FILE or --pose identity)"
    )


def check_cloud_frame(points_mm: Floats, pitch_mm: float) -> None:
    """Refuse a reference of impossible size, place or density, from (N, 3) of its points, mold frame, all finite."""
    low, high = points_mm.min(axis=0), points_mm.max(axis=0)
    size = high - low
    spans = f"{size[0]:.4g} x {size[1]:.4g} mm"
    far = float(np.abs(points_mm).max())
    if far > LARGEST_MM:
        raise InputError(
            f"reference: expected coordinates within {LARGEST_MM / 1000:g} m of the mold frame's origin, but got "
            f"{far:.4g} mm: check the unit of the pose's translation and of the points (micrometres?), or choose an "
            "origin at the mold"
        )
    if pitch_mm < _LEAST_PITCH_MM:
        raise InputError(
            f"reference: expected points at least {_LEAST_PITCH_MM:g} mm apart, but got {pitch_mm:.2g} mm over "
            f"{spans}: is it in inches or metres? Give all clouds in mm (on the command line: --unit m for metres)"
        )


def check_tilt(reference: Reference, low_mm: Floats, high_mm: Floats, ply_outline: Floats | None = None) -> None:
    """Refuse a reference that leans far from z as a whole and, if the outline is known, also below the ply.

    A wrong pose tilts the whole reference, including the part below the ply; a steep flank beside the ply does not.
    """
    tilt = _tilt_deg(reference, spread(low_mm, high_mm, PLACES))
    if tilt > _MOST_TILT_DEG and ply_outline is not None:
        low, high = np.maximum(ply_outline.min(axis=0), low_mm), np.minimum(ply_outline.max(axis=0), high_mm)
        xy = spread(low, high, PLACES)
        on_ply = xy[pocket.inside(ply_outline, xy)] if (low < high).all() else xy[:0]
        tilt = _tilt_deg(reference, on_ply) if len(on_ply) else tilt
    if tilt > _MOST_TILT_DEG:
        raise InputError(
            f"reference: expected a mold seen from above, z up, but its surface leans by {tilt:.0f} degrees from z: "
            "check mold_from_scanner (is it the motion from the scanner's frame to the mold's, or its inverse?)"
        )


def spread(low_mm: Floats, high_mm: Floats, count: int) -> Floats:
    """Return so many by so many places, (N, 2), evenly spread over a box."""
    x, y = (np.linspace(a, b, count) for a, b in zip(low_mm, high_mm, strict=True))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _tilt_deg(reference: Reference, xy_mm: Floats) -> float:
    lean = np.median(reference.gradient(xy_mm), axis=0)
    return float(np.degrees(np.arctan(np.hypot(*lean))))


def boxes(outline: Floats, low_mm: Floats, high_mm: Floats) -> str:
    """Say from where to where the outline reaches, and the reference."""

    def box(a: Floats, b: Floats) -> str:
        return f"x {a[0]:.4g} to {b[0]:.4g}, y {a[1]:.4g} to {b[1]:.4g} mm"

    return f"the outline has {box(outline.min(axis=0), outline.max(axis=0))}, the reference {box(low_mm, high_mm)}"


def check_outline_on(outline: Floats, low_mm: Floats, high_mm: Floats) -> None:
    """Refuse an outline that cannot be that of the ply: it lies beside the reference, or has another unit."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    where = boxes(outline, low_mm, high_mm)
    if (low >= high_mm).any() or (high <= low_mm).any():
        raise InputError(
            f"ply_outline: expected the ply to lie on the reference, but it lies beside it: {where}; "
            "check the outline's unit and frame (mold XY), and the pose"
        )
    share = abs(pocket.polygon_area(outline)) / float(np.prod(high_mm - low_mm))
    if share < _LEAST_PLY_SHARE:
        raise InputError(
            f"ply_outline: expected the outline of the ply in mm, but it covers {100 * share:.2g} % of the reference: "
            f"{where}; is it in metres or inches?"
        )
