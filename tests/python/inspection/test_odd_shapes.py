"""Pockets that are no bells: their nets are laid from a point inside, and their excess is that of their section."""

from __future__ import annotations

import numpy as np
import pytest

import laid_ply
from debulk import pocket
from debulk.verdict import Verdict

# Of a section of 40 mm, 8 mm high, a square of a cosine: its length over its chord, by quadrature.
_S = np.linspace(-20.0, 20.0, 4001)
_EXCESS_MM = np.hypot(np.diff(_S), np.diff(8 * np.cos(np.pi * _S / 40) ** 2)).sum() - 40


def _along_an_arc(half_angle):
    def height(x, y):
        around, away = np.arctan2(y - 30, x - 50), np.hypot(x - 50, y - 30) - 60
        section = 8 * np.cos(np.pi * np.clip(away / 40, -0.5, 0.5)) ** 2
        ends = np.clip((half_angle - np.abs(around)) * 60 / 40, 0, 0.5)
        return section * np.sin(np.pi * ends) ** 2

    return height


@pytest.mark.parametrize("half_angle", [1.8, 10.0], ids=["crescent", "ring"])
def test_a_pocket_round_its_centroid_is_judged(half_angle):
    report = laid_ply.inspector().inspect(laid_ply.scan(_along_an_arc(half_angle)))
    (one,) = report.pockets
    assert one.verdict is Verdict.CREASE, one.reason
    # A fibre that runs straight across has this much; one that crosses a ring twice, or askew, has more.
    assert 0.85 * _EXCESS_MM < one.excess_length_mm < 2.4 * _EXCESS_MM
    if half_angle < np.pi:
        assert not pocket.inside(one.outline_mm, np.array([[50.0, 30.0]]))[0]


def _length_over_chord(shape, along):
    """Excess of the fibre along x at y = 30."""
    return np.hypot(np.diff(along), np.diff(shape(along, np.full_like(along, 30.0)))).sum() - np.ptp(along)


def test_pockets_that_merge_are_judged_as_one():
    """Each alone closes; the ply between them does not come down, and both excesses meet in one ridge."""
    left, right = laid_ply.bell(20, 30, 80, 4.5), laid_ply.bell(80, 30, 80, 4.5)

    def both(x, y):
        return left(x, y) + right(x, y)

    along = np.linspace(-100.0, 200.0, 20001)
    alone = laid_ply.inspector().inspect(laid_ply.scan(left))
    assert [p.verdict for p in alone.pockets] == [Verdict.CEASE]
    assert alone.pockets[0].excess.length_mm == pytest.approx(_length_over_chord(left, along), rel=0.1)
    report = laid_ply.inspector().inspect(laid_ply.scan(both))
    assert [p.verdict for p in report.pockets] == [Verdict.CREASE] * 2
    for one in report.pockets:
        assert one.excess.length_mm == pytest.approx(_length_over_chord(both, along), rel=0.1)
        assert "whose foot is the same" in one.reason


def test_a_small_bump_on_a_pockets_skirt_counts_with_the_pocket():
    """It is below the tolerances, but the fibre over both is as long as both make it."""

    def both(x, y):
        return np.maximum(laid_ply.bell(50, 30, 80, 4.5)(x, y), laid_ply.bell(92, 30, 24, 5)(x, y))

    (one,) = laid_ply.inspector().inspect(laid_ply.scan(both)).pockets
    assert one.excess.length_mm == pytest.approx(_length_over_chord(both, np.linspace(0.0, 110.0, 20001)), rel=0.2)
    assert one.verdict is Verdict.CREASE


@pytest.mark.parametrize(("high_mm", "wide_mm", "verdict"), [(8, 60, Verdict.CREASE), (3.5, 120, Verdict.CEASE)])
def test_a_pocket_from_edge_to_edge_is_judged_by_the_fibres_across(high_mm, wide_mm, verdict):
    def tunnel(x, y):
        return high_mm * np.cos(np.pi * np.clip((y - 30) / wide_mm, -0.5, 0.5)) ** 2

    (one,) = laid_ply.inspector().inspect(laid_ply.scan(tunnel)).pockets
    assert one.touches_ply_edge
    assert one.verdict is verdict, one.reason


def test_a_pocket_at_a_corner_is_let_go_by_both_edges():
    corners = laid_ply.layup().ply_outline
    x, y = corners[np.argmax(corners.sum(axis=1))]
    low, high = (
        laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(x, y, 80, high_mm))).pockets for high_mm in (4.5, 9)
    )
    assert low[0].touches_ply_edge and high[0].touches_ply_edge
    assert low[0].verdict is Verdict.CEASE, low[0].reason  # even if it is held
    assert high[0].edge_friction.slipping.verdict is Verdict.CEASE, high[0].reason
    assert high[0].verdict is Verdict.UNDECIDED, high[0].reason  # held, it keeps a ridge


def test_a_fibre_along_the_edge_is_held_though_its_net_may_slide():
    """A pocket cut by the ply's edge, whose fibres along the edge end on the mold: an excess of 2 mm does not pass."""
    corners = laid_ply.layup().ply_outline
    top = corners[np.argmin(np.abs(corners[:, 0]) + 1e3 * (corners[:, 1] < 0)), 1]
    for high_mm in (6, 7, 8):
        (one,) = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(0, top - 10, 70, high_mm))).pockets
        assert one.touches_ply_edge
        assert one.verdict in (Verdict.CREASE, Verdict.UNDECIDED), one.reason


def test_three_hundred_pockets_are_all_found_and_judged():
    """Bells of 36 mm, each 1.1 mm too long: what one is judged, all are."""
    corners = laid_ply.layup().ply_outline
    x, y = np.meshgrid(np.arange(-550, 560, 50.0), np.arange(-400, 410, 50.0))
    at = np.column_stack([x.ravel(), y.ravel()])
    at = at[pocket.inside(corners, at) & (pocket.distance_to_outline(corners, at) > 45)][:300]
    assert len(at) == 300

    def many(x, y):
        high = np.zeros_like(x)
        for x0, y0 in at:
            near = (np.abs(x - x0) < 18) & (np.abs(y - y0) < 18)
            high[near] = laid_ply.bell(x0, y0, 36, 4)(x[near], y[near])
        return high

    report = laid_ply.inspector().inspect(laid_ply.scan(many))
    assert len(report.pockets) == 300
    assert Verdict.CEASE not in {p.verdict for p in report.pockets}
    assert sum(p.verdict is Verdict.CREASE for p in report.pockets) >= 290
    # The others lie on drop-outs of the reference.
    assert all("measured" in p.reason for p in report.pockets if p.verdict is Verdict.INVALID)
    found = np.array([p.outline_mm.mean(axis=0) for p in report.pockets])
    assert np.linalg.norm(found[:, None] - at[None], axis=2).min(axis=1).max() < 2.0
