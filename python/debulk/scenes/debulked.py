"""The virtual layup after debulking, made only from the truth, without any prediction.

The vacuum presses the whole ply to its consolidated thickness. A pocket's excess length over its short axis, minus what
the ply takes up in its plane, remains as one narrow ridge along the long axis. This is a stand-in for testing the
comparison, not a model of debulking: how well a prediction agrees with it says nothing about a real ply.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk.arrays import Floats, Singles
from debulk.scenes.bump import Bell, Bump, straight_excess
from debulk.scenes.camera import Camera
from debulk.scenes.outline import StarPolygon
from debulk.scenes.raycast import Target, cast
from debulk.scenes.spoil import spoil

RIDGE_HALF_WIDTH_MM = 4.0  # an elastic fold of this ply is about four natural lengths of 2 mm wide at its foot
TAKEN_UP_MM = 0.2  # excess that shear and invisibly low waves take up
RELEASED_MM = 0.5  # excess that slides out at the ply's edge
_STEPS = 12  # steps of the ray caster, because a ridge is steep and narrow


@dataclass(frozen=True, eq=False)
class Scanner:
    """How the scans of a layup were taken, so that another one can be taken."""

    camera: Camera
    ply: StarPolygon
    seed: int
    noise_mm: float
    flying_share: float
    dropout_share: float
    threads: int


@dataclass(frozen=True, eq=False)
class Debulked:
    """A scan of the ply after debulking, and the truth about it."""

    scan: Singles = field(repr=False)
    """(H, W, 3) organised cloud, scanner frame, mm; NaN where nothing was seen."""
    thickness_mm: float
    """Thickness of the consolidated ply, along z."""
    ridges: tuple[Bell | None, ...]
    """Ridge that remains of each pocket, in the truth's order; None if it closed. Heights above the rest of the ply."""
    decoy_ridges: tuple[Bell | None, ...]
    """The same for the decoys."""
    dropout: NDArray[np.bool_] = field(repr=False)
    """(H, W): pixels that saw nothing."""
    flying: NDArray[np.bool_] = field(repr=False)
    """(H, W): pixels whose point flies off along its ray."""
    _ply: StarPolygon = field(repr=False)

    def ply_height_above_mold(self, xy: ArrayLike) -> Floats:
        """Height of the ply's upper side above the mold, along z; 0 beside the ply; (..., 2) mold XY to (...), mm."""
        points = np.asarray(xy, dtype=np.float64)
        x, y = points[..., 0], points[..., 1]
        height = np.full(x.shape, self.thickness_mm)
        for ridge in (*self.ridges, *self.decoy_ridges):
            if ridge is not None:
                height += ridge.rise(x, y)
        return np.where(self._ply.inside(x, y), height, 0.0)


def debulk(
    pockets: tuple[Bump, ...], decoys: tuple[Bump, ...], scanner: Scanner, thickness_mm: float, bulk_factor: float
) -> Debulked:
    """Press the ply down and scan it again."""
    thickness = thickness_mm / bulk_factor
    ridges, decoy_ridges = tuple(map(ridge_of, pockets)), tuple(map(ridge_of, decoys))
    standing = tuple(ridge for ridge in (*ridges, *decoy_ridges) if ridge is not None)
    faults = spoil(
        (scanner.seed, 3), scanner.camera, scanner.noise_mm, scanner.flying_share, scanner.dropout_share
    )  # 1 and 2 are for the scan and the reference
    scan, _ = cast(scanner.camera, Target(scanner.ply, thickness, standing, _STEPS), faults, None, scanner.threads)
    return Debulked(scan, thickness, ridges, decoy_ridges, faults.dropout, faults.flying, scanner.ply)


def ridge_of(bump: Bump) -> Bell | None:
    """Return what remains of a bump: None, or a bell as long as the bump with RIDGE_HALF_WIDTH_MM on each side."""
    excess = bump.straight_excess_mm - TAKEN_UP_MM - (RELEASED_MM if bump.touches_ply_edge else 0.0)
    if excess <= 0:
        return None
    return Bell(bump.centre_mm, (bump.radii_mm[0], RIDGE_HALF_WIDTH_MM), bump.angle_deg, ridge_height(excess))


def ridge_height(excess_mm: float) -> float:
    """Height at which the middle section of a ridge has this excess length: the inverse of `straight_excess`."""
    low, high = 0.0, RIDGE_HALF_WIDTH_MM + excess_mm  # the arc is longer than twice the height
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if straight_excess(middle, RIDGE_HALF_WIDTH_MM) < excess_mm else (low, middle)
    return 0.5 * (low + high)
