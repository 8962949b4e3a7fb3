"""The ply's edge, a step of one thickness, tells how far a scan spreads what it shows."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

import laid_ply
from debulk import Inspector, Recipe, scenes
from debulk.inspection.evidence.outline import Outline
from debulk.inspection.rawscan.edge_spread import EdgeSpread
from debulk.verdict import Verdict
from lab.varied import varied_layup
from lab.varied.filters import FILTERS, filtered

FLAT = laid_ply.bell(0, 0, 1, 0)


def edge(outline_mm=None, threads=1):
    setup = laid_ply.inspector().setup
    setup = replace(setup, ply=replace(setup.ply, recipe=Recipe(run={"threads": threads})))
    return EdgeSpread(setup, Outline(laid_ply.layup().ply_outline if outline_mm is None else outline_mm))


def spread_mm(scan, mask=None, threads=1):
    hidden = scan if mask is None else np.where(mask[..., None], np.float32(np.nan), scan)
    return edge(threads=threads).least_mm(hidden)


@pytest.mark.parametrize("noise_mm", [0.0, 0.005, 0.02, 0.05, 0.1])
def test_a_sharp_edge_is_not_spread(noise_mm):
    assert abs(spread_mm(laid_ply.scan(FLAT, noise_mm))) < 0.5


@pytest.mark.parametrize("noise_mm", [0.0, 0.02, 0.05])
@pytest.mark.parametrize(
    ("name", "sigma"),  # pixels, of 1 mm; a box's is the root of (n² - 1) / 12
    [
        ("Gaussian of 1 pixel", 1.0),
        ("Gaussian of 2 pixels", 2.0),
        ("box of 5 pixels", 2**0.5),
        ("box of 9 pixels", 2.6),
    ],
)
def test_a_filters_sigma_is_found(name, sigma, noise_mm):
    """Less what it is uncertain by; flying pixels, smeared, are part of that."""
    found = spread_mm(filtered(laid_ply.scan(FLAT, noise_mm), FILTERS[name]))
    assert 0.65 * sigma < found < 1.1 * sigma


@pytest.mark.parametrize("size", [(9, 1), (1, 9)])
def test_what_blurs_along_rows_or_columns_only_is_found(size):
    """The middle of all windows would be that of the edges along it, which stay sharp, or between both."""
    found = spread_mm(filtered(laid_ply.scan(FLAT), lambda image: cv2.blur(image, size)))
    assert 0.65 * 2.6 < found < 1.1 * 2.6


def test_a_bilateral_filter_wider_than_the_step_is_found():
    assert spread_mm(filtered(laid_ply.scan(FLAT), FILTERS["bilateral, 9 pixels, 2 mm"])) > 1.2


def test_where_the_outline_lies_a_little_off_changes_nothing():
    layup, scan = laid_ply.layup(), filtered(laid_ply.scan(FLAT), FILTERS["Gaussian of 2 pixels"])
    middle = layup.ply_outline.mean(axis=0)
    for off_mm in (-2.0, 2.0):
        out = layup.ply_outline + off_mm * (layup.ply_outline - middle) / np.abs(layup.ply_outline - middle).max()
        assert edge(out).least_mm(scan) == pytest.approx(edge().least_mm(scan), abs=0.3)


def test_no_edge_no_answer():
    scan = laid_ply.scan(FLAT)
    assert np.isnan(spread_mm(np.full_like(scan, np.nan)))
    assert np.isnan(spread_mm(scan[:20]))
    assert np.isnan(spread_mm(laid_ply.layup().reference))  # no ply in it
    assert np.isnan(spread_mm(scan, np.ones(scan.shape[:2], dtype=bool)))
    assert np.isnan(spread_mm(np.zeros_like(scan)))
    assert np.isnan(spread_mm(np.full_like(scan, 1e30)))


def test_the_same_bits_on_any_number_of_threads():
    scan = laid_ply.scan(FLAT)
    assert spread_mm(scan, threads=1) == spread_mm(scan, threads=2)


def test_a_layup_whose_edge_is_spread_is_undecided():
    scan = filtered(laid_ply.scan(FLAT), FILTERS["bilateral, 9 pixels, 2 mm"])
    report = laid_ply.inspector().inspect(scan)
    assert report.verdict is Verdict.UNDECIDED
    assert "spreads the ply's edge as a Gaussian of 1." in report.reason


@pytest.mark.parametrize(("fine_mm", "expected"), [(0.5, Verdict.UNDECIDED), (2.0, Verdict.CEASE)])
def test_the_recipe_may_allow_for_it(fine_mm, expected):
    layup, recipe = laid_ply.layup(), Recipe(clean={"fine_mm": fine_mm})
    inspector = Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    scan = filtered(laid_ply.scan(FLAT), lambda image: cv2.bilateralFilter(image, 7, 2.0, 3.0))
    assert inspector.inspect(scan).verdict is expected


@pytest.mark.parametrize(("sigma", "blurred"), [(0.0, False), (3.0, True)])
def test_without_an_outline_the_edge_that_the_scan_shows_is_judged(sigma, blurred):
    layup, grain = laid_ply.layup(), np.random.default_rng(0).normal(0, 0.02, laid_ply.scan(FLAT).shape[:2])
    scan = filtered(laid_ply.scan(FLAT), lambda image: cv2.GaussianBlur(image, (0, 0), sigma) if sigma else image)
    scan[..., 2] += grain.astype(np.float32)  # a filter that leaves white noise of its own
    mold = laid_ply.inspector().prepared
    report = Inspector(None, mold, mold_from_scanner=layup.mold_from_scanner).inspect(scan)
    assert not any("how sharp" in entry.what for entry in report.left_out)
    assert any(finding.check == "smoothed" for finding in report.findings) == blurred


def test_where_no_edge_is_seen_the_report_says_so():
    layup, inside = laid_ply.layup(), np.s_[100:-100, 100:-100]
    inspector = Inspector(None, layup.reference[inside], mold_from_scanner=layup.mold_from_scanner)
    left_out = inspector.inspect(laid_ply.scan(FLAT)[inside]).left_out
    assert any(entry.what == "how sharp the scan is, by the ply's edge" for entry in left_out)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("make", [scenes.layup, varied_layup])
def test_layups_of_both_families_are_sharp(make, seed):
    layup = make(seed, (640, 480))
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    assert "spreads the ply's edge" not in inspector.inspect(layup.scan).reason
