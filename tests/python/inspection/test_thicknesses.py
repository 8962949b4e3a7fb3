"""Thin and thick plies: what means the ply goes by its thickness."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import debulk
import spar
from debulk import Verdict
from debulk.inspection.evidence import two_layers
from debulk.recipe import options


def inspected(scan, reference, outline, thickness_mm):
    return debulk.inspect(scan, reference, debulk.Recipe(material={"thickness_mm": thickness_mm}), outline)


@pytest.mark.parametrize("thickness_mm", [0.13, 0.2, 0.6])
def test_a_ply_that_lies_ceases_with_nothing_but_its_thickness_in_the_recipe(thickness_mm):
    report = inspected(*spar.clouds(80.0, 20.0, thickness_mm), thickness_mm)
    assert report.verdict is Verdict.CEASE, report.reason


@pytest.mark.parametrize("thickness_mm", [0.13, 0.18, 0.2])
def test_the_mean_of_a_scan_without_the_ply_and_one_with_it_is_invalid(thickness_mm):
    """As a temporal filter makes it, or a buffer that was not cleared: all heights are halved."""
    scan, reference, outline = spar.clouds(20.0, 45.0, thickness_mm, lift_mm=1.9)
    assert spar.true_ridge_mm(20.0, 45.0, 1.9, thickness_mm) > 0.9
    before = spar.clouds(20.0, 45.0, thickness_mm, seed=1)[1]
    mean = (0.5 * (scan.astype(np.float64) + before)).astype(np.float32)
    report = inspected(mean, reference, outline, thickness_mm)
    assert report.verdict is Verdict.INVALID, report.reason
    assert report.findings[0].check == "level"


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_two_layers_in_one_list_of_points_are_named(share):
    """Scans before and after the ply was laid in one cloud, of which the first has a share of the points."""
    scan, reference, outline = spar.clouds(40.0, 30.0, 0.2, lift_mm=2.0)
    before = spar.clouds(40.0, 30.0, 0.2, seed=1)[1]
    from_before = np.random.default_rng(0).random(scan.shape[:2]) < share
    both = np.where(from_before[..., None], before, scan).reshape(-1, 3)
    report = inspected(both, reference, outline, 0.2)
    assert report.verdict is Verdict.INVALID
    assert report.reason.startswith("the scan holds two layers, 0.2"), report.reason
    alone = inspected(scan.reshape(-1, 3), reference, outline, 0.2)
    assert all(finding.check != "two_layers" for finding in alone.findings)


@pytest.mark.parametrize("mixed", [True, False])
def test_a_crowd_of_points_in_one_window_takes_no_square_of_its_memory(mixed):
    """As a list in metres has it; two layers are told from a step there as in any window."""
    rng = np.random.default_rng(0)
    xy = rng.uniform(0, 0.2, (20_000, 2))
    upper = rng.random(len(xy)) < 0.4 if mixed else xy[:, 0] > 0.1
    tracemalloc.start()
    try:
        apart = two_layers._apart_mm(xy, 0.3 * upper + rng.normal(0, 0.02, len(xy)))
        assert tracemalloc.get_traced_memory()[1] < 1e8
    finally:
        tracemalloc.stop()
    assert apart == (pytest.approx(0.3, abs=0.01) if mixed else 0.0)


@pytest.mark.parametrize("way", ["rows", "columns", "pixels"])
def test_two_passes_in_one_image_between_which_a_pocket_sank_are_named(way):
    """They agree but on the pocket, a small part of the ply; by the means of both it would close."""
    scan, reference, outline = spar.clouds(80.0, 20.0, 0.3, lift_mm=2.4)
    assert spar.true_ridge_mm(80.0, 20.0, 2.4, 0.3) > 0.66
    sank = spar.clouds(80.0, 20.0, 0.3, lift_mm=0.8, seed=1)[0]
    row, column = np.indices(scan.shape[:2])
    of = {"rows": row % 2 > 0, "columns": column % 2 > 0}.get(way, np.random.default_rng(0).random(row.shape) < 0.5)
    report = inspected(np.where(of[..., None], sank, scan), reference, outline, 0.3)
    assert report.verdict is Verdict.INVALID
    assert report.reason.startswith("the scan holds two layers, "), report.reason
    for alone in (scan, sank):
        report = inspected(alone, reference, outline, 0.3)
        assert report.verdict in (Verdict.CREASE, Verdict.CEASE), report.reason


@pytest.mark.parametrize("image", [True, False])
def test_repeated_points_are_named(image):
    """The outlier filter takes heaps of points away: of an enlarged image, or of a list that holds each five times."""
    scan, reference, outline = spar.clouds(80.0, 20.0, 0.3)
    height, width = scan.shape[:2]
    enlarged = scan[::2, ::2].repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
    report = inspected(enlarged if image else scan.reshape(-1, 3).repeat(5, axis=0), reference, outline, 0.3)
    assert report.verdict is Verdict.INVALID
    assert report.findings[0].check == "coverage"
    assert "or are its points repeated" in report.reason


def test_the_level_is_never_looser_than_a_third_or_so_of_the_thickness():
    of = [debulk.Recipe(material={"thickness_mm": t}, level={"tol_mm": 0.2}) for t in (0.15, 0.6)]
    assert [options.level_tol_mm(recipe) for recipe in of] == pytest.approx([0.0525, 0.2])
    assert options.level_tol_mm(debulk.Recipe()) == 0.1
