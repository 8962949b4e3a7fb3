"""Scans out of place, in the wrong unit or of the wrong thing never pass, and the reason says what is wrong."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest

import laid_ply
from debulk import InputError, Inspector, Recipe, Report, Verdict, pocket, scenes, surface
from debulk.inspection.evidence.ply_zones import Blocks
from debulk.inspection.place import level
from debulk.inspection.reference import frame
from lab.varied import given_right, varied_layup
from lab.varied.given import moved, shift, turn

PIXELS = (800, 600)
SEEDS = {"first": 911, "varied": 917}


@functools.cache
def given(family):
    if family == "first":
        return given_right(scenes.layup(SEEDS[family], PIXELS))
    return given_right(varied_layup(SEEDS[family], PIXELS, borders=0, clamp=False, holes_mm=0))


@functools.cache
def prepared(family):
    g = given(family)
    return Inspector(None, g.reference, mold_from_scanner=g.mold_from_scanner).prepared


@functools.cache
def inspector(family, **settings):
    g = given(family)
    return Inspector(Recipe(**settings), prepared(family), g.ply_outline, g.fibre_angles_deg, g.mold_from_scanner)


BOTH = pytest.mark.parametrize("family", list(SEEDS))


def in_mold(family, motion):
    """The scan moved by a motion of the mold's frame."""
    g = given(family)
    return moved(g.scan, g.motion_of_scanner(motion)).astype(np.float32)


def bent(family, rise):
    """The scan raised along the rays by a function of mold x and y, each from -1 to 1 over the ply."""
    g = given(family)
    low, high = g.ply_outline.min(axis=0), g.ply_outline.max(axis=0)
    u, v = np.moveaxis(2 * (g.in_mold(g.scan)[..., :2] - low) / (high - low) - 1, -1, 0)
    fall = g.scan.astype(np.float64) @ g.mold_from_scanner[2, :3]
    return (g.scan * (1 + rise(u, v) / fall)[..., None]).astype(np.float32)


def tilted(family, degrees):
    middle = np.append(given(family).ply_outline.mean(axis=0), 0.0)
    return in_mold(family, turn((1.0, 0.4, 0.0), degrees, middle))


def empty(family):
    """Another scan of the bare mold: the reference with noise of its own, along the rays."""
    g = given(family)
    noise = np.random.default_rng(5).normal(0, 0.05, g.reference.shape[:2])
    return (g.reference * (1 + noise / np.linalg.norm(g.reference, axis=-1))[..., None]).astype(np.float32)


OUT_OF_PLACE = {
    "1 m too high": (lambda f: in_mold(f, shift(z=1000)), "1000.* too high"),
    "1 m too low": (lambda f: in_mold(f, shift(z=-1000)), "too low everywhere"),
    "20 mm too low": (lambda f: in_mold(f, shift(z=-20)), "(20.0|19.9).* mm too low everywhere"),
    "2.5 mm too low": (lambda f: in_mold(f, shift(z=-2.5)), "2.[45].* mm too low everywhere"),
    "2 mm too high": (lambda f: in_mold(f, shift(z=2)), "(2.0|1.9).* mm too high everywhere"),
    "0.25 mm too high": (
        lambda f: in_mold(f, shift(z=0.25)),
        "0.2[3-7] mm too high everywhere.*check the pose, the thick",
    ),
    "0.25 mm too low": (lambda f: in_mold(f, shift(z=-0.25)), "0.2[3-7] mm too low|no ply is seen"),
    "tilted by 0.1 degree": (lambda f: tilted(f, 0.1), r"tilted by 0\.(1|09\d*|10\d*) degrees about an axis at 2[0-4]"),
    "tilted by 1 degree": (lambda f: tilted(f, 1.0), "tilted by (1|0.9)"),
    "bow of 1 mm": (lambda f: bent(f, lambda u, v: 1 - u * u), "bent by (1|0.9|0.8)"),
    "warp of 1 mm": (lambda f: bent(f, lambda u, v: u * v), "bent by"),
    "empty mold": (empty, "no ply is seen.*the mold is empty"),
    "the reference itself": (lambda f: given(f).reference, "scan and reference are the same: 100 %"),
}


@BOTH
@pytest.mark.parametrize("name", list(OUT_OF_PLACE))
def test_a_scan_out_of_place_is_invalid_and_the_reason_says_how(family, name):
    make, reason = OUT_OF_PLACE[name]
    report = inspector(family).inspect(make(family))
    assert report.verdict is Verdict.INVALID
    assert not report.passed
    assert not report.timings_ms.get("debulk")  # nothing was solved for it
    assert re.search(reason, report.reason), report.reason


@BOTH
def test_swapped_scan_and_reference(family):
    g = given(family)
    report = Inspector(None, g.scan, g.ply_outline, g.fibre_angles_deg, g.mold_from_scanner).inspect(g.reference)
    assert report.verdict is Verdict.INVALID
    assert "scan and reference are swapped" in report.reason


@BOTH
def test_the_figures_of_a_good_scan_stand_in_the_report_and_come_back_from_its_file(family, tmp_path):
    report = inspector(family).inspect(given(family).scan)
    level = report.level
    assert level.thickness_mm == 0.3
    assert abs(level.laid_mm - 0.3) < 0.02
    assert 0 < level.uncertainty_mm < 0.01
    assert level.low_share + level.high_share < 0.05
    assert abs(level.offset_mm) < 0.02
    assert level.tilt_deg < 0.005
    assert level.bow_mm < 0.06
    assert level.blocks >= 24
    report.save(tmp_path / "report.json")
    assert Report.load(tmp_path / "report.json").level == level


@BOTH
def test_a_recipe_thicker_than_the_ply_is_named(family):
    g = given(family)
    recipe = Recipe(
        material={"thickness_mm": 0.8},
        verdict={"max_rms_mm": 0.7, "max_ridge_mm": 1},
    )
    report = Inspector(recipe, prepared(family), g.ply_outline, g.fibre_angles_deg, g.mold_from_scanner).inspect(g.scan)
    assert report.verdict is Verdict.INVALID
    assert re.search(r"stands 0\.(30|31) mm above the reference, its thickness is 0.8 mm", report.reason)
    assert "the thickness in the recipe" in report.reason


def test_a_pocket_that_covers_the_ply_is_none():
    report = inspector("first").inspect(bent("first", lambda u, v: 6 * (1 - u * u) * (1 - v * v)))
    assert report.verdict is Verdict.INVALID


@pytest.mark.parametrize(("high_mm", "expected"), [(8, Verdict.CEASE), (14, Verdict.CREASE)])
def test_a_pocket_on_a_third_of_the_ply_is_judged_by_its_fibres(high_mm, expected):
    report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(0, 0, 640, high_mm)))
    foot_mm2, ply_mm2 = map(pocket.polygon_area, (report.pockets[0].foot_or_outline_mm, laid_ply.layup().ply_outline))
    assert abs(foot_mm2) > 0.3 * abs(ply_mm2)
    assert report.verdict is expected, report.reason


def test_an_image_of_a_camera_needs_a_pose(layups=("first", "varied")):
    for family in layups:
        g = given(family)
        with pytest.raises(InputError, match=r"mold_from_scanner: expected a pose.*--pose identity"):
            Inspector(None, g.reference, g.ply_outline)
        points = g.in_mold(g.reference)[::2, ::2].astype(np.float32)
        Inspector(None, points)  # in the mold's frame it is no camera's image, and needs none


def test_the_pose_of_a_mold_frame_that_is_the_scanners_is_given_so():
    g = given("first")
    report = Inspector(None, g.reference, None, mold_from_scanner=np.eye(4)).inspect(g.scan)
    assert report.verdict is Verdict.INVALID  # z points away from the scanner: pockets hang down
    assert "z is to point up" in report.reason


@pytest.mark.parametrize(
    ("factor", "word"),
    [(1e-3, "metres"), (1 / 25400, "mm"), (1e3, "micrometres")],
    ids=["metres", "mils", "micrometres"],
)
def test_a_reference_in_another_unit_is_refused(factor, word):
    g = given("first")
    pose = g.mold_from_scanner.copy()
    pose[:3, 3] *= factor
    with pytest.raises(InputError, match=f"reference: expected .*{word}"):
        Inspector(None, (g.reference * factor).astype(np.float32), mold_from_scanner=pose)


def test_clouds_in_inches_or_centimetres_never_pass():
    g = given("first")
    for factor in (0.1, 1 / 25.4):
        pose = g.mold_from_scanner.copy()
        pose[:3, 3] *= factor
        clouds = [(c * factor).astype(np.float32) for c in (g.reference, g.scan)]
        try:
            report = Inspector(None, clouds[0], None, mold_from_scanner=pose).inspect(clouds[1])
        except InputError:
            continue
        assert report.verdict is Verdict.INVALID
    # In lists of points with an outline none of the ply is left, 10 mm inside it, to measure a distance of points from.
    small = [g.in_mold(c).reshape(-1, 3) / 50 for c in (g.reference, g.scan)]
    report = Inspector(None, small[0], g.ply_outline / 50).inspect(small[1])
    assert report.verdict is Verdict.INVALID
    assert not any("apart" in one.why for one in report.left_out)


@functools.cache
def inspector_of_a_list():
    g = given("first")
    return Inspector(None, g.in_mold(g.reference).reshape(-1, 3), g.ply_outline)


@pytest.mark.parametrize(
    ("factor", "word"),
    [(1e-3, "metres"), (0.1, "centimetres"), (1e3, "micrometres")],
    ids=["metres", "cm", "micrometres"],
)
def test_a_scan_in_another_unit_than_its_reference_is_named(factor, word):
    g = given("first")
    finding = inspector_of_a_list().inspect((factor * g.in_mold(g.scan)).reshape(-1, 3)).findings[0]
    assert finding.check == "unit"
    assert f"is the scan in {word}?" in finding.reason


def test_a_pose_in_metres_or_far_away_is_refused():
    g = given("first")
    pose = g.mold_from_scanner.copy()
    pose[:3, 3] += 1e6
    with pytest.raises(InputError, match="within 100 m of the mold frame's origin"):
        Inspector(None, g.reference, mold_from_scanner=pose)


def test_an_inverted_pose_leans():
    g = given("first")
    aside = turn((1.0, 0.0, 0.0), 80, np.zeros(3))
    with pytest.raises(InputError, match=r"leans by 80 degrees|expected"):
        Inspector(None, g.reference, mold_from_scanner=aside @ g.mold_from_scanner)


@pytest.mark.parametrize("known", [True, False], ids=["outline", "no outline"])
def test_a_scanner_that_sees_the_table_beside_the_ply_twice_alike_is_no_copied_scan(known):
    """A scanner that fuses or quantises its scans can give the same points, bit for bit, where nothing has changed."""
    g = given("varied")
    x, y = np.moveaxis(g.in_mold(g.scan)[..., :2], -1, 0)
    on = pocket.inside(g.ply_outline, np.nan_to_num(np.stack([x, y], axis=-1), nan=1e6).reshape(-1, 2)).reshape(x.shape)
    scan = np.where(on[..., None], g.scan, g.reference)
    assert np.mean((scan == g.reference).all(axis=-1)) > 0.5
    looks = (
        inspector("varied")
        if known
        else Inspector(None, prepared("varied"), None, g.fibre_angles_deg, g.mold_from_scanner)
    )
    one, other = looks.inspect(g.scan), looks.inspect(scan)
    assert len(one.pockets) > 2
    assert [p.verdict for p in other.pockets[:3]] == [p.verdict for p in one.pockets[:3]]
    assert other.verdict is one.verdict, other.reason
    # The ply's own points from the reference, and only the table's from another scan: the reference all the same.
    assert "are the same: 100 %" in inspector("varied").inspect(np.where(on[..., None], g.reference, g.scan)).reason


def test_rows_that_still_hold_the_reference_are_named_with_their_place():
    """A buffer that was cleared in part: every third row over a pocket shows the mold, which halves what it seems."""
    g = given("varied")
    x, y = np.moveaxis(g.in_mold(g.scan)[..., :2], -1, 0)
    at = g.ply_outline.mean(axis=0)
    stale = (np.hypot(x - at[0], y - at[1]) < 40) & (np.arange(len(x)) % 3 == 0)[:, None]
    scan = np.where(stale[..., None], g.reference, g.scan)
    (found,) = (f for f in inspector("varied").inspect(scan).findings if f.check == "same_scan")
    assert found.at_best is Verdict.INVALID and "of the points on the ply" in found.reason
    np.testing.assert_allclose(found.place_mm, at, atol=40)
    # Depths that were rounded may be the same by chance.
    coarse = np.round(scan / 0.1) * 0.1, np.round(g.reference / 0.1) * 0.1
    report = Inspector(None, coarse[1], g.ply_outline, g.fibre_angles_deg, g.mold_from_scanner).inspect(coarse[0])
    assert "same_scan" not in [f.check for f in report.findings]


@pytest.mark.parametrize(("at", "refused"), [((0, 0), False), ((300, 0), True), (None, True)])
def test_a_steep_flank_beside_the_ply_is_no_wrong_pose(at, refused):
    """Most of the mold leans by 45 degrees; the ply lies on its flat foot, on the flank, or is not known."""
    x = np.arange(-100.0, 501.0, 4.0)
    reference = surface.Reference(np.tile(np.maximum(x - 100, 0.0), (51, 1)), (-100.0, -100.0), 4.0)
    low, high = np.array([-100.0, -100.0]), np.array([500.0, 100.0])
    outline = None if at is None else np.array(at) + 80.0 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    if refused:
        with pytest.raises(InputError, match="leans by 45 degrees"):
            frame.check_tilt(reference, low, high, outline)
    else:
        frame.check_tilt(reference, low, high, outline)


def test_a_bend_goes_on_through_the_squares_that_stand_up_and_a_loose_border_does_not():
    """Both raise a robust paraboloid above the tolerance at one edge; only the border is no fault of the scan."""
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(-380, 380, 20), np.linspace(-280, 280, 15)))
    border, bent = 0.5 * np.clip((x - 120) / 260, 0, 1) ** 2, 0.16 * (x / 380) ** 2
    for rise, lies in ((border, True), (bent, False)):
        xy = np.stack([x, y], axis=1)
        blocks = Blocks(xy, 0.3 + rise, np.full(len(x), 0.005), 40.0, 1.0)
        found = level.deviation(blocks, 0.3, 0.3)
        high = np.flatnonzero(found.off(0.1) > 0)
        assert np.abs(found.fits_mm).max() > 0.1
        assert 0 < len(high) < 0.3 * len(x)
        assert found.level_without(high, 0.1) is lies


def _border(high_mm, wide_mm, corners):
    """A ply that stands loose along the middle of its upper edge, from there `wide_mm` inwards."""
    top = corners[np.argmin(np.abs(corners[:, 0]) + 1e3 * (corners[:, 1] < 0)), 1]

    def height(x, y):
        rise = np.clip(1 - (top - y) / wide_mm, 0, 1) ** 2
        return high_mm * rise * np.cos(np.pi * np.clip(x / 800, -0.5, 0.5)) ** 2

    return height


def test_a_loose_border_of_the_ply_is_no_wrong_level_but_a_ply_that_stands_off_widely_is():
    corners = laid_ply.layup().ply_outline
    report = laid_ply.inspector().inspect(laid_ply.scan(_border(0.9, 160, corners)))
    assert report.level.high_share > 0.05
    assert report.verdict is Verdict.CEASE, report.reason
    assert any("stands loose in places" in warning for warning in report.warnings)

    report = laid_ply.inspector().inspect(laid_ply.scan(_border(1.2, 600, corners)))
    assert report.verdict is Verdict.INVALID
    # So is as much air in the middle; more than a fifth of the ply is not.
    for wide_mm, expected in ((480, Verdict.CEASE), (900, Verdict.INVALID)):
        report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(0, 0, wide_mm, 0.6)))
        assert report.level.high_share > 0.05
        assert report.verdict is expected, report.reason


def test_low_bumps_on_a_small_ply_are_no_wrong_level():
    """Two bumps 1.5 mm high stand on a tenth of it; a fifth, or as much beside what lies too low, is a wrong level."""
    one, small = laid_ply.layup(), 200.0 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    mold = laid_ply.inspector().prepared

    def report(*bells, sunk_mm=0.0):
        shapes = [laid_ply.bell(*bell) for bell in bells] + [laid_ply.bell(110, -110, 130, -sunk_mm)]

        def stands(x, y):  # beside the ply, the mold
            on = np.maximum(np.abs(x), np.abs(y)) < 200
            return np.where(on, np.sum([shape(x, y) for shape in shapes], axis=0), -laid_ply.THICKNESS_MM)

        scan = laid_ply.scan(stands)
        return Inspector(None, mold, small, mold_from_scanner=one.mold_from_scanner).inspect(scan)

    low = (-60, -60, 130, 1.5), (70, 70, 130, 1.5)
    passed = report(*low)
    assert 0.06 < passed.level.loose_share == passed.level.high_share < 0.2
    assert passed.verdict is Verdict.CEASE, passed.reason
    assert report(*low, sunk_mm=1.0).verdict is Verdict.INVALID
    wide = report((0, 0, 330, 1.5))
    assert wide.level.high_share > 0.2
    assert wide.verdict is Verdict.INVALID
