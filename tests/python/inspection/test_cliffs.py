"""A mold that ends at a cliff above a table: no pockets where the fitted reference would round the edge."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
from debulk import scenes
from debulk.grid import Grid
from debulk.inspection.cliffs import without_cliffs


@pytest.mark.parametrize("known_outline", [True, False], ids=["outline", "no outline"])
def test_what_stands_up_at_a_cliff_is_no_pocket(known_outline):
    layup = scenes.varied_layup(
        11, (640, 480), mold="cliff", pockets=["lobes"], severity="one", noise=[], holes_mm=[], clamp=False, borders=0
    )
    report = debulk.inspect(
        layup.scan,
        layup.reference,
        None,
        layup.ply_outline if known_outline else None,
        layup.fibre_angles_deg,
        layup.mold_from_scanner,
    )
    tops = np.array([p.centre_mm for p in (*layup.truth.pockets, *layup.truth.decoys)])
    highest = max(p.peak_mm for p in layup.truth.pockets)
    assert report.pockets
    for one in report.pockets:
        assert one.peak_mm < highest + 1
        assert np.linalg.norm(tops - one.outline_mm.mean(axis=0), axis=1).min() < 20


def test_only_what_lies_off_the_ply_at_the_foot_of_a_cliff_is_left_out():
    x = np.arange(200.0)
    level = np.where(x < 100, 40 - 0.5 * x, -60.0)  # a slope of a half, then 50 mm down
    heights = Grid(np.tile(level, (80, 1)).astype(np.float32), np.zeros(2), 1.0)
    kept = np.isfinite(without_cliffs(heights, None).values)
    assert kept[:, :100].all()
    assert not kept[:, 100:145].any()
    assert kept[:, 150:].all()
    ply = np.array([[20.0, -5], [120, -5], [120, 90], [20, 90]])
    assert np.isfinite(without_cliffs(heights, ply).values)[:, :120].all()

    steps = Grid(np.tile(np.round(level[:100], 0), (80, 1)).astype(np.float32), np.zeros(2), 1.0)
    assert without_cliffs(steps, None) is steps  # no cliff
