"""Calibration boards: checkerboards and ChArUco boards."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from debulk.scanner.inputs import InputError, one_of, whole

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class Board:
    """A flat board of black and white squares.

    Parameters
    ----------
    squares
        Number of squares across and down, including the outermost; at least 4. For a checkerboard, one number should be
        even and one odd, so that its orientation is unique.
    square_mm
        Side of a square, as measured on the board.
    kind
        "checkerboard", which must be seen whole, or "charuco", of which a part is enough.
    marker_mm
        Side of a ChArUco marker; None: three quarters of a square's side.
    dictionary
        Dictionary of the ChArUco markers, by OpenCV's name.

    Examples
    --------
    >>> Board((10, 7), 20.0).image(20).shape
    (180, 240)
    """

    squares: tuple[int, int]
    square_mm: float
    kind: Literal["checkerboard", "charuco"] = "checkerboard"
    marker_mm: float | None = None
    dictionary: str = "DICT_5X5_250"

    def __post_init__(self) -> None:
        if len(self.squares) != 2:
            raise InputError(f"squares: expected how many across and down, but got {self.squares!r}")
        for number in self.squares:
            whole("squares", number, 4, 100)
        one_of("kind", self.kind, ("checkerboard", "charuco"))
        if not 0 < self.square_mm < 1e4:
            raise InputError(f"square_mm: expected the side of a square in mm, but got {self.square_mm!r}")
        if self.marker_mm is not None and not 0 < self.marker_mm < self.square_mm:
            raise InputError(
                f"marker_mm: expected less than the square's {self.square_mm} mm, but got {self.marker_mm!r}"
            )

    @cached_property
    def corners_mm(self) -> F64:
        """(N, 3) inner corners in the board's frame, row by row."""
        across, down = self.squares
        x, y = np.meshgrid(np.arange(1, across), np.arange(1, down))
        return np.asarray(np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * self.square_mm, np.float64)

    def image(self, pixels_per_square: int = 100) -> NDArray[np.uint8]:
        """Draw the board with a white margin of one square round it."""
        whole("pixels_per_square", pixels_per_square, 8, 2000)
        across, down = self.squares
        size = pixels_per_square
        if self.kind == "charuco":
            board = self._charuco.generateImage((across * size, down * size))
        else:
            dark = np.add.outer(np.arange(down), np.arange(across)) % 2 == 0
            board = np.where(np.kron(dark, np.ones((size, size), dtype=np.bool_)), 0, 255).astype(np.uint8)
        return np.pad(np.asarray(board, np.uint8), size, constant_values=255)

    def find(self, image: NDArray[Any]) -> tuple[NDArray[np.int64], F64]:
        """Numbers of the corners that an 8-bit image shows, and their (K, 2) positions in pixels; empty if none."""
        import cv2

        nothing = np.empty(0, np.int64), np.empty((0, 2))
        if self.kind == "checkerboard":
            size = self.squares[0] - 1, self.squares[1] - 1
            found, corners = cv2.findChessboardCornersSB(
                image, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
            )
            if not found:
                return nothing
            return np.arange(size[0] * size[1]), np.asarray(corners, np.float64).reshape(-1, 2)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(self._charuco).detectBoard(image)
        if ids is None or len(ids) < 8:
            return nothing
        return np.asarray(ids, np.int64).ravel(), np.asarray(corners, np.float64).reshape(-1, 2)

    @cached_property
    def _charuco(self) -> Any:
        import cv2

        known = getattr(cv2.aruco, self.dictionary, None)
        if not isinstance(known, int):
            raise InputError(f"dictionary: expected a name like DICT_5X5_250, but got {self.dictionary!r}")
        marker = 0.75 * self.square_mm if self.marker_mm is None else self.marker_mm
        return cv2.aruco.CharucoBoard(
            self.squares, float(self.square_mm), float(marker), cv2.aruco.getPredefinedDictionary(known)
        )
