"""An outline that is not the ply's is refused, or held against the scan and named."""

from __future__ import annotations

import functools
import re

import cv2
import numpy as np
import pytest

import stranger_scenes as stranger
from debulk import Grid, InputError, Inspector, Recipe, Verdict, pocket, scenes
from debulk.inspection.evidence.outline import Outline, edge_seen
from debulk.inspection.place import ply_edge
from debulk.inspection.reference.prepared import Prepared
from debulk.surface import Reference
from lab.varied import given_right, varied_layup

PIXELS = (800, 600)


@functools.cache
def given(family):
    if family == "first":
        return given_right(scenes.layup(921, PIXELS))
    return given_right(varied_layup(923, PIXELS, borders=0, clamp=False, holes_mm=0))


@functools.cache
def prepared(family):
    g = given(family)
    return Inspector(None, g.reference, mold_from_scanner=g.mold_from_scanner).prepared


def inspect(family, outline):
    g = given(family)
    return Inspector(None, prepared(family), outline, g.fibre_angles_deg, g.mold_from_scanner).inspect(g.scan)


def edges_mm(outline, heights):
    return ply_edge.edges_mm(outline, outline.strips(heights), 0.3, 2.0)


def misfit(outline, heights):
    return ply_edge.misfit(outline, outline.strips(heights), 0.3, 2.0, 0.2)


BOTH = pytest.mark.parametrize("family", ["first", "varied"])


@BOTH
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda o: o / 1000, "is it in metres"),
        (lambda o: o / 25.4 / 2, "in metres or inches|lies beside"),
        (lambda o: o + 1e9, "within 100 m of the mold frame's origin"),
        (lambda o: o * [1, 0] + [0, 1e9], "within 100 m"),
        (lambda o: o + np.array([3000, 0]), "lies beside it: the outline has x"),
        (lambda o: np.concatenate([o[: len(o) // 2], o[: len(o) // 2 - 1 : -1]]), "its sides .* and .* cross near"),
        (lambda o: o[:2], "at least 3 corners"),
        (lambda o: np.where(np.arange(len(o))[:, None] == 3, np.nan, o), "finite"),
        (lambda o: np.ma.masked_less(o, 0), "masked array"),
    ],
    ids=["metres", "half inches", "1e9", "y 1e9", "beside", "crossing", "two corners", "NaN", "masked"],
)
def test_an_impossible_outline_is_refused(family, change, reason):
    with pytest.raises(InputError, match=reason):
        inspect(family, change(given(family).ply_outline))


@BOTH
@pytest.mark.parametrize("factor", [1.5, 3.0])
def test_an_outline_that_is_too_large_for_the_reference_is_named_and_no_steep_mold(family, factor):
    outline = given(family).ply_outline
    middle = outline.mean(axis=0)
    report = inspect(family, middle + factor * (outline - middle))
    assert report.verdict is Verdict.INVALID
    assert report.reason.startswith("the outline reaches beyond the reference (the outline has x ")
    first = report.findings[0]
    assert first.check == "coverage" and first.measured < first.limit
    assert first.remedy.startswith("check its size and place") and first.remedy in report.reason


@BOTH
@pytest.mark.parametrize("size", [15, 40, 120])
def test_a_shifted_outline_is_named_with_its_place_and_way(family, size):
    outline = given(family).ply_outline
    report = inspect(family, outline + size * np.array([0.8, 0.6]))
    assert report.verdict is Verdict.INVALID
    if size <= 40:
        said = re.search(r"edge is elsewhere, round \(-?\d+, -?\d+\) mm (\d+) mm (inside|outside) it", report.reason)
        if said is None:  # on a ply with slopes or near the image's border something else may have been said first
            assert "between the pockets" in report.reason or "was seen" in report.reason
        else:
            assert 6 <= int(said[1]) <= size + 8


def test_an_outline_of_another_shape_does_not_pass():
    outline = given("first").ply_outline
    middle = outline.mean(axis=0)
    for other in (middle + 0.8 * (outline - middle), middle + (outline - middle)[:, ::-1] * 0.7):
        report = inspect("first", other)
        assert report.verdict is Verdict.INVALID
        assert "the outline does not fit the scan" in report.reason


@pytest.mark.parametrize("sense", [1, -1], ids=["counter-clockwise", "clockwise"])
def test_the_edge_is_found_where_it_is(sense):
    """A round ply of 0.3 mm on a plane, seen exactly."""
    x, y = np.meshgrid(np.arange(-200.0, 201.0, 2.0), np.arange(-200.0, 201.0, 2.0))
    heights = Grid(np.where(np.hypot(x, y) < 120, 0.3, 0.0), np.array([-200.0, -200.0]), 2.0)
    turn = sense * np.linspace(0, 2 * np.pi, 90, endpoint=False)
    for radius in (100, 108, 132, 140):
        circle = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        assert edges_mm(Outline(circle), heights) == pytest.approx(120 - radius, abs=4.5)
        found = misfit(Outline(circle), heights)
        assert found.measured == 1
        assert re.search(f"along 100 % .* {'outside' if radius < 120 else 'inside'} it; check that", found.reason)
    circle = 120 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    found = edges_mm(Outline(circle), heights)
    assert len(found) >= 15
    assert np.abs(found).max() <= 4
    assert misfit(Outline(circle), heights) is None


def rectangle(length, width):
    return np.array([[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])


@pytest.mark.parametrize("cut", [0, 8, 30, 300])
def test_a_short_side_that_is_cut_off_is_seen_in_a_long_outline(cut):
    """Of a ply 700 mm long and 200 wide, seen exactly; less than a fifth of the outline lies elsewhere."""
    x, y = np.meshgrid(np.arange(-80.0, 781.0, 2.0), np.arange(-80.0, 281.0, 2.0))
    on_ply = (x > 0) & (x < 700) & (y > 0) & (y < 200)
    heights = Grid(np.where(on_ply, 0.3, 0.0), np.array([-80.0, -80.0]), 2.0)
    outline = Outline(rectangle(700.0 - cut, 200.0))
    assert np.mean(np.abs(edges_mm(outline, heights)) > 6) < (0.2 if cut else 1e-9)
    assert (misfit(outline, heights) is not None) == (cut >= 30)


def from_y(corners, y):
    """The part of a polygon with no smaller y."""
    kept = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if a[1] >= y:
            kept.append(a)
        if (a[1] - y) * (b[1] - y) < 0:
            kept.append(a + (b - a) * (y - a[1]) / (b[1] - a[1]))
    return np.array(kept)


def test_a_narrow_bump_just_outside_an_outline_that_is_short_does_not_pass():
    """It stands on the ply's edge, 11 mm wide: the map lowers it, and the raw scan was searched within the outline."""
    points = [stranger.cloud(stranger.flat, (200, 160), 0.8, 0, 0.02)]
    top = stranger.laid(stranger.flat, lambda x, y: stranger.bump(9, 2.8)(x - 58, y), (120, 100))
    points.append(stranger.cloud(top, (200, 160), 0.8, 1, 0.02))
    inspector = Inspector(None, points[0], stranger.outline(110, 100), mold_from_scanner=np.eye(4))
    assert inspector.inspect(points[1]).verdict > Verdict.CEASE


def test_an_outline_that_leaves_out_a_creasing_side_does_not_pass():
    """It was CEASE with all of it seen: the edge lies elsewhere along 19 % of this outline, and a fifth was allowed."""
    layup = varied_layup(70028, (1024, 768), severity="any", holes_mm=0, clamp=False, pockets=1)
    g = given_right(layup)
    (creasing,) = (p.outline_mm for p in layup.truth.pockets if p.ridge_mm > 0.7)
    short = from_y(g.ply_outline, creasing[:, 1].max() + 12)
    report = Inspector(Recipe(**g.recipe), g.reference, short, g.fibre_angles_deg, g.mold_from_scanner).inspect(g.scan)
    assert report.verdict is Verdict.INVALID
    assert "the outline does not fit the scan" in report.reason


def beside(raised, outline):
    """What lies outside an outline on a plane with a ply of 0.3 mm, 300 by 200 mm, and this height above the plane."""
    x, y = np.meshgrid(np.arange(-80.0, 381.0, 2.0), np.arange(-80.0, 281.0, 2.0))
    ply = (x > 0) & (x < 300) & (y > 0) & (y < 200)
    edge = Outline(outline)
    return ply_edge.left_out(edge, edge.strips(Grid(raised(x, y, ply), np.array([-80.0, -80.0]), 2.0)), 0.3, 0.0)


def flat(x, y, ply):
    return np.where(ply, 0.3, 0.0)


def bell(x0, y0, radius, high):
    def raised(x, y, ply):
        r = np.clip(np.hypot(x - x0, y - y0) / radius, 0, 1)
        return np.where(ply, 0.3 + high * np.cos(np.pi * r / 2) ** 2, 0.0)

    return raised


def longer(raised, outline, missed=None):
    x, y = np.meshgrid(np.arange(-80.0, 381.0, 1.0), np.arange(-80.0, 281.0, 1.0))
    ply = (x > 0) & (x < 300) & (y > 0) & (y < 200)
    heights = Grid(raised(x, y, ply), np.array([-80.0, -80.0]), 1.0)
    edge = Outline(outline)
    strips = edge.missed(missed or (lambda xy: np.zeros(len(xy))), 0.15)
    return ply_edge.longer_outside(edge, heights, strips, 0.3, 0.84)


@pytest.mark.parametrize("radius", [14, 20])
def test_the_longest_fibre_may_lie_just_outside_an_outline_that_is_short(radius):
    """The bell's middle is on the ply's edge, so that a fibre along the edge has the bell's whole excess of 1.2 mm."""
    whole = np.array([[0, 0], [300, 0], [300, 200], [0, 200]], dtype=float)
    short, high = np.minimum(whole, [295, 200]), np.sqrt(1.2 * 8 * radius) / np.pi
    found = longer(bell(300, 100, radius, high), short)
    assert found is not None and found.measured == pytest.approx(1.05, abs=0.15)
    assert found.place_mm == pytest.approx((295, 100), abs=6)
    assert longer(bell(300, 100, radius, high), whole) is None and longer(flat, short) is None
    assert longer(bell(285, 100, radius, high), short) is None  # what is longest inside is judged there


def test_heights_beside_an_edge_of_the_mold_or_a_hole_are_no_fibre():
    whole = np.array([[0, 0], [300, 0], [300, 200], [0, 200]], dtype=float)

    def ragged(x, y, ply):
        at_edge = (np.abs(x - 303) < 4) & (np.abs(y - 100) < 12)
        return np.where(at_edge, 1.0 + 1.5 * (y % 8 < 4), flat(x, y, ply))

    def with_holes(x, y, ply):
        standing = np.where((np.abs(y - 100) > 9) | (y % 8 < 4), np.nan, 2.0 + 0.01 * y)
        return np.where((np.abs(x - 303) < 4) & (np.abs(y - 100) < 16), standing, flat(x, y, ply))

    assert longer(ragged, whole) is not None
    assert longer(ragged, whole, lambda xy: np.where(np.hypot(*(xy - [303, 100]).T) < 12, 0.6, 0.0)) is None
    assert longer(with_holes, whole) is None


@pytest.mark.parametrize("offset_mm", [-0.05, 0.0, 0.05])
@pytest.mark.parametrize("share", [1.05, 0.95, 0.85, 0.7])
def test_heights_that_come_out_too_small_show_at_the_edges_step_and_an_offset_does_not(share, offset_mm):
    x, y = np.meshgrid(np.arange(-80.0, 381.0, 2.0), np.arange(-80.0, 281.0, 2.0))
    ply = (x > 0) & (x < 300) & (y > 0) & (y < 200)
    noise = np.random.default_rng(0).normal(0, 0.03, x.shape)
    heights = share * bell(300, 100, 25, 3.0)(x, y, ply) + offset_mm + noise
    shown = Grid(heights, np.array([-80.0, -80.0]), 2.0)
    seen = edge_seen(shown, lambda xy: np.zeros(len(xy)), 0.3)
    for edge in (Outline(np.array([[0, 0], [300, 0], [300, 200], [0, 200]], dtype=float)), seen):
        found = ply_edge.low_step(edge, edge.strips(shown), 0.3)
        assert (found is None) == (share > 0.9)
        if found is not None:
            assert found.at_best is Verdict.INVALID and found.measured == pytest.approx(0.3 * share, abs=0.01)


def test_without_ply_on_the_bare_mold_no_edge_is_seen():
    shown = Grid(np.random.default_rng(0).normal(0, 0.03, (100, 100)), np.zeros(2), 2.0)
    assert edge_seen(shown, lambda xy: np.zeros(len(xy)), 0.3) is None


@pytest.mark.parametrize(
    "raised",
    [flat, bell(150, 100, 40, 4.0), bell(300, 100, 25, 3.0), bell(150, 0, 12, 2.0)],
    ids=["flat", "in the middle", "across a side", "narrow"],
)
@pytest.mark.parametrize("off", [-3.0, 0.0, 3.0])
def test_nothing_lies_outside_a_right_outline(raised, off):
    outline = np.array([[-off, -off], [300 + off, -off], [300 + off, 200 + off], [-off, 200 + off]])
    assert beside(raised, outline) is None
    assert beside(raised, outline[::-1]) is None


HOLE = 12 * np.stack([-np.sin(turn := np.linspace(0.02, 2 * np.pi - 0.02, 60)), -np.cos(turn)], axis=1) + [150, 100]
LEFT_OUT = {
    "strip of 100 mm, 15 mm short": (flat, rectangle(285, 200)),
    "strip of 100 mm, 160 mm short": (flat, rectangle(140, 100)),
    "window of 60 mm": (flat, rectangle(60, 60) + 100),
    "shifted": (flat, rectangle(300, 200) - [14, 0]),
    "corner": (flat, np.array([[0.0, 0.0], [300, 0], [300, 160], [260, 200], [0, 200]])),
    "notch": (flat, np.array([[0.0, 0], [300, 0], [300, 70], [260, 70], [260, 130], [300, 130], [300, 200], [0, 200]])),
    "hole over a pocket": (bell(150, 100, 11, 2.5), np.array([[0.0, 0], [149.8, 0], *HOLE, [150.2, 0], [300, 0],
                                                              [300, 200], [0, 200]])),
    "pocket across it, 10 mm short": (bell(295, 100, 20, 3.0), rectangle(290, 200)),
}  # fmt: skip


@pytest.mark.parametrize("way", LEFT_OUT)
def test_ply_and_pockets_outside_the_outline_are_found(way):
    raised, outline = LEFT_OUT[way]
    found = beside(raised, outline)
    assert found is not None
    assert found.measured > 40
    assert not pocket.inside(outline, np.array([found.place_mm]))[0]


def test_objects_beside_the_ply_and_stray_points_are_no_ply():
    def with_clamp(x, y, ply):
        return np.where(np.hypot(x - 320, y - 100) < 15, 40.0, flat(x, y, ply))

    def with_stray(x, y, ply):
        return np.where(np.random.default_rng(1).random(x.shape) < 0.01, 5.0, flat(x, y, ply))

    def with_tool(x, y, ply):  # 30 mm beside the ply
        return np.where(x > 330, 1.0, flat(x, y, ply))

    for raised in (with_clamp, with_stray, with_tool):
        assert beside(raised, rectangle(300, 200)) is None


def block(left, right, long, high):
    """Something on the flat ply or beside it: a block round y = 100 mm that stands so high above the reference."""
    return lambda x, y, ply: np.where((x > left) & (x < right) & (np.abs(y - 100) < long / 2), high, flat(x, y, ply))


@pytest.mark.parametrize(
    ("raised", "seen"),
    [
        (block(299, 317, 33, 0.3), True),  # a tab of the ply, more than 2 cm2 beyond 8 mm
        (block(299, 317, 21, 0.3), False),
        (block(309, 330, 60, 0.3), False),  # as high as a ply, but bare mold lies between the two
        (block(304, 317, 21, 0.8), False),  # a bump beside the outline, smaller than what counts as ply
        (block(280, 309, 21, 0.8), True),  # a lower one that goes on inside it
    ],
    ids=["tab", "small tab", "off the ply", "bump", "bump that crosses"],
)
def test_what_counts_as_a_part_of_the_ply(raised, seen):
    found = beside(raised, rectangle(300, 200))
    assert (found is not None) is seen
    if found is not None:
        assert 300 < found.place_mm[0] < 320
        assert found.place_mm[1] == pytest.approx(100, abs=6)


def test_what_rises_above_the_cut_hides_the_edge():
    x, y = np.meshgrid(np.arange(-80.0, 381.0, 2.0), np.arange(-80.0, 281.0, 2.0))
    high = block(270, 340, 90, 4.0)(x, y, (x > 0) & (x < 300) & (y > 0) & (y < 200))
    found = edges_mm(Outline(rectangle(300, 200)), Grid(high, np.array([-80.0, -80.0]), 2.0))
    assert 1 <= np.count_nonzero(np.isnan(found)) <= 4
    assert np.nanmax(np.abs(found)) <= 4


def test_a_part_of_the_ply_that_the_outline_leaves_out_does_not_pass():
    """A corner of 60 mm, 5 % of the outline: nothing was said before, for there is no edge where the ply goes on."""
    outline = given("varied").ply_outline
    corner = outline[np.argmax(outline @ [1.0, 1.0])]
    short = cut_off(outline, corner @ [0.7071, 0.7071] - 40.0)
    report = inspect("varied", short)
    assert report.verdict is Verdict.INVALID
    assert re.search("the outline leaves out a part of the ply|the outline does not fit the scan", report.reason)


def cut_off(corners, most):
    """The part of a polygon whose distance along the diagonal is no larger."""
    turn = np.array([[0.7071, -0.7071], [-0.7071, -0.7071]])
    return from_y(corners @ turn.T, -most) @ np.linalg.inv(turn).T


@pytest.mark.parametrize(
    ("twice", "reason"),
    [
        (lambda o: np.concatenate([o, o]), "goes round the ply once, but its side 5"),
        (lambda o: np.concatenate([o, o[:1], o[::-1]]), "go there and back"),
    ],
    ids=["in a row", "and back"],
)
def test_an_outline_given_twice_is_refused_by_name(twice, reason):
    with pytest.raises(InputError, match=reason):
        Inspector(None, np.zeros((4, 3)), twice(rectangle(300, 200)))


def test_a_far_corner_does_not_crash_the_core():
    grid = Grid(np.zeros((20, 30), dtype=np.float32), np.zeros(2), 1.0)
    for far in (1e5, 1e9, 1e12, 1e300):
        outline = np.array([[5.0, 5.0], [far, 5.0], [far, far], [5.0, far]])
        inside = pocket.inside_outline(outline, grid)
        assert inside[6:, 6:].all()
        assert not inside[:5].any()
        assert not pocket.inside_outline(-outline, grid).any()


@pytest.mark.parametrize(("short_mm", "spread_mm", "seen"), [(0, 0, False), (0, 3, False), (8, 0, True), (8, 1, True)])
def test_a_pocket_on_the_outline_goes_on_outside_it_or_is_only_spread(short_mm, spread_mm, seen):
    """A pocket 5 mm high ends with the ply; a scan that spreads its edge shows a third of that 3 mm outside."""
    x, y = np.meshgrid(np.arange(-40.0, 341.0), np.arange(-40.0, 241.0))
    ply = (x > 0) & (x < 300) & (y > 0) & (y < 200)
    pocket_mm = 5 * np.clip(1 - ((x - 296) ** 2 + (y - 100) ** 2) / 900, 0, None)
    heights = np.where(ply, 0.3 + pocket_mm, 0.0)
    if spread_mm:
        heights = cv2.GaussianBlur(heights, (0, 0), spread_mm)
    edge = Outline(rectangle(300 - short_mm, 200))
    found = ply_edge.left_out(edge, edge.strips(Grid(heights, np.array([-40.0, -40.0]), 1.0)), 0.3, 0.0, 1.0)
    assert (found is not None) is seen


def test_a_step_of_the_mold_that_the_smooth_surface_cuts_off_is_no_ply_beside_the_outline():
    """Beside the outline the mold has a ridge 0.8 mm high that its surface does not follow; the scan shows it, too."""
    outline = Outline(np.array([(0.0, 0.0), (200.0, 0.0), (200.0, 160.0), (0.0, 160.0)]))
    x, y = np.meshgrid(np.arange(-60.0, 261.0, 2.0), np.arange(-60.0, 221.0, 2.0))
    cut_off = np.where((x > 200) & (x < 216), 0.8, 0.0)
    surface = Reference(np.zeros((5, 5)), (-80.0, -80.0), 100.0)
    mold = Prepared(surface, Grid(cut_off, np.array([-60.0, -60.0]), 2.0))
    missed = outline.missed(mold.missed_mm, 0.15)
    ply = (x > 0) & (x < 200) & (y > 0) & (y < 160)
    strips = outline.strips(Grid(cut_off + 0.3 * ply, np.array([-60.0, -60.0]), 2.0))
    assert ply_edge.left_out(outline, strips, 0.3, 0.0) is not None
    assert ply_edge.left_out(outline, strips - missed, 0.3, 0.0) is None
