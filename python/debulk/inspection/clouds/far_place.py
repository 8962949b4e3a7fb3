"""Clouds far from the origin of the scanner's frame: one shift for all, and a pose that adds it back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from debulk import _core, foreign, origin
from debulk.arrays import Floats
from debulk.inspection.clouds.cleaning import is_plain, slices

_COARSE_MM = 0.01  # a tenth of the level's tolerance


@dataclass(frozen=True, eq=False)
class FarPlace:
    """The shift that an inspector's clouds have in common."""

    shift_mm: Floats | None = None
    """(3,) what is subtracted from all clouds before they are rounded to float32; None: nothing, because the reference
    is not far from the origin (`debulk.origin.FAR_MM`). It is only subtracted where a pose can add it back."""
    rounded_mm: float = 0.0
    """To how many mm the reference's coordinates had been rounded when it came; 0: to less than what matters."""

    @classmethod
    def of(cls, reference: Any, mold_from_scanner: Floats | None, camera: Floats | None) -> FarPlace:
        """Choose the shift by the reference. A camera is at the origin, so that its image cannot be far from there."""
        points = foreign.plain(reference, "reference")
        if mold_from_scanner is None or camera is not None or not is_plain(points) or points.dtype.kind != "f":
            return cls()
        shift = origin.shift_of(points)
        return cls(shift, _rounded_mm(points, shift))

    def of_another(self, reference: Any) -> FarPlace:
        """Return the same shift for another reference."""
        return replace(self, rounded_mm=_rounded_mm(foreign.plain(reference, "reference"), self.shift_mm))

    def near(self, points: Any, name: str, stop: _core.Stop | None = None) -> Any:
        """Return a cloud, in any form that is known, as an array without the shift; what is no cloud is passed on."""
        points = foreign.plain(points, name)
        if self.shift_mm is None or not is_plain(points) or points.dtype.kind != "f":
            return points
        out = np.empty(points.shape, dtype=np.float32)
        for rows in slices(points, stop):
            out[rows] = origin.shifted(points[rows], self.shift_mm)
        return out

    def pose(self, mold_from_scanner: Floats | None) -> Floats | None:
        """Return the motion into the mold's frame for clouds without the shift."""
        if self.shift_mm is None or mold_from_scanner is None:
            return mold_from_scanner
        moved = mold_from_scanner.copy()
        moved[:3, 3] += mold_from_scanner[:3, :3] @ self.shift_mm
        return moved

    def warnings(self, scan: Any) -> tuple[str, ...]:
        """Sentences for the reader of the report of this scan, which is as it came."""
        if self.shift_mm is None:
            return ()
        shift = ", ".join(f"{value:.0f}" for value in self.shift_mm)
        said = (
            f"the clouds lie far from the origin of the scanner's frame: ({shift}) mm were subtracted from all of them "
            "before they were rounded to float32, and added again by the pose",
        )
        steps_mm = {"reference": self.rounded_mm, "scan": _rounded_mm(foreign.plain(scan, "scan"), self.shift_mm)}
        return said + tuple(
            f"the {name} came as float32, which so far from the origin has steps of {step_mm:.2g} mm; give clouds "
            "nearer to the origin, or as float64"
            for name, step_mm in steps_mm.items()
            if step_mm
        )


def _rounded_mm(points: Any, shift_mm: Floats | None) -> float:
    """Return to how many mm the coordinates of a far cloud have been rounded; 0: to less than what matters."""
    if shift_mm is None or not is_plain(points) or points.dtype.itemsize > 4:
        return 0.0
    step_mm = origin.resolution_mm(float(np.abs(shift_mm).max()))
    return step_mm if step_mm > _COARSE_MM else 0.0


NEAR = FarPlace()
"""No shift: the clouds are near the origin."""
