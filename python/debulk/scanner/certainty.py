"""How certain a calibration is: the covariance of its parameters, and what it does to measured heights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from debulk.arrays import Floats
from debulk.scanner.inputs import InputError
from debulk.scanner.stereo_fit import CAMERAS, LENS, Cameras, Placed, projected
from debulk.scanner.undistort import undistorted

BUMP_MM = 10.0
"""Height of the bump whose uncertainty is stated."""
_FIELD = 9, 7  # places across and down the left image
_MARGIN = 0.05  # of the image, outside the places
_LEAST_EIGENVALUE = 1e-13  # of the greatest: what the corners say less about is not known at all
_UNKNOWN = 1e9  # stands for figures that overflow


@dataclass(frozen=True)
class Certainty:
    """Standard deviations of a calibration, from the scatter of the corners about the fit.

    The covariance of all parameters of both cameras, the boards' places included, is propagated to each figure.
    """

    focal_sd_px: tuple[float, float]
    """Of the focal lengths of the left and the right camera, pixels."""
    baseline_sd_mm: float
    """Of the distance between the cameras."""
    height_sd_mm: float
    """Of the height of a bump of 10 mm at ``distance_mm``: the root mean square over the left image."""
    worst_height_sd_mm: float
    worst_at_px: tuple[float, float]
    """`worst_height_sd_mm`, `worst_at_px`: the same where it is greatest, and that pixel of the left image, x and y."""
    flatness_sd_mm: float
    """Of the heights of a plane at ``distance_mm``, its best plane taken out: the root mean square over the image."""
    distance_mm: float
    """Distance from the left camera, along its axis."""
    corner_sd_px: float
    """Scatter of the corners about the fit, of one coordinate."""

    def data(self) -> dict[str, Any]:
        """Return the figures for a file."""
        return asdict(self)

    @classmethod
    def from_data(cls, data: Any) -> Certainty:
        """Read what `data` returned."""
        names = [field.name for field in fields(cls)]
        try:
            values = [np.array(data[name], np.float64) for name in names]
            if not all(np.isfinite(value).all() for value in values):
                raise ValueError
            return cls(*(tuple(value.tolist()) if value.ndim else float(value) for value in values))  # type: ignore[arg-type]
        except (KeyError, TypeError, ValueError):
            raise InputError(f"certainty: expected the finite figures {', '.join(names)}") from None


def information(boards: Sequence[Placed]) -> Floats:
    """Sum what the corners of boards say about the cameras: the inverse covariance for corners of variance 1."""
    return np.asarray(sum((board.slopes.T @ board.slopes for board in boards), np.zeros((CAMERAS, CAMERAS))))


def corner_variance(boards: Sequence[Placed]) -> float:
    """Variance of one coordinate of a corner, from the residuals and the number of parameters that were fitted."""
    count = sum(board.residual.size for board in boards)
    squares = sum(float(board.residual @ board.residual) for board in boards)
    return squares / max(1, count - CAMERAS - 6 * len(boards))


def certainty(
    cameras: Cameras, info: Floats, variance: float, distance_mm: float, pixels: tuple[int, int]
) -> Certainty:
    """Propagate the covariance of the parameters, by `information` and `corner_variance`, to a calibration's figures.

    They are those at `distance_mm`, where the surface lies that is measured.
    """
    root = _covariance_root(info) * np.sqrt(variance)

    def deviation(slope: Floats) -> Floats:
        values = np.sqrt(((slope @ root) ** 2).sum(axis=-1))
        return np.asarray(np.clip(np.nan_to_num(values, nan=_UNKNOWN), 0.0, _UNKNOWN))

    unit = np.eye(CAMERAS)
    way = np.zeros(CAMERAS)
    way[-3:] = cameras.translation / np.linalg.norm(cameras.translation)
    at, seen, _ = field_points(cameras, distance_mm, pixels)
    low, high = (measured_slopes(at - [0, 0, up], cameras) for up in (0.0, BUMP_MM))
    heights = deviation(low[:, 2] - high[:, 2])
    plane = np.linalg.qr(np.column_stack([np.ones(len(at)), at[:, :2]]))[0]
    bow = low[:, 2] - plane @ (plane.T @ low[:, 2])
    focal = [float(deviation(unit[k * LENS : k * LENS + 2]).max()) for k in (0, 1)]
    worst = int(np.argmax(heights))
    return Certainty(
        (focal[0], focal[1]),
        float(deviation(way)),
        float(np.sqrt(np.mean(heights**2))),
        float(heights[worst]),
        (float(seen[worst, 0]), float(seen[worst, 1])),
        float(np.sqrt(np.mean(deviation(bow) ** 2))),
        distance_mm,
        float(np.sqrt(variance)),
    )


def _covariance_root(info: Floats) -> Floats:
    """Return r with r @ r.T = inverse of the information; what is not known at all becomes a huge number."""
    if not np.isfinite(info).all() or np.diag(info).min() <= 0:
        return np.full((CAMERAS, 1), _UNKNOWN)
    scale = np.sqrt(np.maximum(np.diag(info), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(info / np.outer(scale, scale))
    values = np.maximum(values, _LEAST_EIGENVALUE * values[-1])
    return np.asarray(vectors / np.sqrt(values) / scale[:, None])


def field_points(
    cameras: Cameras, distance_mm: float, pixels: tuple[int, int], grid: tuple[int, int] = _FIELD
) -> tuple[Floats, Floats, Floats]:
    """Places that both cameras see at this distance, over a grid of the left image.

    Returns the (N, 3) places in the left camera's frame and their (N, 2) left and right pixels. If the fields of view
    do not meet there, all places that the left camera sees.
    """
    import cv2

    across, down = (
        np.linspace(_MARGIN, 1 - _MARGIN, count) * (size - 1) for count, size in zip(grid, pixels, strict=True)
    )
    seen = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)
    rays = undistorted(seen, cameras.matrices[0], cameras.distortions[0], most=100, accuracy=1e-9)
    at = np.column_stack([rays, np.ones(len(seen))]) * distance_mm
    turn = cv2.Rodrigues(cameras.rotation)[0]
    there, *_ = cv2.projectPoints(at, turn, cameras.translation, cameras.matrices[1], cameras.distortions[1])
    there = there.reshape(-1, 2)
    both = ((there >= 0) & (there <= np.array(pixels) - 1)).all(axis=1)
    keep = both if both.any() else ~both
    return np.asarray(at[keep], np.float64), np.asarray(seen[keep], np.float64), np.asarray(there[keep], np.float64)


def measured_slopes(points: Floats, cameras: Cameras) -> Floats:
    """Return the derivative of (N, 3) measured points by the cameras, (N, 3, CAMERAS), the pixels staying as they are.

    As in `triangulate`, both coordinates of the left pixel count, and of the right one that along its row.
    """

    def by_point(slopes: Floats) -> Floats:
        """Bring (2 cameras, N, x and y, ...) into the form (N, 4, ...)."""
        return slopes.reshape(2, len(points), 2, -1).swapaxes(0, 1).reshape(len(points), 4, -1)

    # Points in the left camera's frame are a board that is not turned; moving it moves each of them alike.
    _, of_cameras, of_place = projected(points, np.zeros(6), cameras)
    of_point, of_cameras = by_point(of_place[:, 3:]), by_point(of_cameras)
    along = of_point[:, 2:] @ points[:, :, None]  # the way of the right pixel as the depth grows
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    three = np.zeros((len(points), 3, 4))
    three[:, [0, 1], [0, 1]] = 1.0
    three[:, 2, 2:] = along[..., 0]
    try:
        return np.asarray(-np.linalg.solve(three @ of_point, three @ of_cameras))
    except np.linalg.LinAlgError:  # cameras in one place measure no depth
        return np.full((len(points), 3, CAMERAS), np.nan)
