"""Whether outlines come close, against the distances of all corners."""

import numpy as np
import pytest

from debulk import pocket
from debulk.inspection.near_outlines import come_within


def star(rng, corners):
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    radius = rng.uniform(5, 30) * (1 + 0.4 * np.sin(rng.integers(2, 7) * angle + rng.uniform(0, 6)))
    return rng.uniform(-60, 60, 2) + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("seed", range(20))
def test_the_answer_is_that_of_all_corners(seed):
    rng = np.random.default_rng(seed)
    one, other = star(rng, int(rng.integers(3, 2000))), star(rng, int(rng.integers(3, 2000)))
    nearest = pocket.distance_to_outline(one, other).min()
    for most in (*rng.uniform(0, 60, 8), nearest, np.nextafter(nearest, 0), nearest * 1.001, nearest * 0.999):
        assert come_within(one, other, most) == (nearest <= most)
