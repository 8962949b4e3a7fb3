"""One scene of the virtual scanner that several tests look at, and fringes written from the formula alone."""

from __future__ import annotations

import numpy as np
import pytest

from debulk import scanner, scenes


@pytest.fixture(scope="session")
def layup():
    return scenes.layup(seed=3, pixels=(320, 240))


@pytest.fixture(scope="session")
def fringes(layup):
    """A ply seen at 640 x 480, three exposures."""
    return scenes.fringe_images(layup, pixels=(640, 480))


@pytest.fixture(scope="session")
def scanned(fringes):
    """That ply scanned, and the scanner with its phases."""
    instrument = scanner.Scanner(fringes.calibration, details=True)
    return instrument.scan(fringes.left, fringes.right), instrument


@pytest.fixture(scope="session")
def formula():
    """Images of a wall of uneven brightness: formula(periods, steps) -> (n, 60, 640) uint8."""

    def make(periods=(50, 51), steps=6, gamma=1.0, noise=1.0, seed=0):
        rng = np.random.default_rng(seed)
        u = (np.arange(640) + 0.5) / 640
        wall = rng.uniform(0.4, 1.0, (60, 640))
        images = []
        for n in periods:
            for k in range(steps):
                light = (0.5 + 0.5 * np.cos(2 * np.pi * (n * u + k / steps))) ** gamma
                images.append(np.clip(np.rint(wall * (10 + 220 * light) + rng.normal(0, noise, wall.shape)), 0, 255))
        return np.array(images, dtype=np.uint8)

    return make
