"""The points of a scan before any filter, read only in the part of the scan that is asked for."""

from __future__ import annotations

import math
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from debulk import cloud
from debulk.arrays import Bools, Cloud, Floats
from debulk.inspection.clouds.camera import PinholeImage
from debulk.inspection.clouds.products import product
from debulk.inspection.clouds.thinning import complete
from debulk.surface import Reference

_APART_MM = 1.0  # a denser scan is read in steps, with points at most this far apart
HIGHEST_MM = 25.0  # air lifts no ply so high above the reference: a clamp or a tool
_MARGIN = 4  # pixels round the part of the image that is read
_OFF = 1.0  # pixels by which the points may miss their pixels: by more, another camera took the scan


class RawPoints:
    """The unfiltered points of a scan in the scanner's frame, thinned if the scan is dense.

    The mask hides pixels; the pitch of the points is inf, and the image of the reference's camera None, where it is not
    known.
    """

    def __init__(
        self,
        scan: Cloud,
        mask: Bools | None,
        mold_from_scanner: Floats | None,
        pitch_mm: float,
        image: PinholeImage | None,
    ) -> None:
        organised = scan.ndim == 3
        step = max(1, int(_APART_MM / pitch_mm)) if organised and 0 < pitch_mm < math.inf else 1
        self.pitch_mm = step * pitch_mm
        """Distance from one of the thinned points to the next."""
        self._step, self._mask, self._pose = step, mask, mold_from_scanner
        self._scan = scan
        self._lock = Lock()
        self._read: Cloud | None = None  # all points, once they have been asked for
        self._image = image if organised and image is not None and image.shape == scan.shape[:2] else None

    def over(self, outline_mm: Floats, reference: Reference) -> Cloud:
        """Return the (N, 3) points over an outline, and others near it, mold frame; may be called from any thread."""
        points = self._in_window(outline_mm, reference)
        return self._all() if points is None else points

    def _all(self) -> Cloud:
        every = slice(None, None, self._step)
        with self._lock:
            if self._read is None:
                loose = self._scan.ndim == 2
                self._read = self._finite_in_mold(self._scan) if loose else self._in_part((every, every))
            return self._read

    def _in_window(self, outline_mm: Floats, reference: Reference) -> Cloud | None:
        """Return the points of the part of the image that shows an outline; None if that part is not known."""
        if self._image is None:
            return None
        below_mm = reference.height(outline_mm)
        box = np.concatenate([np.column_stack([outline_mm, below_mm + up]) for up in (0.0, HIGHEST_MM)])
        if self._pose is not None:
            box = product(box - self._pose[:3, 3], self._pose[:3, :3])
        if (box[:, 2] <= 0).any():
            return None
        step = self._step  # rows and columns are multiples of it, so that `_all` holds the same points
        rows, columns = (
            slice(max(0, int(seen.min()) - _MARGIN) // step * step, max(0, int(seen.max()) + _MARGIN + 1), step)
            for seen in _pixels(box, self._image)
        )
        part = rows, columns
        points = self._scan[part]
        at = np.mgrid[part][:, : points.shape[0], : points.shape[1]]
        with np.errstate(all="ignore"):
            off = np.abs(np.array(_pixels(points, self._image)) - at).max(axis=0)
        known = off[np.isfinite(off)]
        if not known.size or np.median(known) > _OFF:
            return None  # another camera took the scan
        return self._in_part(part)

    def _in_part(self, part: tuple[slice, slice]) -> Cloud:
        points = self._scan[part]
        return self._finite_in_mold(points.reshape(-1, 3) if self._mask is None else points[~self._mask[part]])

    def _finite_in_mold(self, points: Cloud) -> Cloud:
        kept = np.ascontiguousarray(points[complete(np.isfinite(points))], dtype=np.float32)
        return kept if self._pose is None else cloud.transform(kept, self._pose)


def _pixels(points: NDArray[np.floating], image: PinholeImage) -> tuple[Floats, Floats]:
    """Return the rows and the columns of the image in which (..., 3) points are seen."""
    x, y, z = np.moveaxis(points, -1, 0)
    return image.f * y / z + image.cy, image.f * x / z + image.cx
