"""The bridges of a known ply against their closed form: a string of the radius R over a trough of the radius R0."""

from types import SimpleNamespace

import numpy as np
import pytest

from debulk import Recipe
from lab.varied.bridges import highest_mm

R0_MM, R_MM, HALF_MM = 30.0, 50.0, 25.0
GAP_MM = 0.5 * HALF_MM**2 * (1 / R0_MM - 1 / R_MM)  # docs/model.md, section 5


def ply(half_mm, beyond_mm=0.0):
    """Return a ply along x, so many mm to either side, as a string over a trough; the mold falls off beside it."""

    def sag(xy, per_mm):
        x = np.asarray(xy)[..., 0]
        return 0.5 * np.maximum(HALF_MM**2 - x**2, 0) * per_mm

    truth = SimpleNamespace(
        thickness_mm=0.3,
        mold_height=lambda xy: -sag(xy, 1 / R0_MM) - beyond_mm * (np.abs(np.asarray(xy)[..., 0]) > half_mm),
        ply_height_above_mold=lambda xy: 0.3 + sag(xy, 1 / R0_MM - 1 / R_MM),
    )
    corners = np.array([(-half_mm, -60.0), (half_mm, -60.0), (half_mm, 60.0), (-half_mm, 60.0)])
    return SimpleNamespace(truth=truth, ply_outline=corners, fibre_angles_deg=(0.0, 90.0))


def test_the_highest_bridge_is_the_string_that_the_ply_is():
    assert highest_mm(ply(200.0), Recipe()) == pytest.approx(GAP_MM + Recipe().material.consolidated_mm, rel=0.01)


def test_a_ply_that_friction_does_not_hold_lies_down():
    assert highest_mm(ply(80.0), Recipe()) == 0  # μ d = 22 mm is less than R0


def test_no_string_hangs_over_the_cliff_beside_the_ply():
    assert highest_mm(ply(40.0, beyond_mm=100.0), Recipe()) == 0
