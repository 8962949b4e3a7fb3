"""Calibration boards: checkerboards and ChArUco boards."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from debulk.arguments import whole
from debulk.arrays import Floats, Singles
from debulk.scanner.inputs import InputError, one_of

LEAST_CORNERS = 8
"""Fewer corners of a ChArUco board are not used."""
_NOTHING = np.empty(0, np.int64), np.empty((0, 2))


@dataclass(frozen=True)
class Board:
    """A flat board of black and white squares.

    Examples
    --------
    >>> Board((10, 7), 20.0).image(20).shape
    (180, 240)
    """

    squares: tuple[int, int]
    """Number of squares across and down, including the outermost; at least 4. A checkerboard should have one even and
    one odd number, so that it looks different when it is turned. One that looks the same is accepted if the cameras
    turn out to see it the same way round."""
    square_mm: float
    """Side of a square, as measured on the board."""
    kind: Literal["checkerboard", "charuco"] = "checkerboard"
    """"checkerboard", which must be seen whole, or "charuco", of which a part is enough."""
    marker_mm: float | None = None
    """Side of a ChArUco marker; None: three quarters of a square's side."""
    dictionary: str = "DICT_5X5_250"
    """Dictionary of the ChArUco markers, by OpenCV's name."""
    legacy: bool | None = None
    """Whether a ChArUco board with an even number of squares down has a white square in its upper left corner, as
    OpenCV before 4.6 drew it; None: both are tried."""

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
    def corners_mm(self) -> Floats:
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

    @property
    def turns(self) -> tuple[NDArray[np.int64], ...]:
        """Orders of the corners that a camera cannot tell apart: that of `corners_mm` first, then the turned ones.

        A turn by 180 degrees exchanges black and white unless both numbers of squares are even or both odd; one by 90
        degrees fits a square board and keeps the colours if the number is odd.
        """
        across, down = self.squares
        order = np.arange((across - 1) * (down - 1)).reshape(down - 1, across - 1)
        if self.kind == "charuco" or (across + down) % 2:
            quarters = [0]
        else:
            quarters = [0, 1, 2, 3] if across == down and across % 2 else [0, 2]
        return tuple(np.rot90(order, k).ravel() for k in quarters)

    def find(self, image: NDArray[Any]) -> tuple[NDArray[np.int64], Floats]:
        """Numbers of the corners that an 8-bit image shows, and their (K, 2) positions in pixels; empty if none."""
        import cv2

        if self.kind == "checkerboard":
            size = self.squares[0] - 1, self.squares[1] - 1
            found, corners = cv2.findChessboardCornersSB(
                image, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
            )
            if not found:
                return _NOTHING
            return np.arange(size[0] * size[1]), self._refined(image, np.asarray(corners, np.float32))
        for layout in self.layouts():
            corners, ids, _, markers = cv2.aruco.CharucoDetector(layout._charuco).detectBoard(image)
            if ids is not None and len(ids) >= LEAST_CORNERS:
                return np.asarray(ids, np.int64).ravel(), layout._refined(image, np.asarray(corners, np.float32))
            if markers is None or len(markers) < 2:
                break
        return _NOTHING

    def layouts(self) -> tuple[Board, ...]:
        """Return the board in each layout that it may have."""
        if self.kind == "charuco" and self.legacy is None and self.squares[1] % 2 == 0:
            return replace(self, legacy=False), replace(self, legacy=True)
        return (self,)

    def count_markers(self, image: NDArray[Any]) -> int:
        """Count the markers of a ChArUco board that an image shows."""
        import cv2

        _, ids, _ = cv2.aruco.ArucoDetector(self._charuco.getDictionary()).detectMarkers(image)
        return 0 if ids is None else len(ids)

    def _refined(self, image: NDArray[Any], corners: Singles) -> Floats:
        """Place corners between pixels, by a window as large as the squares allow that no marker reaches into.

        The detectors' own corners are off by 0.1 px of a checkerboard and 0.2 to 0.3 px of a ChArUco board, these by
        0.03 and 0.04 px.
        """
        import cv2

        apart = np.linalg.norm(corners.reshape(-1, 1, 2) - corners.reshape(1, -1, 2), axis=2)
        np.fill_diagonal(apart, np.inf)
        square = float(np.percentile(apart.min(axis=1), 10))
        # From a corner to the nearest other thing, each way: a marker, or the next corner.
        free = 0.5 * (1 - self._marker_mm / self.square_mm) if self.kind == "charuco" else 0.6
        half = int(np.clip(round(0.6 * free * square), 2, 15))
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-3)
        refined = cv2.cornerSubPix(image, corners.reshape(-1, 1, 2).copy(), (half, half), (-1, -1), criteria)
        return np.asarray(refined, np.float64).reshape(-1, 2)

    @property
    def _marker_mm(self) -> float:
        return 0.75 * self.square_mm if self.marker_mm is None else self.marker_mm

    @cached_property
    def _charuco(self) -> Any:
        import cv2

        known = getattr(cv2.aruco, self.dictionary, None)
        if not isinstance(known, int):
            raise InputError(f"dictionary: expected a name like DICT_5X5_250, but got {self.dictionary!r}")
        made = cv2.aruco.CharucoBoard(
            self.squares, float(self.square_mm), float(self._marker_mm), cv2.aruco.getPredefinedDictionary(known)
        )
        made.setLegacyPattern(bool(self.legacy))
        return made
