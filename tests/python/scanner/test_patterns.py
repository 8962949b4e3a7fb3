"""Fringe patterns."""

import numpy as np
import pytest

from debulk import InputError
from debulk.scanner import fringe_patterns


def test_each_image_is_its_formula():
    patterns = fringe_patterns((400, 100), (7, 8), 5)
    assert patterns.shape == (10, 100, 400)
    for p, n in enumerate((7, 8)):
        for k in range(5):
            for column in (0, 17, 250, 399):
                expected = 127.5 * (1 + np.cos(2 * np.pi * (n * (column + 0.5) / 400 + k / 5)))
                assert abs(int(patterns[5 * p + k, 50, column]) - expected) <= 0.5


def test_horizontal_fringes_are_vertical_ones_of_the_turned_projector():
    flat = fringe_patterns((100, 400), (7, 8), 5, "horizontal")
    assert np.array_equal(flat, fringe_patterns((400, 100), (7, 8), 5).transpose(0, 2, 1))
    both = fringe_patterns((100, 400), (7, 8), 5, "both")
    assert np.array_equal(both[10:], flat)
    assert len(both) == 20


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"pixels": (0, 100)}, "pixels: expected a whole number"),
        ({"pixels": 5}, "pixels: expected \\(width, height\\)"),
        ({"periods": (50,)}, "periods: expected two to six"),
        ({"periods": (50, 52)}, "periods: expected numbers from which one period"),
        ({"periods": 50}, "periods: expected two to six whole numbers"),
        ({"periods": (50, 51.5)}, "periods: expected two to six whole numbers"),
        ({"steps": 2}, "steps: expected a whole number of 3"),
        ({"direction": "up"}, "direction: expected one of 'vertical'"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(InputError, match=message):
        fringe_patterns(**arguments)
