"""From two absolute phases to the organised cloud."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from debulk import _core
from debulk.arguments import typed
from debulk.arrays import Singles
from debulk.scanner.calibration import Calibration, Rectified
from debulk.scanner.decode import Phase
from debulk.scanner.epipolar import Epipolar, judge_rows
from debulk.scanner.inputs import InputError
from debulk.scanner.third_view import disagreement

LEAST_MATCHED = 0.3
"""If a smaller share of the seen pixels finds a partner, the cameras do not look at the same scene."""


@dataclass(frozen=True, eq=False)
class Scan:
    """An organised cloud from two cameras."""

    points_mm: Singles = field(repr=False)
    """(H, W, 3) in the frame of the rectified left camera: pixel (i, j) lies along ((j - cx) / f, (i - cy) / f, 1); NaN
    where nothing was seen by both cameras. H and W are the camera's; where it is turned so far that the rectified image
    would be much coarser then, they are larger (``calibration.rectified.pixels``)."""
    uncertainty_mm: Singles = field(repr=False)
    """(H, W) standard deviation along the ray due to the phases' noise; 0 where that is not known."""
    camera: tuple[float, float, float]
    """f, cx, cy in pixels."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Numbers of pixels ``seen`` by the left camera and, of those, ``matched``, ``unmatched`` (hidden from the right
    camera), ``ambiguous`` (the left-right check failed) and ``behind`` the cameras."""
    epipolar: Epipolar | None = None
    """How well the rows of the two images agree; None where no images were given."""
    projector_mm: float = float("nan")
    """Depth by which cameras and projector disagree; NaN if the calibration contains no projector."""


def match(left: Phase | ArrayLike, right: Phase | ArrayLike, *, threads: int = 0) -> tuple[Singles, Singles]:
    """Match two phase maps that are already rectified, row by row.

    Parameters
    ----------
    left, right
        A `Phase`, or (H, W) absolute phases in rad, NaN where nothing is known. Both have the same number of rows.
    threads
        Number of threads; 0 means as many as the process may use.

    Returns
    -------
    tuple[NDArray[np.float32], NDArray[np.float32]]
        (H, W) disparity in pixels, the column in the left image minus that in the right one, NaN where there is none;
        and its standard deviation (0 without the phases' noise).

    Examples
    --------
    >>> left = np.tile(np.arange(40.0), (8, 1)) / 10
    >>> disparity, _ = match(left, left + 0.25)
    >>> round(float(np.nanmedian(disparity)), 3)
    2.5
    """
    views = _view(left, "left", None), _view(right, "right", None)
    shape = views[0][0].shape
    if views[1][0].shape[0] != shape[0]:
        raise InputError(f"right: expected {shape[0]} rows like the left, but got shape {views[1][0].shape}")
    disparity, sigma = np.empty(shape, np.float32), np.empty(shape, np.float32)
    maps = {"disparity": disparity, "sigma": sigma}
    _core.scanner.match(*views, [], maps, threads=threads, widest=4, stop=_core.Stop())
    return disparity, sigma


@typed
def triangulate(
    left: Phase | ArrayLike,
    right: Phase | ArrayLike,
    calibration: Calibration,
    *,
    threads: int = 0,
) -> Scan:
    """Triangulate two absolute phase maps.

    Each pixel of the rectified left image is matched along its row of the right image, between pixels, never across an
    edge or a gap. The match back from the right image must lead to the same pixel (left-right check). All other pixels
    are NaN.

    Parameters
    ----------
    left, right
        A `Phase` from each camera, or (H, W) absolute phases in rad from another decoder, in the original images.
    calibration
        Calibration of the two cameras. Its rectification is prepared in the first call.
    threads
        Number of threads; 0 means as many as the process may use. The result does not depend on it.

    Returns
    -------
    Scan
        Points, uncertainty and camera.

    Raises
    ------
    debulk.InputError
        If phases have another shape than the calibration's, or the cameras are swapped, were moved since they were
        calibrated, or do not look at the same scene. Movement is detected from the modulation, and from the projector
        if the calibration contains it, so only with two `Phase` objects.

    Examples
    --------
    >>> matrix = [[500.0, 0, 39.5], [0, 500.0, 9.5], [0, 0, 1]]
    >>> calibration = Calibration([matrix, matrix], np.zeros((2, 5)), np.eye(3), (-20.0, 0, 0), (80, 20))
    >>> phase = np.tile(np.arange(80.0), (20, 1)) / 10
    >>> scan = triangulate(phase, phase + 1.0, calibration)
    >>> round(float(np.nanmedian(scan.points_mm[..., 2])), 1)
    1000.0
    """
    points, uncertainty = empty_cloud(calibration)
    return triangulate_into(points, uncertainty, left, right, calibration, threads, _core.Stop())


def empty_cloud(calibration: Calibration) -> tuple[Singles, Singles]:
    """Memory for the points, (H, W, 3), and their uncertainty, (H, W), of a scan with these cameras."""
    width, height = calibration.rectified.pixels
    return np.empty((height, width, 3), np.float32), np.empty((height, width), np.float32)


def triangulate_into(
    points: Singles,
    uncertainty: Singles,
    left: Phase | ArrayLike,
    right: Phase | ArrayLike,
    calibration: Calibration,
    threads: int,
    stop: _core.Stop,
    widest: int = 4,
) -> Scan:
    """Triangulate into memory that the caller keeps; ``widest`` as in `decode_into`."""
    rectified = calibration.rectified
    shape = calibration.pixels[1], calibration.pixels[0]
    views = _view(left, "left", rectified.maps[:2]), _view(right, "right", rectified.maps[2:])
    for name, (phase, *_) in zip(("left", "right"), views, strict=True):
        if phase.shape != shape:
            raise InputError(f"{name}: expected phases of shape {shape}, the calibration's, but got {phase.shape}")

    def run(first: Any, second: Any) -> dict[str, int]:
        maps = {"points": points, "uncertainty": uncertainty}
        geometry = _geometry(rectified)
        return dict(_core.scanner.match(first, second, geometry, maps, threads=threads, widest=widest, stop=stop))

    counts = run(*views)
    epipolar = None
    if isinstance(left, Phase) and isinstance(right, Phase):
        epipolar, complaint = judge_rows(points, left, right, rectified, threads, stop)
        if complaint:
            run(_view(right, "right", rectified.maps[:2]), _view(left, "left", rectified.maps[2:]))
            exchanged, still = judge_rows(points, right, left, rectified, threads, stop)
            if not still and np.isfinite(exchanged.error_px):
                complaint = "the two cameras' images are exchanged"
            raise InputError(f"left, right: {complaint}")
    if counts["seen"] and counts["behind"] > counts["matched"]:
        raise InputError("left, right: most points lie behind the cameras: the two cameras' images are exchanged")
    if counts["matched"] < LEAST_MATCHED * counts["seen"]:
        raise InputError(
            f"left, right: expected phases of one scene, but only "
            f"{100 * counts['matched'] / counts['seen']:.0f} % of the left "
            "pixels find a partner in their row: images are exchanged, of different scans, or the fringes run "
            "along the rows"
        )
    projector_mm = float("nan")
    if calibration.projector is not None and isinstance(left, Phase) and left.periods:
        projector_mm, complaint = disagreement(points, left, rectified, calibration.projector)
        if complaint:
            raise InputError(f"left, right: {complaint}")
    return Scan(points, uncertainty, rectified.camera, counts, epipolar, projector_mm)


def _geometry(rectified: Rectified) -> list[float]:
    cx, cy = rectified.left_centre
    furthest = 100 * rectified.focal_px * rectified.baseline_mm  # a hundredth of a pixel of disparity
    return [rectified.focal_px, cx, rectified.right_cx, cy, rectified.baseline_mm, 0.0, furthest]


def _view(phase: Phase | ArrayLike, name: str, maps: tuple[Singles, ...] | None) -> tuple[Any, ...]:
    noise = phase.noise_rad if isinstance(phase, Phase) else None
    values = np.ascontiguousarray(phase.phase_rad if isinstance(phase, Phase) else phase, dtype=np.float32)
    if values.ndim != 2 or values.size == 0:
        raise InputError(f"{name}: expected an (H, W) array of phases, but got shape {values.shape}")
    return values, noise, *(maps or (None, None))
