"""What the filters take for noise is found in the raw scan and never passes; good layups raise no such alarm."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import laid_ply
from debulk import Inspector, Recipe, Verdict, _core, scenes
from debulk.inspection.rawscan.lost_places import left_out, lost
from lab.third.scene import scene
from lab.varied import given_right, varied_layup

BELLS = [  # x, y, width at the foot, height, mm
    (60, 40, 5, 2),
    (-140.5, 80.3, 7, 2),
    (10.2, -120.7, 9, 2),
    (0.4, 100.6, 6, 3),
    (-80.7, -60.2, 8, 3),
    (100.1, -40.5, 5, 6),
    (-30.6, 20.9, 6, 6),
]
WIDE = (0.0, 0.0, 260.0, 6.5)  # a pocket, a ridge of 0.4 mm
THICKNESS_SHARE = 0.43  # of the thickness, in a ridge without excess length


def _true_ridge_mm(wide_mm, high_mm):
    """By Simpson's rule over the arc of a squared cosine."""
    x = np.linspace(0, wide_mm, 2001)
    arc = np.sqrt(1 + (high_mm * np.pi / wide_mm * np.sin(2 * np.pi * x / wide_mm)) ** 2)
    weights = np.r_[1, np.tile([4, 2], 1000)[:-1], 1] * wide_mm / 2000 / 3
    return (weights @ arc - wide_mm) / 2 + THICKNESS_SHARE * laid_ply.THICKNESS_MM


def _bells(*bells):
    shapes = [laid_ply.bell(*bell) for bell in bells]
    return lambda x, y: sum(shape(x, y) for shape in shapes)


def _fold(wide_mm, high_mm, long_mm, turned_deg, middle_mm=(50, 30)):
    """Return a wrinkle of one height, a square of a cosine across."""
    turn = np.radians(turned_deg)

    def height(x, y):
        along = np.cos(turn) * (x - middle_mm[0]) + np.sin(turn) * (y - middle_mm[1])
        across = np.cos(turn) * (y - middle_mm[1]) - np.sin(turn) * (x - middle_mm[0])
        profile = high_mm * np.cos(np.pi * np.clip(across / wide_mm, -0.5, 0.5)) ** 2
        return np.where(np.abs(along) < long_mm / 2, profile, 0.0)

    return height


@functools.cache
def _scan(count=None):
    return laid_ply.scan(_bells(*BELLS[:count]), noise_mm=0.05)


def _find(inspector, scan, stop=None):
    """Return what stands narrowly in a scan."""
    image = inspector._image(scan, inspector._placing.look(scan, _core.Stop()))
    return inspector._narrow.find(image, stop)


def _places(scan):
    return _find(laid_ply.inspector(), scan).places


def _lost(inspector, scan):
    """Return what the height map has lost of a scan and could crease."""
    found = inspector._with_runs(inspector.find(scan), inspector.ply, _core.Stop(), inspector.grid_spacing_mm)
    return lost(_find(inspector, scan), found, inspector.ply)


# --- what is found, and how it is measured ---


@pytest.mark.parametrize(("wide_mm", "high_mm"), [(3, 8), (6, 3)])
def test_wrinkles_of_any_direction_are_found_with_place_height_and_length(wide_mm, high_mm):
    folds = {0: (50, 30), 30: (-140, 90), 45: (140, -90), 90: (-180, -90), 140: (-20, -80)}
    shapes = [_fold(wide_mm, high_mm, 100, turned_deg, middle) for turned_deg, middle in folds.items()]
    found = _places(laid_ply.scan(lambda x, y: sum(shape(x, y) for shape in shapes), noise_mm=0.05))
    length_mm = dict.fromkeys(folds, 0.0)
    for place in found:
        assert place.is_wrinkle
        ends = np.array(place.ends_mm)
        turned_deg = min(folds, key=lambda one: np.linalg.norm(ends.mean(axis=0) - folds[one]))
        turn, off = np.radians(turned_deg), ends - folds[turned_deg]
        across = np.cos(turn) * off[:, 1] - np.sin(turn) * off[:, 0]
        along = np.cos(turn) * off[:, 0] + np.sin(turn) * off[:, 1]
        assert np.abs(across).max() < 3
        assert np.abs(along).max() < 53
        assert place.height_mm == pytest.approx(high_mm, abs=0.3)
        assert place.width_mm <= wide_mm / 2 + 0.1
        length_mm[turned_deg] += place.length_mm
    assert length_mm == pytest.approx(dict.fromkeys(folds, 100.0), abs=8)


@pytest.mark.parametrize("step_mm", [0, 0.12], ids=["white", "quantised"])
def test_bells_that_the_filters_take_away_are_found_with_place_height_and_ridge(step_mm):
    scan = _quantised(_scan(), step_mm) if step_mm else _scan()
    found = _lost(laid_ply.inspector(), scan)
    kept = BELLS[2:3] if step_mm else BELLS[1:3]  # of these the height map keeps enough to judge them
    lost = [bell for bell in BELLS if bell not in kept]
    assert len(found) == len(lost)
    limit_mm = laid_ply.inspector().recipe.verdict.max_ridge_mm
    for x, y, wide_mm, high_mm in lost:
        bump = min(found, key=lambda one: np.linalg.norm(np.subtract(one.place.top_mm, (x, y))))
        assert not bump.place.is_wrinkle
        assert np.linalg.norm(np.subtract(bump.place.top_mm, (x, y))) < 1.5
        assert bump.place.height_mm == pytest.approx(high_mm, rel=0.3)
        assert _true_ridge_mm(wide_mm, high_mm) > limit_mm
        assert bump.ridge_mm == pytest.approx(_true_ridge_mm(wide_mm, high_mm), rel=0.4)
        assert bump.most_mm > limit_mm


def _quantised(scan, step_mm, seed=1):
    depth = np.linalg.norm(scan, axis=2, keepdims=True)
    noisy = depth + np.random.default_rng(seed).normal(0, 0.05, depth.shape)
    return (scan * (np.round(noisy / step_mm) * step_mm / depth)).astype(np.float32)


# --- what it does to a layup ---


def test_a_wrinkle_of_3_by_8_mm_decides():
    report = laid_ply.inspector().inspect(laid_ply.scan(_fold(3, 8, 200, 0), noise_mm=0.05))
    assert report.verdict is Verdict.CREASE
    assert "a wrinkle stands already" in report.reason
    (wrinkle,) = report.wrinkles
    assert wrinkle.height_mm == pytest.approx(8, abs=0.3)
    assert wrinkle.length_mm == pytest.approx(200, abs=4)


@pytest.mark.parametrize(("turned_deg", "verdict"), [(0, Verdict.CREASE), (45, Verdict.UNDECIDED)])
def test_the_excess_of_a_wrinkle_is_that_of_the_fibres_that_cross_it(turned_deg, verdict):
    """One 4 mm wide and 1.4 mm high has a ridge above the limit across; at 45 degrees fibres show 0.7 of it."""
    report = laid_ply.inspector().inspect(laid_ply.scan(_fold(4, 1.4, 150, turned_deg), noise_mm=0.02))
    assert report.verdict is verdict
    (wrinkle,) = report.wrinkles
    assert wrinkle.ridge_height_mm == pytest.approx(_true_ridge_mm(4 / np.cos(np.radians(turned_deg)), 1.4), rel=0.1)


def test_bumps_leave_the_layup_undecided_and_the_report_says_where():
    report = laid_ply.inspector().inspect(_scan(3))
    assert report.verdict is Verdict.UNDECIDED
    assert {one.check for one in report.findings if one.at_best} == {"pockets", "narrow_bumps"}
    assert len(report.pockets) == 2  # of these the height map keeps enough to judge them
    marked = [one.place_mm for one in report.left_out if one.what.startswith("a bump about")]  # on the page's map
    assert sorted(marked) == [pytest.approx(BELLS[0][:2], abs=1.5)]


def test_one_too_low_for_a_ridge_passes():
    assert _true_ridge_mm(9, 1) < 0.5 * laid_ply.inspector().recipe.verdict.max_ridge_mm
    assert laid_ply.inspector().inspect(laid_ply.scan(_bells((60, 40, 9, 1)))).verdict is Verdict.CEASE


@pytest.mark.parametrize(("wide_mm", "high_mm"), [(8.0, 2.5), (10.0, 3.0)])
def test_a_narrow_bump_on_a_pocket_is_not_passed(wide_mm, high_mm):
    """What the height map keeps of it is enough for a ridge."""
    scan = laid_ply.scan(_bells(WIDE, (31.0, 22.0, wide_mm, high_mm)))
    assert _true_ridge_mm(wide_mm, high_mm) > laid_ply.inspector().recipe.verdict.max_ridge_mm
    assert laid_ply.inspector().inspect(scan).verdict is Verdict.CREASE


def test_a_narrow_bump_on_what_is_no_pocket_is_not_passed():
    """120 mm wide and 1.5 mm high the ply stands up below the cut."""
    low = (0.0, 0.0, 120.0, 1.5)
    report = laid_ply.inspector().inspect(laid_ply.scan(_bells(low)))
    assert report.verdict is Verdict.CEASE
    assert report.pockets == ()
    report = laid_ply.inspector().inspect(laid_ply.scan(_bells(low, (17.0, 14.0, 7.0, 2.0))))
    assert report.verdict is Verdict.UNDECIDED
    assert "narrow_bumps" in [one.check for one in report.findings if one.at_best]


def test_what_lies_below_a_bump_counts_with_it():
    """On even ground this bump's ridge would keep the limit; on a pocket of 0.4 mm it does not."""
    bump = (31.0, 22.0, 8.0, 1.3)
    even, ridden = (laid_ply.inspector().inspect(laid_ply.scan(_bells(*on, bump))) for on in ((), (WIDE,)))
    assert even.verdict is Verdict.CEASE
    assert ridden.verdict is Verdict.UNDECIDED


# --- what is none ---


def _spoiled(scan, rng, flying, wild):
    """Return a scan with a share of flying points, and where `wild` is True depths that scatter by 5 mm."""
    depth = np.linalg.norm(scan, axis=2, keepdims=True)
    off = np.where(rng.random(depth.shape) < flying, rng.normal(0, 6, depth.shape), 0)
    off = np.where(wild[..., None], rng.normal(0, 5, depth.shape), off)
    return (scan * (1 + off / depth)).astype(np.float32)


def test_noise_flying_pixels_highlights_and_pockets_are_none():
    rng = np.random.default_rng(5)
    scan = laid_ply.scan(_bells((50, 30, 60, 8), (-200, -100, 200, 8, 30)), noise_mm=0.15)
    rows, columns = np.mgrid[: scan.shape[0], : scan.shape[1]]
    wild = np.zeros(scan.shape[:2], dtype=bool)
    for _ in range(20):
        turn, row, column = rng.uniform(0, np.pi), rng.uniform(200, 760), rng.uniform(200, 1080)
        along = np.cos(turn) * (columns - column) + np.sin(turn) * (rows - row)
        across = np.cos(turn) * (rows - row) - np.sin(turn) * (columns - column)
        wild |= (np.abs(along) < 40) & (np.abs(across) < rng.uniform(1, 4))
    for _ in range(30):
        wild |= np.hypot(rows - rng.uniform(200, 760), columns - rng.uniform(200, 1080)) < rng.uniform(3, 12)
    assert _lost(laid_ply.inspector(), _spoiled(scan, rng, 0.02, wild)) == ()


@pytest.mark.parametrize("pixels", [(640, 480), (1280, 960)], ids=["640", "1280"])
@pytest.mark.parametrize("seed", [0, 111])
def test_flying_points_side_by_side_and_the_tops_of_pockets_are_none(seed, pixels):
    """Two or more flying points, 3 to 35 mm high, stand out as a bump does; the first family has dozens a scan."""
    layup = scenes.layup(seed, pixels)
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    assert _lost(inspector, layup.scan) == ()


@pytest.mark.parametrize("seed", [1201, 1202, 1203, 1204, 1210])
def test_good_layups_with_holes_clamps_and_all_noise_raise_no_alarm(seed):
    noise = ["correlated", "quantised", "highlights", "flying"]
    given = given_right(varied_layup(seed, (800, 600), noise=noise, holes_mm=[6, 15, 40], clamp=True))
    ply = Inspector(
        None, given.reference, given.ply_outline, mold_from_scanner=given.mold_from_scanner, mask=given.mask
    )
    assert _lost(ply, given.scan) == ()


def test_what_the_spacing_of_a_list_allows_is_found():
    """Points 1 mm apart, in no order, are laid out on pixels of 1.7 mm."""
    bells = [(60, 40, 9, 2), (-140.5, 80.3, 10, 2), (10.2, -120.7, 9, 3), (-80.7, -60.2, 8.5, 4)]
    hills, fold = _bells(*bells), _fold(5, 6, 100, 30)
    scan = laid_ply.scan(lambda x, y: hills(x, y) + fold(x, y + 110), noise_mm=0.05)
    points = np.random.default_rng(0).permutation(scan[np.isfinite(scan).all(axis=2)])
    standing = _find(laid_ply.inspector(), points)
    for x, y, _, high_mm in bells:
        place = min(standing.places, key=lambda one: np.linalg.norm(np.subtract(one.top_mm, (x, y))))
        assert np.linalg.norm(np.subtract(place.top_mm, (x, y))) < 2.5
        assert place.height_mm == pytest.approx(high_mm, rel=0.35)
    assert sum(place.length_mm for place in standing.places if place.is_wrinkle) > 75
    (unseen,) = left_out((), standing, laid_ply.inspector().find(scan))
    assert "narrower than 8." in unseen.what


def test_without_an_outline_a_corner_of_the_ply_is_no_bump():
    """The ply ends in a tip; what stands there above the bare mold is the ply itself."""
    given = scene(603)
    recipe, angles = Recipe(material={"thickness_mm": given.thickness_mm}), (given.fibre_deg, given.fibre_deg + 90)
    inspector = Inspector(recipe, given.reference, given.outline, angles, given.mold_from_scanner)
    assert given.outline is None
    assert _find(inspector, given.scan).places == ()


# --- where none can be looked for, and where not all can be found ---


def test_what_is_too_coarse_is_left_out_with_a_bound():
    inspector, scan = laid_ply.inspector(), laid_ply.scan(_fold(3, 8, 200, 0))
    found = inspector.find(scan)
    for points, why in (
        (np.ascontiguousarray(scan.reshape(-1, 3)[::7]), "apart"),
        (np.ascontiguousarray(scan[::5, ::5]), "apart"),
        (np.full_like(scan, np.nan), "pitch"),
    ):
        standing = _find(inspector, points)
        assert standing.places == ()
        assert standing.unknown is None
        wrinkles, bumps = left_out((), standing, found)
        assert why in wrinkles.why
        assert "9 mm" in bumps.what
        assert bumps.bound.startswith("none")


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("axis", [0, 1])
def test_an_image_of_every_second_row_or_column_is_not_searched(axis, first):
    """Whichever half it is: the distance to a neighbour is not known along one of the two."""
    scan = laid_ply.scan(lambda x, y: 0 * x).copy()
    np.moveaxis(scan, axis, 0)[first::2] = np.nan
    inspector = laid_ply.inspector()
    image = inspector._image(scan, inspector._placing.look(scan, _core.Stop()))
    (entry,) = inspector._narrow.find(image).left_out
    assert entry.why == "the pitch of the scan's pixels is not known"


def test_a_report_says_how_narrow_a_place_may_be():
    report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(50, 30, 60, 8)))
    (unseen,) = (one for one in report.left_out if "at their foot, standing wrinkles" in one.what)
    assert unseen.what.startswith("bumps narrower than 5 mm")
    assert "wrinkles narrower than 3 mm" in unseen.what


def test_a_scan_that_stands_out_everywhere_is_spoiled_unless_it_does_off_the_ply():
    scan = laid_ply.scan(_fold(3, 8, 200, 20))
    pose, outline = laid_ply.layup().mold_from_scanner, laid_ply.layup().ply_outline
    seen = np.isfinite(scan).all(axis=2)
    off = np.zeros(scan.shape[:2], dtype=bool)
    off[seen] = ~laid_ply.pocket.inside(outline, (scan[seen] @ pose[:3, :3].T + pose[:3, 3])[:, :2])
    wild = np.random.default_rng(2).normal(0, 3, scan.shape[:2]).astype(np.float32)
    around, on_it = scan.copy(), scan.copy()
    around[..., 2] += np.where(off, wild, 0)
    on_it[..., 2] += np.where(off, 0, wild)
    beside = _find(laid_ply.inspector(), around)
    assert beside.unknown is None
    assert [place.is_wrinkle for place in beside.places] == [True]
    spoiled = _find(laid_ply.inspector(), on_it)
    assert spoiled.unknown.at_best is Verdict.INVALID
    assert "scan again" in spoiled.unknown.reason


def test_the_search_heeds_a_stop_and_a_deadline_leaves_a_doubt():
    inspector, scan = laid_ply.inspector(), _scan(1)
    late = _core.Stop()
    late.set_deadline(1e-9)
    standing = _find(inspector, scan, late)
    assert standing.unknown.at_best is Verdict.UNDECIDED
    assert "deadline" in standing.left_out[0].why
    cancelled = _core.Stop()
    cancelled.cancel()
    with pytest.raises(_core.Stopped):
        _find(inspector, scan, cancelled)


def test_the_search_is_the_same_on_any_number_of_threads():
    recipe = Recipe(run={"threads": 1})
    setup = laid_ply.inspector().setup
    one = Inspector(recipe, setup.prepared, setup.outline, mold_from_scanner=setup.mold_from_scanner)
    places, others = (_find(of, _scan()).places for of in (one, laid_ply.inspector()))
    assert [place.samples_mm.tobytes() for place in places] == [place.samples_mm.tobytes() for place in others]
    assert places
