"""Where ridges run and how they look: closed forms, what must not matter, and whole inspections."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from debulk import Inspector, Recipe, net, scenes, section, surface
from debulk.inspection.minima import ridges

GRID_MM = 1.0
REACH_MM = 70.0


def turned(x, y, deg):
    """Coordinates along and across a direction."""
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    return c * x + s * y, c * y - s * x


def hill(long_mm, wide_mm, high_mm, deg, mold=None):
    """Net of a pocket with an elliptic foot on a mold, its long axis at `deg`, and the mold."""
    axis = np.arange(-REACH_MM, REACH_MM + 1, GRID_MM)
    x, y = np.meshgrid(axis, axis)
    floor = np.zeros_like(x) if mold is None else mold(x, y)
    u, v = turned(x, y, deg)
    air = high_mm * np.cos(np.pi / 2 * np.minimum(np.hypot(u / long_mm, v / wide_mm), 1)) ** 2
    turn = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    rim = np.stack(turned(long_mm * np.cos(turn), wide_mm * np.sin(turn), -deg), axis=1)
    ply, reference = (surface.Reference(z, (-REACH_MM, -REACH_MM), GRID_MM) for z in (floor + air, floor))
    return ply, reference, rim


def laid(long_mm, wide_mm, high_mm, deg, fibre_deg, mold=None, centre_mm=(0.0, 0.0)):
    ply, reference, rim = hill(long_mm, wide_mm, high_mm, deg, mold)
    made = net.fibre_net(
        ply, reference, centre_mm, (fibre_deg, fibre_deg + 90), outline_mm=rim, mold_tol_mm=0.1, node_target=100
    )
    return made, reference


def pocket(made, reference, excess_mm=0.9):
    """What the inspector knows of the pocket before it is solved."""
    height_mm = max(0.0, excess_mm / 2 + (2 - math.pi / 2) * 0.3) if excess_mm > 0.25 else 0.0
    known = SimpleNamespace(length_mm=excess_mm, height_mm=height_mm)
    return SimpleNamespace(net=made, reference=reference, excess=known, recipe=Recipe())


def of_excess(one):
    return ridges.of_excess(one, one.excess, FOOT)


FOOT = SimpleNamespace(area_mm2=math.pi * 100.0, outline_mm=50.0 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]))


def off_deg(a, b):
    return abs((a - b + 90) % 180 - 90)


@pytest.mark.parametrize(("long_mm", "wide_mm"), [(60, 18), (50, 25), (40, 32)])
@pytest.mark.parametrize("deg", [0.0, 37.0, 121.0])
def test_an_ellipse_along_its_fibres_folds_at_the_angle_of_its_axes(long_mm, wide_mm, deg):
    made, reference = laid(long_mm, wide_mm, 4.0, deg, deg)
    (one,) = of_excess(pocket(made, reference))
    # The same rise over another reach r has 1 / r of the length to spare.
    slant = math.degrees(math.atan2(wide_mm, long_mm))
    assert sorted([one.direction_deg, one.mirrored_deg]) == pytest.approx(
        sorted([(deg + slant) % 180, (deg - slant) % 180]), abs=1.0
    )
    assert one.fibre_angle_deg == pytest.approx(slant, abs=1.0)
    np.testing.assert_allclose(one.middle_mm, 0.0, atol=0.5)


def test_a_round_pocket_folds_along_either_diagonal_of_its_fibres():
    made, reference = laid(30, 30, 5.0, 0, 20)
    (one,) = of_excess(pocket(made, reference))
    assert {round(one.direction_deg), round(one.mirrored_deg)} == {65, 155}
    assert one.fibre_angle_deg == pytest.approx(45, abs=1)
    assert np.linalg.norm(one.mirrored_mm, axis=1).max() == pytest.approx(
        np.linalg.norm(one.polyline_mm, axis=1).max(), rel=0.02
    )


@pytest.mark.parametrize(("deg", "expected"), [(25, 1), (65, 1), (-25, -1), (155, -1)])
def test_a_pocket_slanted_to_its_fibres_folds_along_its_longer_diagonal(deg, expected):
    made, reference = laid(45, 20, 4.0, deg, 0)
    (one,) = of_excess(pocket(made, reference))
    assert one.mirrored_mm is None
    assert (one.direction_deg < 90) == (expected > 0)


@pytest.mark.parametrize("excess_mm", [0.02, 0.2])
@pytest.mark.parametrize("deg", [20, 45, 60])
def test_a_fold_takes_the_cosine_of_its_excess_from_a_slanted_fibre(excess_mm, deg):
    """The law that directs the crest, on the section model's own fold."""
    x, z = section.fold(excess_mm, 24.0, segments=600).points_mm.T
    steps = np.hypot(np.diff(x) / math.cos(math.radians(deg)), np.diff(z))
    taken = steps.sum() - (x[-1] - x[0]) / math.cos(math.radians(deg))
    assert taken == pytest.approx(excess_mm * math.cos(math.radians(deg)), rel=0.03)


@pytest.mark.parametrize("mold", [lambda x, y: -(x**2) / 500, lambda x, y: -(x**2 + y**2) / 700, lambda x, y: 0.2 * x])
def test_turning_everything_turns_the_ridge(mold):
    found = []
    for turn in (0.0, 33.0, 90.0):
        made, reference = laid(40, 22, 4.0, 30 + turn, turn, lambda x, y, t=turn: mold(*turned(x, y, t)))
        (one,) = of_excess(pocket(made, reference))
        found.append((one, turn))
        np.testing.assert_allclose(one.polyline_mm[:, 2], reference.height(one.polyline_mm[:, :2]), atol=1e-12)
    first = found[0][0]
    for one, turn in found[1:]:
        assert off_deg(one.direction_deg - turn, first.direction_deg) < 0.6
        assert one.fibre_angle_deg == pytest.approx(first.fibre_angle_deg, abs=0.6)
        assert one.length_mm == pytest.approx(first.length_mm, rel=0.01)


def test_the_sections_figures_are_those_of_the_fold():
    made, reference = laid(30, 30, 5.0, 0, 0)
    (one,) = of_excess(pocket(made, reference, 1.3))
    fold = section.fold(1.3, 30.0, segments=400)
    along, up = np.diff(fold.points_mm, axis=0).T
    assert one.elastic_mm == pytest.approx(fold.height_mm, rel=5e-3)
    assert one.half_width_mm == pytest.approx(fold.foot_width_mm / 2, rel=1.5e-2)
    assert one.slope_deg == pytest.approx(np.degrees(np.arctan2(up, along).max()), rel=1e-2)
    assert one.height_over_half_width == pytest.approx(2 * fold.height_mm / fold.foot_width_mm, rel=2e-2)
    assert one.height_mm == 1.3 / 2 + (2 - math.pi / 2) * 0.3
    assert one.height_over_thickness == pytest.approx(one.height_mm / 0.3)
    assert one.place_spread_mm == pytest.approx(0.21 * 10.0)


def test_without_a_ridge_there_is_no_geometry():
    made, reference = laid(30, 30, 5.0, 0, 0)
    assert of_excess(pocket(made, reference, 0.1)) == ()
    assert of_excess(pocket(*laid(30, 30, 0.0, 0, 0), 0.1)) == ()


@pytest.fixture(scope="module")
def reports():
    layup = scenes.layup(seed=112, pixels=(640, 480))
    recipe = Recipe(segmentation={"area_tol_mm2": 1000.0})
    made = []
    for when in ("always", "needed"):
        chosen = recipe.model_copy(update={"solve": {"when": when}})
        inspector = Inspector(chosen, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
        made.append(inspector.inspect(layup.scan))
    return made


def test_the_ridge_of_the_excess_needs_no_minimum(reports):
    """It needs the net, and `settle` lays those that no verdict needed."""
    always, needed = reports
    assert any(p.unsolved for p in needed.pockets)
    for p, q in zip(always.pockets, needed.settle().pockets, strict=True):
        if p.excess is not None:
            assert len(p.ridges) == (p.excess.height_mm > 0)
            for a, b in zip(p.ridges, q.ridges, strict=True):
                assert a.height_mm == p.excess.height_mm
                assert a.elastic_mm == p.excess.elastic_mm == p.elastic_mm
                assert a.polyline_mm.tobytes() == b.polyline_mm.tobytes()


def test_ridges_lie_in_their_pockets(reports):
    from debulk.pocket import inside

    seen = [p for p in reports[0].pockets if p.ridges]
    assert len(seen) >= 4
    for p in seen:
        assert inside(p.foot_outline_mm, np.array([p.ridges[0].middle_mm[:2]])).all()
        assert 0 < p.ridges[0].length_mm < 2.5 * np.ptp(p.foot_outline_mm, axis=0).max()
        assert 0 < p.ridges[0].place_spread_mm < np.ptp(p.foot_outline_mm, axis=0).max()
