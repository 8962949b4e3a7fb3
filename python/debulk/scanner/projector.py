"""The model of the projector, which says where in the projector's field a point lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from debulk.arrays import Floats
from debulk.scanner.inputs import InputError

_POWERS = [(i, j) for i in range(4) for j in range(4 - i) if i + j >= 2]


@dataclass(frozen=True, eq=False)
class Projector:
    """Where a point lies across the fringes in the projector's field, 0 to 1: a pinhole with a lens.

    Points are in the left camera's own frame, mm. If (X, 1) is the point in homogeneous coordinates, the pinhole gives
    p = (first row · (X, 1)) / (second row · (X, 1)). The lens adds terms of the second and third degree in p - 1/2 and
    y / z.
    """

    pinhole: Floats
    """(2, 4)."""
    lens: Floats = field(repr=False)
    """(7,)"""
    error_mm: float
    """Root mean square difference of its depths from those of the two cameras, in the scans that determined it."""

    def at(self, points_mm: ArrayLike) -> Floats:
        """Return the position in the field of (N, 3) points."""
        points = np.asarray(points_mm, dtype=np.float64)
        p = through_pinhole(self.pinhole, points)
        return np.asarray(p + lens_terms(p, points)[0] @ self.lens)

    def data(self) -> dict[str, Any]:
        """Return the projector in the form of the calibration's file."""
        return {"pinhole": self.pinhole.tolist(), "lens": self.lens.tolist(), "error_mm": self.error_mm}

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Projector:
        """Read what `data` returned; raises an InputError."""
        try:
            pinhole, lens = (np.asarray(data[name], dtype=np.float64) for name in ("pinhole", "lens"))
            error_mm = float(data["error_mm"])
        except (KeyError, TypeError, ValueError):
            raise InputError("projector: expected pinhole, lens and error_mm") from None
        if pinhole.shape != (2, 4) or lens.shape != (7,) or not np.isfinite([*pinhole.ravel(), *lens, error_mm]).all():
            raise InputError("projector: expected a (2, 4) pinhole and 7 numbers of its lens, all finite")
        return cls(pinhole, lens, error_mm)


def through_pinhole(rows: Floats, points: Floats) -> Floats:
    """Positions of (N, 3) points without the lens."""
    above, below = (points @ row[:3] + row[3] for row in rows)
    return np.asarray(above / below)


def lens_terms(p: Floats, points: Floats) -> tuple[Floats, Floats]:
    """(N, 7) factors of the lens's coefficients, and their derivatives with respect to p."""
    a, b = p - 0.5, points[:, 1] / points[:, 2]
    terms = np.column_stack([a**i * b**j for i, j in _POWERS])
    return terms, np.column_stack([i * a ** max(i - 1, 0) * b**j for i, j in _POWERS])
