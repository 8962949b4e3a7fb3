"""Where the mold lies in front of the scanner, from markers or by the mold's own shape."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from debulk import arrays
from debulk.arrays import Floats
from debulk.scanner.inputs import InputError
from debulk.scanner.triangulate import Scan

_LEAST_SPREAD = 0.02  # distance of markers from one line, relative to their extent
_VOXEL_MM = 4.0
_REACHES_MM = (60.0, 15.0, 4.0)
_LEAST_SHARE = 0.5  # share of the mold's points that the scan must reach


@dataclass(frozen=True, eq=False)
class Registration:
    """The mold's frame relative to the scanner's."""

    mold_from_scanner: Floats
    """(4, 4) x_mold = T x_scanner."""
    residuals_mm: Floats = field(repr=False)
    """Distance of each marker from its place or, if the mold's shape was used, of points from the surface."""
    rms_mm: float
    """Root mean square of these distances."""


def register(
    scan: Scan | ArrayLike | None = None,
    markers_mm: tuple[ArrayLike, ArrayLike] | None = None,
    mold: ArrayLike | None = None,
    *,
    start: ArrayLike | None = None,
    most_mm: float = 0.5,
) -> Registration:
    """Find the rigid motion from the scanner's frame to the mold's.

    Parameters
    ----------
    scan
        Scan of the mold; needed for ``mold``.
    markers_mm
        Two (N, 3) arrays: markers as the scanner measured them, and their places in the mold's frame, in the same
        order. There must be three or more that do not lie on one line.
    mold
        Used instead of markers: points of the mold's surface in the mold's frame, (M, 3) or (H, W, 3). The scan is
        aligned with them by ICP, point to plane (needs Open3D, the extra ``view``).
    start
        (4, 4) start of ICP, right within some centimetres and degrees. None: the scanner's frame is nearly the mold's.
    most_mm
        A larger root mean square is refused.

    Returns
    -------
    Registration
        The motion and its residuals.

    Raises
    ------
    debulk.InputError
        If there are too few markers or they lie on one line, residuals are too large (the marker at fault is named),
        the overlap is too small, or Open3D is missing.

    Examples
    --------
    >>> measured = np.array([[0.0, 0, 900], [400, 0, 900], [0, 300, 900], [400, 300, 905]])
    >>> found = register(markers_mm=(measured, measured + [10.0, 20.0, -900.0]))
    >>> found.mold_from_scanner[:3, 3].round(6).tolist(), found.rms_mm < 1e-9
    ([10.0, 20.0, -900.0], True)
    """
    if (markers_mm is None) == (mold is None):
        raise InputError("markers_mm, mold: expected one of both")
    if not 0 < most_mm < 1000:
        raise InputError(f"most_mm: expected a positive distance in mm, but got {most_mm!r}")
    if markers_mm is not None:
        if len(markers_mm) != 2:
            raise InputError(
                f"markers_mm: expected markers as measured and in the mold's frame, but got {len(markers_mm)} arrays"
            )
        return _by_markers(_points(markers_mm[0], "markers_mm[0]"), _points(markers_mm[1], "markers_mm[1]"), most_mm)
    if scan is None:
        raise InputError("scan: expected a scan of the mold, but got None")
    points = _points(scan.points_mm if isinstance(scan, Scan) else scan, "scan")
    first = np.eye(4) if start is None else np.asarray(start, dtype=np.float64)
    if first.shape != (4, 4):
        raise InputError(f"start: expected a (4, 4) matrix, but got {arrays.came(start, first)}")
    return _by_shape(points, _points(mold, "mold"), first, most_mm)


def rigid_motion(measured: Floats, wanted: Floats) -> Floats:
    """Find the (4, 4) rigid motion that best aligns points with others by least squares (Kabsch's method)."""
    a, b = measured - measured.mean(axis=0), wanted - wanted.mean(axis=0)
    u, _, v = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(v.T @ u.T))])
    motion = np.eye(4)
    motion[:3, :3] = v.T @ flip @ u.T
    motion[:3, 3] = wanted.mean(axis=0) - motion[:3, :3] @ measured.mean(axis=0)
    return motion


def _by_markers(measured: Floats, wanted: Floats, most_mm: float) -> Registration:
    if measured.shape != wanted.shape:
        raise InputError(
            f"markers_mm: expected as many markers in both frames, but got {len(measured)} and {len(wanted)}"
        )
    if len(measured) < 3:
        raise InputError(f"markers_mm: expected at least 3 markers, but got {len(measured)}")
    for points in (measured, wanted):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if spread[1] < _LEAST_SPREAD * spread[0]:
            raise InputError(
                "markers_mm: expected markers off one line, but they lie on one: the turn about it stays open"
            )
    motion = rigid_motion(measured, wanted)
    residuals = _distances(motion, measured, wanted)
    rms = float(np.sqrt(np.mean(residuals**2)))
    if rms > most_mm:
        culprit = ""
        if len(measured) > 3:
            without = [np.delete(np.arange(len(measured)), k) for k in range(len(measured))]
            left = [
                float(np.sqrt(np.mean(_distances(rigid_motion(measured[w], wanted[w]), measured[w], wanted[w]) ** 2)))
                for w in without
            ]
            best = int(np.argmin(left))
            culprit = f"; without marker {best + 1} it would be {left[best]:.2f} mm" if left[best] < 0.5 * rms else ""
        raise InputError(
            f"markers_mm: expected markers that fit within {most_mm:g} mm, but they miss by {rms:.2f} mm{culprit}"
        )
    return Registration(motion, residuals, rms)


def _distances(motion: Floats, measured: Floats, wanted: Floats) -> Floats:
    return np.asarray(np.linalg.norm(measured @ motion[:3, :3].T + motion[:3, 3] - wanted, axis=1))


def _by_shape(points: Floats, mold: Floats, start: Floats, most_mm: float) -> Registration:
    try:
        import open3d
    except ImportError as error:
        if error.name == "open3d":
            raise InputError("mold: registration by shape needs Open3D: pip install 'debulk[view]'") from None
        raise InputError(
            f"mold: registration by shape needs Open3D, and it cannot be loaded ({error}); on Debian it needs libegl1, "
            "libgl1 and libusb-1.0-0"
        ) from None

    def cloud(values: Floats) -> Any:
        whole = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(values))
        return whole.voxel_down_sample(_VOXEL_MM)

    source, target = cloud(points), cloud(mold)
    target.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(radius=5 * _VOXEL_MM, max_nn=30))
    criteria = open3d.pipelines.registration.ICPConvergenceCriteria(1e-9, 1e-9, 200)
    motion = start
    for reach in _REACHES_MM:
        # A scan continues beside the mold. Without this loss, the points there pull a flat mold away within three
        # steps.
        robust = open3d.pipelines.registration.TukeyLoss(k=1 + 0.2 * reach)
        plane = open3d.pipelines.registration.TransformationEstimationPointToPlane(robust)
        found = open3d.pipelines.registration.registration_icp(source, target, reach, motion, plane, criteria)
        motion = np.asarray(found.transformation)
    pairs = np.asarray(found.correspondence_set)
    share = len(np.unique(pairs[:, 1])) / max(1, len(target.points)) if len(pairs) else 0.0
    if share < _LEAST_SHARE:
        raise InputError(
            f"mold: expected a scan that covers the mold, but it reaches only {100 * share:.0f} % of it within "
            f"{_REACHES_MM[-1]:g} mm: give a better start"
        )
    there = np.asarray(source.points)[pairs[:, 0]] @ motion[:3, :3].T + motion[:3, 3]
    off = ((there - np.asarray(target.points)[pairs[:, 1]]) * np.asarray(target.normals)[pairs[:, 1]]).sum(axis=1)
    rms = float(np.sqrt(np.mean(off**2)))
    if rms > most_mm:
        raise InputError(
            f"mold: expected a scan that fits within {most_mm:g} mm, but it misses the surface by {rms:.2f} mm"
        )
    return Registration(motion, np.abs(off), rms)


def _points(values: Any, name: str) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim not in (2, 3) or array.shape[-1] != 3:
        raise InputError(f"{name}: expected points of shape (N, 3), but got {array.shape}")
    flat = array.reshape(-1, 3)
    finite = np.isfinite(flat).all(axis=1)
    if name.startswith("markers") and not finite.all():
        raise InputError(f"{name}: expected finite numbers, but marker {int(np.argmin(finite)) + 1} is not")
    if not finite.any():
        raise InputError(f"{name}: expected points, but none is finite")
    return flat[finite]
