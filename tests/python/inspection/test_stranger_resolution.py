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
    report = _inspected(20, 4.5, 3.0)
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
