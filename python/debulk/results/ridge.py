"""The geometry of a predicted ridge, in the figures that acceptance rules for wrinkles use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.results.record import PointsXYZ, Record


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class RidgeGeometry(Record):
    """One ridge of a pocket: where it runs, and what a section of it along a fibre looks like (docs/verdicts.md)."""

    polyline_mm: PointsXYZ
    """(K, 3) points of the mold under the crest, mold frame, from one end to the other, at least two. By the excess,
    the line ends where the fold is half as high as at its highest point."""
    direction_deg: float
    """Direction of the crest, 0 to 180, counter-clockwise from mold +x, seen along z."""
    mirrored_mm: PointsXYZ | None = None
    mirrored_deg: float | None = None
    """`mirrored_mm`, `mirrored_deg`: line and direction along the other diagonal of the fibres, if the ply is as likely
    to fold that way; None otherwise."""
    fibre_angle_deg: float
    """Angle between the crest and the nearer fibre, 0 to 90."""
    length_mm: float
    """Length along the polyline."""
    excess_mm: float
    """Excess length that the ridge takes from the fibre with the largest excess."""
    height_mm: float
    """Height above the mold by the ridge formula."""
    elastic_mm: float
    half_width_mm: float
    slope_deg: float
    """`elastic_mm`, `half_width_mm`, `slope_deg`: dimensions of the elastic fold with the same excess
    (`debulk.section.elastic_fold`): height of the crown, distance from the crown to where the ply leaves the mold,
    largest angle between ply and mold."""
    height_over_thickness: float
    """`height_mm` over the nominal thickness of the ply."""
    height_over_half_width: float
    """`elastic_mm` over `half_width_mm`. The formula's section has upright sides and is always two thicknesses wide, so
    its ratio is `height_over_thickness` and its slope is 90 degrees."""
    place_spread_mm: float
    """Half the width of the band about the polyline, or the mirrored one, in which nine in ten of the minima from other
    starts have their highest ridge."""

    def __repr__(self) -> str:
        size = f"{self.height_mm:.2f} mm high, {self.length_mm:.0f} mm long"
        return f"RidgeGeometry({size}, at {self.direction_deg:.0f} deg)"

    @property
    def middle_mm(self) -> tuple[float, float, float]:
        """The point half-way along the polyline."""
        way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.polyline_mm, axis=0), axis=1)))
        x, y, z = (float(np.interp(way[-1] / 2, way, column)) for column in self.polyline_mm.T)
        return x, y, z

    @property
    def lines_mm(self) -> tuple[NDArray[np.float64], ...]:
        """The polyline, and the mirrored one if there is one; the ridge runs along either."""
        return (self.polyline_mm,) if self.mirrored_mm is None else (self.polyline_mm, self.mirrored_mm)
