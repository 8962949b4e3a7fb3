"""A mold that ends at a cliff above a table: no pockets where the fitted reference would round the edge."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
from debulk import scenes


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
