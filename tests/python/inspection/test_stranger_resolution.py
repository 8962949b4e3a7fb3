"""Pockets that are narrow for the distance of the points, or for the recipe's net, are not passed by it."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
from debulk.verdict import Verdict
from stranger_scenes import bump, cloud, flat, laid, outline, ridge_mm

SIZE, PLY = (260.0, 240.0), (220.0, 200.0)


def _inspected(radius_mm, high_mm, pitch_mm, **recipe):
    standing = bump(radius_mm, high_mm)
    assert ridge_mm(standing, radius_mm) > 0.64
    scan, reference = (
        cloud(one, SIZE, pitch_mm, seed) for seed, one in enumerate([laid(flat, standing, PLY), flat], start=1)
    )
    return debulk.inspect(
        scan, reference, debulk.Recipe(**recipe), ply_outline=outline(*PLY), mold_from_scanner=np.eye(4)
    )


@pytest.mark.parametrize(
    ("radius_mm", "high_mm", "pitch_mm", "median"),
    [(20, 4.5, 2.5, 3), (25, 5.2, 3.0, 3), (30, 5.2, 3.0, 3), (20, 4.5, 2.0, 5), (20, 4.5, 3.0, 3)],
)
def test_a_pocket_that_the_filters_lower_is_not_passed(radius_mm, high_mm, pitch_mm, median):
    report = _inspected(radius_mm, high_mm, pitch_mm, clean={"median_cells": median})
    assert report.verdict in (Verdict.UNDECIDED, Verdict.CREASE)


def test_the_reason_asks_for_a_denser_scan():
    report = _inspected(12, 3.2, 3.0)
    assert "give a denser scan" in report.reason


@pytest.mark.parametrize("net", [{"node_target": 20}, {"spacing_mm": 40.0}, {"spacing_mm": 10.0}])
def test_a_net_that_steps_over_a_small_bump_does_not_bound_it(net):
    report = _inspected(16, 3.6, 1.0, net=net)
    assert report.verdict in (Verdict.UNDECIDED, Verdict.CREASE)
    assert [p.promoted != "" for p in report.pockets] == [True]


@pytest.mark.parametrize(("radius_mm", "high_mm"), [(12, 5.0), (14, 6.0), (18, 7.0)])
def test_an_area_tolerance_however_large_hides_no_bump_that_creases(radius_mm, high_mm):
    report = _inspected(radius_mm, high_mm, 1.0, segmentation={"area_tol_mm2": 1e5})
    assert report.verdict is Verdict.CREASE


def test_a_cut_above_whole_pockets_is_refused():
    with pytest.raises(debulk.InputError, match=r"segmentation\.cut_height_mm: expected at most 4 .* got 50"):
        debulk.Recipe(segmentation={"cut_height_mm": 50.0})


@pytest.mark.parametrize(("radius_mm", "high_mm", "pitch_mm"), [(9, 3.6, 2.0), (12, 4.0, 3.0)])
def test_the_spike_filter_takes_no_bump_of_a_coarse_scan(radius_mm, high_mm, pitch_mm):
    report = _inspected(radius_mm, high_mm, pitch_mm)
    assert report.verdict in (Verdict.UNDECIDED, Verdict.CREASE)


def _lines(across_mm, *, image, along_mm=0.25, high_mm=5.0, radius_mm=15.0):
    """A scan and a reference by a line scanner, with a bump, by default one that creases."""
    x, y = np.meshgrid(np.arange(0.0, 200.0, along_mm), np.arange(0.0, 180.0, across_mm))
    noise = np.random.default_rng(3).normal(0.0, 0.02, (2, *x.shape))
    r = np.minimum(np.hypot(x - 100, y - 90) / radius_mm, 1)
    ply = (abs(x - 100) < 80) & (abs(y - 90) < 70)
    top = 0.3 + high_mm * np.cos(np.pi / 2 * r) ** 2
    clouds = [np.dstack([x, y, z]) for z in (np.where(ply, top, 0.0) + noise[0], noise[1])]
    return clouds if image else [cloud.reshape(-1, 3) for cloud in clouds]


LINES_PLY = np.array([(20.0, 20.0), (180.0, 20.0), (180.0, 160.0), (20.0, 160.0)])


@pytest.mark.parametrize("image", [True, False], ids=["image", "list"])
def test_lines_farther_apart_than_a_pocket_needs_are_refused(image):
    _, reference = _lines(6.0, image=image)
    with pytest.raises(debulk.InputError, match=r"points at most 3\.5 mm apart"):
        debulk.Inspector(None, reference, LINES_PLY, mold_from_scanner=np.eye(4))
    scan, _ = _lines(6.0, image=image)
    _, dense = _lines(1.0, image=image)
    report = debulk.inspect(scan, dense, None, ply_outline=LINES_PLY, mold_from_scanner=np.eye(4))
    assert report.verdict is Verdict.INVALID
    assert "too coarse" in report.reason


@pytest.mark.parametrize("image", [True, False], ids=["image", "list"])
def test_lines_two_millimetres_apart_are_read(image):
    scan, reference = _lines(2.0, image=image)
    report = debulk.inspect(scan, reference, None, ply_outline=LINES_PLY, mold_from_scanner=np.eye(4))
    assert report.verdict is Verdict.CREASE, report.reason


@pytest.mark.parametrize("turned", [False, True], ids=["along columns", "along rows"])
def test_a_bump_between_lines_is_no_wrinkle(turned):
    clouds = _lines(0.25, image=True, along_mm=2.0, high_mm=3.3, radius_mm=7.0)
    scan, reference = (np.ascontiguousarray(np.swapaxes(cloud, 0, 1)) if turned else cloud for cloud in clouds)
    report = debulk.inspect(scan, reference, None, ply_outline=LINES_PLY, mold_from_scanner=np.eye(4))
    assert report.verdict is Verdict.CREASE, report.reason  # by its fibres: 1.6 mm of excess
    assert "wrinkles" not in {finding.check for finding in report.findings}


@pytest.mark.parametrize("high_mm", [300.0, -300.0])
def test_a_lattice_over_a_flat_mold_is_no_camera(high_mm):
    scan, reference = (cloud + np.array([0.0, 0.0, high_mm]) for cloud in _lines(0.8, image=True, along_mm=0.8))
    report = debulk.inspect(scan, reference, None, ply_outline=LINES_PLY, mold_from_scanner=np.eye(4))
    assert report.verdict is Verdict.CREASE, report.reason
