"""Marks for pixels where nothing was seen: many scanners write (0, 0, 0), or a number far off, where NaN belongs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.inspection.clouds.thinning import complete

_MOST = 0.001  # of the points may share another place than the origin, as where a list holds each point several times
_FEW = 3  # points of a sample may share a place, by rounding or by chance at the origin


def refuse_marks(points: NDArray[np.float32], name: str) -> None:
    """Refuse a sample of a cloud, (N, 3), all finite, in which many points share one place.

    No two points of a real scan share a place. The origin and the outermost points are checked: points far off would
    change the bounds of the cloud, and points at the scanner would stand up from the mold.

    Raises
    ------
    InputError
        Many points share one place; the message names it, and shows how to write NaN there.
    """
    if not len(points):
        return
    columns = points.T.copy()  # NumPy searches a contiguous array several times faster
    outermost = np.concatenate([columns.argmin(axis=1), columns.argmax(axis=1)])
    for place in (np.zeros(3, dtype=points.dtype), *points[outermost]):
        alike = points[columns[0] == place[0]]  # few in any real scan; only they are compared in y and z
        at = np.count_nonzero(complete(alike == place))
        if at > (max(_FEW, _MOST * len(points)) if place.any() else _FEW):
            where = ", ".join(f"{value:g}" for value in place)
            raise InputError(
                f"{name}: expected points of a scan, but {at / len(points):.2%} of them lie at ({where}), as a mark "
                f"for what was not seen; write NaN there: points[np.isclose(points, ({where})).all(axis=-1)] = np.nan"
            )
