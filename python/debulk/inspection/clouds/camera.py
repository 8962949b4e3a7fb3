"""The pinhole camera of an organised cloud: pixel (row i, column j) looks along ((j - cx) / f, (i - cy) / f, 1)."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from debulk import _core
from debulk.cloud import as_cloud


class PinholeImage(NamedTuple):
    """The image of a pinhole camera that stands at the origin of the scanner's frame and looks along +z; in pixels."""

    height: int
    width: int
    f: float
    cx: float
    cy: float

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width)."""
        return self.height, self.width

    @property
    def camera(self) -> tuple[float, float, float]:
        """(f, cx, cy)."""
        return self.f, self.cx, self.cy


def fit_camera(points: ArrayLike) -> tuple[float, float, float] | None:
    """Fit f, cx, cy, pixels, to an organised cloud (H, W, 3) whose origin is the camera's centre, and whose z its axis.

    None if no pinhole camera fits: the cloud is not organised, or its points lie more than 0.1 px off their pixels.

    >>> import numpy as np
    >>> column, row = np.meshgrid(np.arange(40.0), np.arange(30.0))
    >>> points = 500.0 * np.dstack([(column - 19.5) / 80, (row - 14.5) / 80, np.ones_like(row)])
    >>> [round(value, 3) for value in fit_camera(points)]
    [80.0, 19.5, 14.5]
    """
    camera: tuple[float, float, float] | None = _core.cloud.fit_pinhole(as_cloud(points, "points"))
    return None if camera is None else (camera[0], camera[1], camera[2])
