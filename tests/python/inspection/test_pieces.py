"""The connected pieces of a mask equal those that OpenCV's own statistics describe."""

import cv2
import numpy as np
import pytest

from debulk.inspection.evidence.pieces import pieces_of


@pytest.mark.parametrize("connectivity", [4, 8])
def test_sizes_and_boxes_are_those_of_opencv(connectivity):
    marks = np.random.default_rng(0).random((40, 61)) < 0.3
    count, labels, stats, _ = cv2.connectedComponentsWithStats(marks.astype(np.uint8), connectivity=connectivity)
    pieces = pieces_of(marks, connectivity)
    assert count > 30 and np.array_equal(pieces.labels, labels)
    assert pieces.sizes[0] == 0 and np.array_equal(pieces.sizes[1:], stats[1:, cv2.CC_STAT_AREA])
    left, top, wide, high = stats[1:, :4].T
    assert np.array_equal(pieces.boxes[1:], np.stack([top, top + high, left, left + wide], axis=1))


def test_the_window_of_a_piece_ends_at_the_image():
    marks = np.zeros((9, 9), dtype=np.bool_)
    marks[1:4, 5:8] = True
    pieces = pieces_of(marks, 4)
    assert pieces.of_size(9) == [1] and pieces.of_size(10) == [] and pieces.of_size(0) == [1]
    assert pieces.window(1, 2) == (slice(0, 6), slice(3, 10))


def test_an_empty_mask_has_no_pieces():
    assert pieces_of(np.zeros((3, 4), dtype=np.bool_), 8).of_size(0) == []
