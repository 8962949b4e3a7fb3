"""The ridges on the map: every line that the report gives, one band, and words that say how sure it is."""

import dataclasses

import numpy as np
import pytest

from debulk.page.map_ridges import ridges
from debulk.page.report import page

LIMIT = 0.6  # mm, of a ridge


def points(path):
    return [np.array([p.split() for p in piece.split("L")], dtype=float) for piece in path.split("M")[1:]]


def test_both_lines_of_a_ridge_are_drawn_north_up(report):
    for pocket, drawn in zip([p for p in report.pockets if p.ridges], ridges(report.pockets, LIMIT), strict=True):
        lines = points(drawn.path)
        assert len(lines) == sum(len(one.lines_mm) for one in pocket.ridges)
        for line, given in zip(lines, pocket.ridges[0].lines_mm, strict=True):
            np.testing.assert_allclose(line * [1, -1], given[:, :2], atol=0.051)
        assert drawn.band_mm == 2 * pocket.ridges[0].place_spread_mm
        assert f"±{pocket.ridges[0].place_spread_mm:.1f} mm" in drawn.title
        assert ("either line" in drawn.title) == (pocket.ridges[0].mirrored_mm is not None)
        assert drawn.low == (pocket.deciding_ridge.most_mm <= LIMIT)


def test_the_band_is_clipped_to_where_the_ply_stands_off(report):
    pocket = next(p for p in report.pockets if p.ridges)
    (drawn,) = ridges([pocket], LIMIT)
    (foot,) = points(drawn.foot.removesuffix("Z"))
    assert len(foot) >= 40
    np.testing.assert_allclose(foot[0] * [1, -1], pocket.foot_outline_mm[0], atol=0.051)
    (unknown,) = ridges([dataclasses.replace(pocket, foot_outline_mm=None)], LIMIT)
    assert unknown.foot == ""


@pytest.mark.parametrize("mirrored", [True, False])
def test_a_pockets_card_has_the_figures_of_acceptance(report, mirrored):
    pocket = next(p for p in report.pockets if p.ridges and (p.ridges[0].mirrored_deg is not None) == mirrored)
    one = pocket.ridges[0]
    card = page(report).split(f'id="pocket-{pocket.id}"')[1].split("</article>")[0]
    direction = f"{one.direction_deg:.0f}°" + (f" or {one.mirrored_deg:.0f}°" if mirrored else "")
    for value in (direction, f"{one.height_over_thickness:.1f}", f"{one.slope_deg:.0f}°", f"{one.elastic_mm:.2f}"):
        assert f"<dd>{value}" in card


def test_a_pocket_without_ridges_draws_none(report):
    assert ridges([p for p in report.pockets if not p.ridges], LIMIT) == []
