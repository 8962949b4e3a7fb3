"""The connected pieces of a mask, with their sizes and boxes.

OpenCV's own statistics visit all cells of the image, most of which belong to no piece. That takes eight times as long
as finding the pieces.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Bools, Cloud, Whole


class Pieces(NamedTuple):
    """The pieces of a mask, numbered from 1."""

    labels: NDArray[np.int32]
    """(H, W) number of each cell's piece; 0: it belongs to none."""
    sizes: Whole
    """(N,) number of cells of each piece; 0 cells belong to piece 0."""
    boxes: Whole
    """(N, 4) first row, row behind the last, first column and column behind the last of each piece."""

    def of_size(self, least: float) -> list[int]:
        """Return the numbers of the pieces with at least so many cells."""
        return [int(number) for number in np.flatnonzero(self.sizes[1:] >= least) + 1]

    def each(self, least: float, around: int) -> Iterator[tuple[tuple[slice, slice], Bools]]:
        """Yield the `window` of each piece with at least so many cells, and which cells in it are its own."""
        for number in self.of_size(least):
            window = self.window(number, around)
            yield window, self.labels[window] == number

    def window(self, number: int, around: int) -> tuple[slice, slice]:
        """Return the rows and columns of a piece, and so many around it."""
        top, bottom, left, right = self.boxes[number].tolist()
        return slice(max(0, top - around), bottom + around), slice(max(0, left - around), right + around)

    def rings(self) -> tuple[Whole, Whole]:
        """Return the cells that touch pieces whose own cells touch at corners, too, piece by piece.

        The (M,) numbers of the pieces come first, then the (M,) flat indices of the cells.
        """
        framed = np.pad(self.labels, 1, constant_values=-1)
        width = framed.shape[1]
        own = np.flatnonzero(framed > 0)
        near = own[:, None] + np.array([-width - 1, -width, -width + 1, -1, 1, width - 1, width, width + 1])
        pairs = framed.flat[own][:, None].astype(np.int64) * framed.size + near
        of, cell = np.divmod(np.unique(pairs[framed.flat[near] == 0]), framed.size)
        row, column = np.divmod(cell, width)
        return of, (row - 1) * (width - 2) + column - 1

    def medians(self, values: Cloud) -> Cloud:
        """Return the (N,) medians of an image's values (H, W) over each piece; NaN for number 0."""
        own = np.flatnonzero(self.labels)
        own = own[np.lexsort((values.flat[own], self.labels.flat[own]))]
        ends = np.cumsum(self.sizes)[1:]
        middle = values.flat[own[[ends - 1 - self.sizes[1:] // 2, ends - (self.sizes[1:] + 1) // 2]]]
        return np.append(np.float32(np.nan), (middle[0] + middle[1]) / 2)


def pieces_of(marks: Bools, connectivity: int) -> Pieces:
    """Find the pieces of a mask (H, W), whose cells touch along sides (4) or at corners, too (8)."""
    count, found = cv2.connectedComponents(marks.view(np.uint8), connectivity=connectivity)
    labels = np.asarray(found, dtype=np.int32)
    cells = np.flatnonzero(marks)
    own = labels.reshape(-1)[cells]
    boxes = np.tile(np.array([marks.shape[0], 0, marks.shape[1], 0]), (count, 1))
    for first, at in ((0, cells // marks.shape[1]), (2, cells % marks.shape[1])):
        np.minimum.at(boxes[:, first], own, at)
        np.maximum.at(boxes[:, first + 1], own, at + 1)
    return Pieces(labels, np.bincount(own, minlength=count), boxes)


def grown(marks: Bools, cells: int = 1) -> Bools:
    """Return the (ny, nx) marks, extended by this number of cells along each axis."""
    square = np.ones((2 * cells + 1, 2 * cells + 1), dtype=np.uint8)
    return np.asarray(cv2.dilate(marks.astype(np.uint8), square).astype(np.bool_))
