"""Steep molds: a ply keeps its thickness along the mold's normal, and nothing hides below it on a slope."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
import spar
from debulk import Verdict, surface


def inspected(radius_mm, slope_deg, thickness_mm, lift_mm=0.0):
    scan, reference, outline = spar.clouds(radius_mm, slope_deg, thickness_mm, lift_mm)
    recipe = debulk.Recipe(material={"thickness_mm": thickness_mm})
    return debulk.inspect(scan, reference, recipe, outline)


@pytest.mark.parametrize(
    ("radius_mm", "slope_deg", "thickness_mm"), [(20.0, 58.0, 0.6), (40.0, 51.0, 0.3), (80.0, 62.0, 0.6)]
)
def test_a_ply_that_lies_on_a_spar_ceases(radius_mm, slope_deg, thickness_mm):
    report = inspected(radius_mm, slope_deg, thickness_mm)
    assert report.verdict is Verdict.CEASE, report.reason
    assert abs(report.level.laid_mm - thickness_mm) < 0.01


@pytest.mark.parametrize(
    ("radius_mm", "slope_deg", "thickness_mm", "lift_mm"),
    [(20.0, 58.0, 0.6, 1.25), (15.0, 62.0, 0.13, 1.2), (40.0, 45.0, 0.3, 1.2)],
)
def test_a_ply_that_stands_off_the_crest_does_not(radius_mm, slope_deg, thickness_mm, lift_mm):
    true_mm = spar.true_ridge_mm(radius_mm, slope_deg, lift_mm, thickness_mm)
    assert true_mm > 0.7
    report = inspected(radius_mm, slope_deg, thickness_mm, lift_mm)
    assert report.verdict is Verdict.CREASE, report.reason
    assert report.pockets[0].ridge_height_mm == pytest.approx(true_mm, abs=0.15)


def test_a_steeper_mold_is_invalid_and_says_where_and_how_steep():
    report = inspected(40.0, 72.0, 0.3)
    assert report.verdict is Verdict.INVALID
    assert report.reason.startswith("the mold is too steep below the ply: over")
    (finding,) = (one for one in report.findings if one.check == "steep_mold")
    assert 66 < finding.measured < 75
    assert abs(abs(finding.place_mm[0]) - 45) < 15  # on one of the flanks


def test_the_datum_of_a_cylinder_is_one_that_is_thicker_by_the_ply():
    x = np.arange(-20.0, 20.5, 0.5)
    mold = surface.Reference(np.tile(np.sqrt(30.0**2 - x**2), (8, 1)), (-20.0, 0.0), 0.5)
    at = np.stack([np.linspace(-18, 18, 7), np.full(7, 1.7)], axis=1)
    top = mold.datum(0.6).height(at) + 0.6
    assert np.allclose(top, np.sqrt(30.6**2 - at[:, 0] ** 2), atol=1e-4)


def test_the_datum_of_a_flat_mold_is_the_mold():
    mold = surface.Reference(np.full((6, 6), 3.0), (0.0, 0.0), 4.0)
    assert mold.datum(0.3) is mold
    with pytest.raises(debulk.InputError, match="thickness_mm: expected a length in mm, not negative"):
        mold.datum(-0.1)
