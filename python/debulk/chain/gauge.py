"""A gauge beside the layup: a strip or ridge of known height and width, whose scans show what the chain makes of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from debulk import cloud
from debulk._core import InputError
from debulk.arrays import Floats
from debulk.chain.blur import Shape, excess_left, strip_of
from debulk.chain.study import Strip
from debulk.inspection.inspector import Inspector

_ASIDE = 3.0  # widths of the gauge to which points are used on both sides
_ENDS = 0.9  # of its length: the ends are not used


@dataclass(frozen=True)
class Gauge:
    """A strip, such as tape or a shim, or a printed ridge, on the reference or on the flat ply."""

    scans: Iterable[ArrayLike]
    """Its scans, in the frame of the layup's, at least three."""
    from_mm: tuple[float, float]
    to_mm: tuple[float, float]
    """`from_mm`, `to_mm`: mold XY of the ends of its middle line."""
    height_mm: float
    width_mm: float
    """`height_mm`, `width_mm`: as a micrometer measured them; the height includes what holds it, such as glue."""
    shape: Shape = "strip"
    """"strip": its section is a rectangle. "ridge": it is H cos²(πx/w), whose excess length is known, too."""

    def __post_init__(self) -> None:
        for name in ("height_mm", "width_mm"):
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(f"gauge.{name}: expected a positive number of mm, got {getattr(self, name)!r}")
        if self.shape not in get_args(Shape):
            raise InputError(f"gauge.shape: expected one of {get_args(Shape)}, got {self.shape!r}")
        if not np.hypot(*(np.array(self.to_mm) - self.from_mm)) > self.width_mm:
            raise InputError("gauge: expected ends that are farther apart than the gauge is wide")


def measured(gauge: Gauge, inspector: Inspector) -> Strip:
    """Measure the gauge in each of its scans; see `strip_of`."""
    found = []
    for scan in gauge.scans:
        across, height = _across(gauge, scan, inspector)
        found.append(strip_of(across, height, gauge.height_mm, gauge.width_mm, gauge.shape))
    if len(found) < 3:
        raise InputError(f"gauge.scans: expected at least 3, but got {len(found)}")
    gains, blurs = np.array(found).T
    left = [excess_left(gain, blur, gauge.width_mm) for gain, blur in found] if gauge.shape == "ridge" else []
    return Strip(
        height_mm=gauge.height_mm,
        width_mm=gauge.width_mm,
        scans=len(found),
        gain=float(gains.mean()),
        gain_sd=float(gains.std(ddof=1)),
        blur_mm=float(blurs.mean()),
        blur_sd=float(blurs.std(ddof=1)),
        shape=gauge.shape,
        excess=float(np.mean(left)) if left else None,
        excess_sd=float(np.std(left, ddof=1)) if left else None,
    )


def _across(gauge: Gauge, scan: ArrayLike, inspector: Inspector) -> tuple[Floats, Floats]:
    """Return the places across the gauge, and the heights above the reference, of the points near it."""
    near = inspector.prepared.place.near(scan, "gauge.scans", None)
    points = cloud.as_cloud(near, "gauge.scans").reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    pose = inspector.prepared.place.pose(inspector.mold_from_scanner)
    if pose is not None:
        points = cloud.transform(points, pose)
    ends = np.array([gauge.from_mm, gauge.to_mm], dtype=np.float64)
    along = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    off = points[:, :2].astype(np.float64) - ends.mean(axis=0)
    on = np.abs(off @ along) < 0.5 * _ENDS * np.hypot(*(ends[1] - ends[0]))
    across = off @ np.array([-along[1], along[0]])
    on &= np.abs(across) < _ASIDE * gauge.width_mm
    heights = points[on, 2] - inspector.reference.height(points[on, :2].astype(np.float64))
    return across[on], heights
