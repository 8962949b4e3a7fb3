"""Says why a board was not found in an image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Singles
from debulk.scanner.board import Board

_LEAST_CONTRAST = 20.0  # grey values
_SHARPEST_PX = 6.0  # width of the sharpest edges in an image that is blurred
_LEAST_SEEN = 0.25  # of the corners: fewer may be something else than the board
_RING = 5.0  # radius of the ring on which a crossing of two edges is recognised, pixels
_LEAST_CROSSING = 0.35  # of the image's contrast


def why_not_found(image: NDArray[np.uint8], board: Board) -> str:
    """Name the likely reason: no contrast, cut off, covered, another board, or blurred."""
    soft = _soft(image)
    low, high = (float(v) for v in np.percentile(soft, [1, 99]))
    if high - low < _LEAST_CONTRAST:
        dark = "too dark" if high < 2 * _LEAST_CONTRAST else "too bright" if low > 255 - 2 * _LEAST_CONTRAST else "flat"
        return f"the image is {dark}, with grey values of {low:.0f} to {high:.0f}"
    if board.kind == "charuco":
        markers = board.count_markers(image)
        if markers:
            return (
                f"too few corners between the {markers} markers that are seen: it is cut off or covered, or has other "
                "numbers of squares"
            )
    at = crossings(soft, high - low)
    across, down = board.squares
    wanted = (across - 1) * (down - 1)
    if board.kind == "checkerboard" and len(at) >= _LEAST_SEEN * wanted:
        sides = _sides_near(at, image.shape)
        seen = f"about {len(at)} of {wanted} corners are seen"
        if sides:
            return f"{seen}, up to the {' and '.join(sides)} edge of the image: it is cut off there"
        if len(at) == across * down:
            return f"{seen}, as a board of {across + 1} x {down + 1} squares has: give its squares, not its corners"
        return f"{seen}: it is covered in part, glares, or has other numbers of squares"
    slope = np.hypot(*np.gradient(soft))
    width = (high - low) / max(float(np.percentile(slope, 99.95)), 1e-9)
    if width > _SHARPEST_PX:
        return f"the image is blurred: its sharpest edges are {width:.0f} pixels wide"
    return f"no marker of {board.dictionary} is seen" if board.kind == "charuco" else "nothing like a board is seen"


def crossings(image: Singles, contrast: float) -> NDArray[np.float64]:
    """Find where four squares meet, (N, 2) pixels: on a ring, opposite points agree and those between them differ.

    This is the response of Bennett and Lasenby, "ChESS - Quick and robust detection of chess-board features", Computer
    Vision and Image Understanding 118 (2014).
    """
    import cv2

    angles = np.arange(16) * np.pi / 8
    ring = []
    for dx, dy in zip(np.rint(_RING * np.cos(angles)), np.rint(_RING * np.sin(angles)), strict=True):
        shift = np.array([[1, 0, -dx], [0, 1, -dy]], np.float32)
        ring.append(cv2.warpAffine(image, shift, image.shape[::-1], flags=cv2.INTER_NEAREST))
    values = np.stack(ring)
    crossing = np.abs(values[:4] + values[8:12] - values[4:8] - values[12:]).sum(axis=0)
    edge = np.abs(values[:8] - values[8:]).sum(axis=0)
    line = 16 * np.abs(values.mean(axis=0) - cv2.blur(image, (3, 3)))
    response = ((crossing - edge - line) / (8 * contrast)).astype(np.float32)
    reach = int(_RING)
    response[:reach] = response[-reach:] = 0
    response[:, :reach] = response[:, -reach:] = 0
    top = cv2.dilate(response, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    rows, columns = np.nonzero((response == top) & (response > _LEAST_CROSSING))
    return np.column_stack([columns, rows]).astype(np.float64)


def _soft(image: NDArray[np.uint8]) -> Singles:
    import cv2

    return np.asarray(cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.0), np.float32)


def _sides_near(at: NDArray[np.float64], shape: tuple[int, ...]) -> list[str]:
    """Name the image's edges that lie within a square of a corner; the square is the median nearest distance."""
    apart = np.linalg.norm(at[:, None] - at[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    square = float(np.median(apart.min(axis=1)))
    height, width = shape[:2]
    x, y = at.T
    near = {"left": x.min(), "right": width - 1 - x.max(), "upper": y.min(), "lower": height - 1 - y.max()}
    return [side for side, distance in near.items() if distance < square]
