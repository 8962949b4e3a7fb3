"""The calibration of two cameras, and their rectified images, in which rows correspond."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from debulk import arrays
from debulk.arguments import typed
from debulk.arrays import Floats, Singles
from debulk.files.replacing import write_text
from debulk.files.table import read_small_text
from debulk.scanner.board_places import BoardPlace
from debulk.scanner.certainty import BUMP_MM, Certainty
from debulk.scanner.inputs import InputError, checked_pixels
from debulk.scanner.projector import Projector
from debulk.scanner.resolution import resolved
from debulk.scanner.undistort import undistorted

_VERSION = 1
_DISTORTIONS = (4, 5, 8, 12, 14)  # numbers of coefficients that OpenCV supports


class Calibration:
    """Two cameras side by side, the left one first, in OpenCV's conventions.

    All arguments are kept as attributes of the same names; arrays as float64.

    Parameters
    ----------
    camera_matrices
        Two (3, 3) matrices, pixels; the middle of the first pixel is (0, 0).
    distortions
        Two rows of 4, 5, 8, 12 or 14 coefficients, as many for both cameras.
    rotation, translation_mm
        x_right = rotation @ x_left + translation_mm, for a point in the cameras' frames (x to the right, y down, z
        away from the camera).
    pixels
        Width and height of the images, of both cameras.
    image_errors_px
        Root mean square reprojection error of each calibration image, by its name.
    spoiling
        Pairs of images that were left out, by name, with the reason.
    error_px
        Root mean square reprojection error of all images that were used; NaN if it is not known.
    certainty
        Standard deviations of focal lengths, baseline and heights; None if they are not known, as in a file of debulk
        before they were computed.
    boards
        Where the boards were.
    remarks
        What else `calibrate` has to say, in sentences.
    projector
        Projector as `calibrate_projector` determined it; if given, scans are checked against it.

    Raises
    ------
    debulk.InputError
        If an argument is not as expected; the message names it, what was expected and what was passed.

    Examples
    --------
    >>> matrix = [[1000.0, 0, 639.5], [0, 1000.0, 479.5], [0, 0, 1]]
    >>> calibration = Calibration([matrix, matrix], np.zeros((2, 5)), np.eye(3), (-200.0, 0, 0), (1280, 960))
    >>> [round(number, 6) for number in calibration.rectified.camera]
    [1000.0, 639.5, 479.5]
    """

    def __init__(
        self,
        camera_matrices: ArrayLike,
        distortions: ArrayLike,
        rotation: ArrayLike,
        translation_mm: ArrayLike,
        pixels: tuple[int, int],
        *,
        image_errors_px: Mapping[str, float] | None = None,
        spoiling: Mapping[str, str] | None = None,
        error_px: float = float("nan"),
        certainty: Certainty | None = None,
        boards: Sequence[BoardPlace] = (),
        remarks: Sequence[str] = (),
        projector: Projector | None = None,
    ) -> None:
        self.camera_matrices = _numbers(camera_matrices, "camera_matrices", (2, 3, 3))
        self.distortions = _numbers(distortions, "distortions", (2, None))
        if self.distortions.shape[1] not in _DISTORTIONS:
            raise InputError(
                f"distortions: expected two rows of {_DISTORTIONS} numbers, but got {self.distortions.shape[1]}"
            )
        self.rotation = _numbers(rotation, "rotation", (3, 3))
        if np.abs(self.rotation @ self.rotation.T - np.eye(3)).max() > 1e-4 or np.linalg.det(self.rotation) < 0:
            raise InputError("rotation: expected a rotation, but got a matrix that is none")
        self.translation_mm = _numbers(np.reshape(translation_mm, -1), "translation_mm", (3,))
        if not np.linalg.norm(self.translation_mm) > 0:
            raise InputError("translation_mm: expected the way between the cameras in mm, but got zero")
        for matrix in self.camera_matrices:
            if not (matrix[0, 0] > 0 and matrix[1, 1] > 0 and np.allclose(matrix[2], (0, 0, 1))):
                raise InputError(
                    f"camera_matrices: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], but got {matrix.tolist()}"
                )
        self.pixels = checked_pixels(pixels)
        self.image_errors_px = dict(image_errors_px or {})
        self.spoiling = dict(spoiling or {})
        self.error_px = float(error_px)
        self.certainty = certainty
        self.boards = tuple(boards)
        self.remarks = tuple(remarks)
        self.projector = projector

    def with_projector(self, projector: Projector | None) -> Calibration:
        """Return the same cameras with another projector."""
        other = copy.copy(self)
        other.projector = projector
        return other

    def text(self) -> str:
        """Say in a few lines how good the calibration is.

        Examples
        --------
        >>> matrix = [[1000.0, 0, 639.5], [0, 1000.0, 479.5], [0, 0, 1]]
        >>> print(Calibration([matrix, matrix], np.zeros((2, 5)), np.eye(3), (-200.0, 0, 0), (1280, 960)).text())
        error not known, cameras 200.00 mm apart
        how certain heights are is not known: only `debulk.scanner.calibrate` of this version computes it
        """
        apart = f"cameras {np.linalg.norm(self.translation_mm):.2f} mm apart"
        error = "error not known" if np.isnan(self.error_px) else f"error {self.error_px:.3f} px"
        found = self.certainty
        if found is None:
            lines = [
                f"{error}, {apart}",
                "how certain heights are is not known: only `debulk.scanner.calibrate` of this version computes it",
            ]
        else:
            left, right = found.focal_sd_px
            lines = [
                f"{error}, {apart} (standard deviation {found.baseline_sd_mm:.2g} mm)",
                f"focal lengths {self.camera_matrices[0, 0, 0]:.2f} and {self.camera_matrices[1, 0, 0]:.2f} px "
                f"(standard deviations {left:.2g} and {right:.2g} px)",
                f"{found.distance_mm:.0f} mm away, heights of {BUMP_MM:g} mm have a standard deviation of "
                f"{found.height_sd_mm:.2g} mm, {found.worst_height_sd_mm:.2g} mm where it is greatest, and a plane is "
                f"flat to {found.flatness_sd_mm:.2g} mm",
            ]
        return "\n".join([*lines, *self.remarks, *(f"left out: {name}: {why}" for name, why in self.spoiling.items())])

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the calibration as JSON, for `load`."""
        data = {
            "debulk scanner calibration": _VERSION,
            "pixels": list(self.pixels),
            "camera_matrices": self.camera_matrices.tolist(),
            "distortions": self.distortions.tolist(),
            "rotation": self.rotation.tolist(),
            "translation_mm": self.translation_mm.tolist(),
            "error_px": None if np.isnan(self.error_px) else self.error_px,
            "image_errors_px": self.image_errors_px,
            "spoiling": self.spoiling,
            "certainty": None if self.certainty is None else self.certainty.data(),
            "boards": [board.data() for board in self.boards],
            "remarks": list(self.remarks),
            "projector": None if self.projector is None else self.projector.data(),
        }
        write_text(Path(path), json.dumps(data, indent=1) + "\n")

    @classmethod
    @typed
    def load(cls, path: str | PathLike[str]) -> Calibration:
        """Read a calibration that `save` wrote; raises a debulk.InputError that names the file."""
        try:
            data = json.loads(read_small_text(Path(path)))
        except json.JSONDecodeError as error:
            raise InputError(f"{path}: expected a calibration as JSON, but got {error}") from None
        if not isinstance(data, dict) or data.get("debulk scanner calibration") != _VERSION:
            raise InputError(f"{path}: expected a debulk scanner calibration of version {_VERSION}")
        try:
            names = ("camera_matrices", "distortions", "rotation", "translation_mm", "pixels")
            error_px, projector, certainty = (data.get(name) for name in ("error_px", "projector", "certainty"))
            return cls(
                *(data[name] for name in names),
                image_errors_px=_table("image_errors_px", data, int, float),
                spoiling=_table("spoiling", data, str),
                error_px=float("nan") if error_px is None else error_px,
                certainty=None if certainty is None else Certainty.from_data(certainty),
                boards=[BoardPlace.from_data(board) for board in _list("boards", data)],
                remarks=[str(remark) for remark in _list("remarks", data)],
                projector=None if projector is None else Projector.from_data(projector),
            )
        except (InputError, KeyError) as error:
            raise InputError(f"{path}: {error}") from None
        except (TypeError, ValueError, ArithmeticError, AttributeError) as error:
            raise InputError(
                f"{path}: expected what a calibration writes, but a value is of another kind: {error}"
            ) from None

    @cached_property
    def rectified(self) -> Rectified:
        """The rectification of the images, prepared once."""
        return _rectify(self)


@dataclass(frozen=True, eq=False)
class Rectified:
    """Two pinhole images without distortion, rotated so that equal rows see the same planes through both cameras.

    Both have the same focal length, with which everything the left camera sees fits into an image of its size. Where
    that would be much coarser than the camera, they have the camera's focal length, and the image is larger.
    """

    focal_px: float
    left_centre: tuple[float, float]
    """cx, cy in pixels."""
    right_cx: float
    """cx of the right image, in pixels; its cy is that of the left one."""
    baseline_mm: float
    pixels: tuple[int, int]
    """Width and height of the left image."""
    rotation: Floats
    """(3, 3) x_rectified = rotation @ x_left: the frame of the cloud."""
    maps: tuple[Singles, Singles, Singles, Singles] = field(repr=False)
    """Where each rectified pixel lies in the original image: x, y for the left, x, y for the right."""

    @property
    def camera(self) -> tuple[float, float, float]:
        """(f, cx, cy) of the organised cloud."""
        return self.focal_px, *self.left_centre


def _rectify(calibration: Calibration) -> Rectified:
    import cv2

    width, height = calibration.pixels
    (left_k, right_k), (left_d, right_d) = calibration.camera_matrices, calibration.distortions
    turns = cv2.stereoRectify(
        left_k,
        left_d,
        right_k,
        right_d,
        (width, height),
        calibration.rotation,
        calibration.translation_mm[:, None],
        flags=0,
    )
    left_r, right_r = np.asarray(turns[0], np.float64), np.asarray(turns[1], np.float64)
    towards = right_r @ calibration.translation_mm
    if abs(towards[1]) > 1e-6 * abs(towards[0]) or towards[0] > 0:
        raise InputError(
            "calibration: expected the second camera to stand to the right of the first, but it stands "
            + ("to the left: exchange them" if abs(towards[1]) < abs(towards[0]) else "above or below it")
        )
    low, high = _extent(left_k, left_d, left_r, width, height)
    right_low, right_high = _extent(right_k, right_d, right_r, width, height)
    own = float(np.sqrt(left_k[0, 0] * left_k[1, 1]))
    f, (width, height) = resolved(low, high, own, calibration.pixels)
    cx = float((width - 1) / 2 - f * (low[0] + high[0]) / 2)
    cy = float((height - 1) / 2 - f * (low[1] + high[1]) / 2)
    right_width = int(np.ceil(f * (right_high[0] - right_low[0]))) + 1
    right_cx = float(-f * right_low[0])
    maps: list[Singles] = []
    for k, d, r, centre, columns in (
        (left_k, left_d, left_r, cx, width),
        (right_k, right_d, right_r, right_cx, right_width),
    ):
        pinhole = np.array([[f, 0, centre], [0, f, cy], [0, 0, 1]])
        made = cv2.initUndistortRectifyMap(k, d, r, pinhole, (columns, height), cv2.CV_32FC1)
        maps += [np.asarray(part, np.float32) for part in made]
    return Rectified(
        f,
        (cx, cy),
        right_cx,
        float(-towards[0]),
        (width, height),
        left_r,
        (maps[0], maps[1], maps[2], maps[3]),
    )


def _extent(matrix: Floats, distortion: Floats, rotation: Floats, width: int, height: int) -> tuple[Floats, Floats]:
    """Lowest and highest x / z and y / z at which the rectified camera sees the border of the image."""
    x, y = np.linspace(0, width - 1, 33), np.linspace(0, height - 1, 33)
    border = np.concatenate(
        [np.stack([x, np.full(33, at)], 1) for at in (0, height - 1)]
        + [np.stack([np.full(33, at), y], 1) for at in (0, width - 1)]
    )
    seen = undistorted(border, matrix, distortion, rotation=rotation, most=100, accuracy=1e-9)
    return seen.min(axis=0), seen.max(axis=0)


def _list(name: str, data: Mapping[str, Any]) -> list[Any]:
    value = data.get(name, [])
    if not isinstance(value, list):
        raise InputError(f"{name}: expected a list, but got {value!r}")
    return value


def _table(name: str, data: Mapping[str, Any], *kinds: type) -> dict[str, Any]:
    value = data.get(name) or {}
    if not isinstance(value, dict) or not all(isinstance(one, kinds) for one in value.values()):
        raise InputError(f"{name}: expected names with one {kinds[-1].__name__} each, but got {value!r}")
    return value


def _numbers(value: Any, name: str, shape: tuple[int | None, ...]) -> Floats:
    return arrays.numbers(value, name, shape, f"finite numbers of shape {shape}").copy()
