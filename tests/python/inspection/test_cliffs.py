"""A mold that ends at a cliff above a table: no pockets where the fitted reference would round the edge."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
from debulk import Verdict, scenes


@pytest.fixture(scope="module")
def layup():
    return scenes.varied_layup(
        11, (640, 480), mold="cliff", pockets=["lobes"], severity="one", noise=[], holes_mm=[], clamp=False, borders=0
    )


def inspected(layup, outline):
    return debulk.inspect(layup.scan, layup.reference, None, outline, layup.fibre_angles_deg, layup.mold_from_scanner)


def is_true(layup, pocket):
    tops = np.array([p.centre_mm for p in (*layup.truth.pockets, *layup.truth.decoys)])
    return np.linalg.norm(tops - pocket.outline_mm.mean(axis=0), axis=1).min() < 20


def test_what_stands_up_at_a_cliff_is_no_pocket(layup):
    report = inspected(layup, layup.ply_outline)
    highest = max(p.peak_mm for p in layup.truth.pockets)
    assert report.pockets
    for one in report.pockets:
        assert one.peak_mm < highest + 1
        assert is_true(layup, one)


def test_without_an_outline_what_stands_in_the_cliffs_shadow_is_not_judged(layup):
    report = inspected(layup, None)
    assert report.verdict is Verdict.INVALID
    assert any(is_true(layup, one) for one in report.pockets)
    for one in report.pockets:
        assert is_true(layup, one) or one.verdict is Verdict.INVALID
