"""The virtual layup against brute force: rays marched through the truth, areas on fine grids, faults counted."""

import doctest
import importlib

import numpy as np
import pytest

import debulk
from debulk.scenes import layup

CLEAN = {"noise_mm": 0.0, "flying_share": 0.0, "dropout_share": 0.0}
SEEDS = (0, 1, 2)


@pytest.fixture(scope="module", params=SEEDS)
def truth(request):
    return layup(request.param, (64, 48)).truth


@pytest.fixture(scope="module")
def clean():
    return layup(4, (640, 480), **CLEAN)


@pytest.fixture(scope="module")
def pair():
    """One scene, spoiled and clean."""
    return layup(7, (1280, 960)), layup(7, (1280, 960), **CLEAN)


def rays(scene):
    """(H, W, 3) directions of unit depth in the scanner frame."""
    f, cx, cy = scene.camera
    i, j = np.indices(scene.scan.shape[:2])
    return np.stack([(j - cx) / f, (i - cy) / f, np.ones(i.shape)], axis=-1)


def to_mold(scene, points):
    t = scene.mold_from_scanner
    return points @ t[:3, :3].T + t[:3, 3]


def polygon_area(p):
    return 0.5 * np.sum(p[:, 0] * np.roll(p[:, 1], -1) - p[:, 1] * np.roll(p[:, 0], -1))


def cells_around(outline, count=400_000):
    """Centres of equal square cells over an outline's bounding box, and a cell's area."""
    low, high = outline.min(axis=0) - 0.5, outline.max(axis=0) + 0.5
    step = np.sqrt(np.prod(high - low) / count)
    x, y = (np.arange(a, b, step) + 0.5 * step for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(x, y), axis=-1), step**2


# --- determinism ---


def same(a, b):
    return a.tobytes() == b.tobytes()


def test_same_seed_same_bits_on_any_number_of_threads():
    one, two = layup(5, (320, 240), threads=1), layup(5, (320, 240), threads=2)
    assert same(one.scan, two.scan)
    assert same(one.reference, two.reference)
    assert same(one.ply_outline, two.ply_outline)
    assert same(one.mold_from_scanner, two.mold_from_scanner)
    assert same(one.truth.flying, two.truth.flying)
    assert [p.centre_mm for p in one.truth.pockets] == [p.centre_mm for p in two.truth.pockets]


def test_other_seeds_give_other_layups():
    a, b = layup(5, (64, 48)), layup(6, (64, 48))
    assert not same(a.scan, b.scan)
    assert not same(a.ply_outline, b.ply_outline)
    assert all(p.centre_mm != q.centre_mm for p, q in zip(a.truth.pockets, b.truth.pockets, strict=True))


def test_a_repeated_scan_has_other_faults_and_nothing_else():
    one, other = (layup(seed=4, pixels=(160, 120), repeat=k) for k in (0, 1))
    assert np.array_equal(one.reference, other.reference, equal_nan=True)
    assert np.array_equal(one.ply_outline, other.ply_outline)
    assert [p.peak_mm for p in one.truth.pockets] == [p.peak_mm for p in other.truth.pockets]
    difference = np.linalg.norm(one.scan - other.scan, axis=2)
    assert np.median(difference[np.isfinite(difference)]) == pytest.approx(0.05, rel=1.0)
    assert np.count_nonzero(np.isnan(one.scan) != np.isnan(other.scan)) > 10
    assert not np.array_equal(other.scan, layup(seed=4, pixels=(160, 120), repeat=2).scan, equal_nan=True)
    with pytest.raises(debulk.InputError, match="repeat"):
        layup(repeat=-1)


def test_faults_do_not_move_the_layup(pair):
    spoiled, clean = pair
    assert [p.centre_mm for p in spoiled.truth.pockets] == [p.centre_mm for p in clean.truth.pockets]
    assert same(spoiled.mold_from_scanner, clean.mold_from_scanner)


# --- camera and rays ---


def test_shapes_types_and_pose(clean):
    assert clean.scan.shape == clean.reference.shape == (480, 640, 3)
    assert clean.scan.dtype == clean.reference.dtype == np.float32
    rotation = clean.mold_from_scanner[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert 2380 < clean.mold_from_scanner[2, 3] < 2420
    tilt = np.degrees(np.arccos(-rotation[2, 2]))
    assert 6 < tilt < 11
    assert rotation[0, 0] > 0.98  # image right is mold +x: the noisy left third is at -x


@pytest.mark.parametrize("cloud", ["scan", "reference"])
def test_every_point_projects_to_its_pixel(clean, cloud):
    f, cx, cy = clean.camera
    p = getattr(clean, cloud).astype(np.float64)
    i, j = np.indices(p.shape[:2])
    assert np.isfinite(p).all()
    assert np.abs(f * p[..., 0] / p[..., 2] + cx - j).max() < 1e-3
    assert np.abs(f * p[..., 1] / p[..., 2] + cy - i).max() < 1e-3


@pytest.mark.parametrize("cloud", ["scan", "reference"])
@pytest.mark.parametrize("seed", SEEDS)
def test_each_ray_runs_through_air_to_its_point_and_into_matter_there(seed, cloud):
    """The first hit, with occlusion, from the truth's heights alone; float32 rounds depths by up to 1.22e-4 mm."""
    scene = layup(seed, (640, 480), **CLEAN)
    direction = rays(scene)
    depth = getattr(scene, cloud)[..., 2].astype(np.float64)

    def clearance(at):
        p = to_mold(scene, direction * at[..., None])
        matter = scene.truth.mold_height(p[..., :2])
        if cloud == "scan":
            matter = matter + scene.truth.ply_height_above_mold(p[..., :2])
        return p[..., 2] - matter

    # Within 1e-3 mm of a step's foot the two sides cannot be told apart in float32: a handful of pixels at most.
    assert np.count_nonzero(clearance(depth + 1.5e-4) >= 0) <= 3
    assert np.count_nonzero(clearance(depth - 1.5e-4) <= 0) <= 3
    for back in (0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0):
        assert np.count_nonzero(clearance(depth - back) <= 0) == 0


def test_raised_points_shift_sideways_in_the_image(clean):
    """Parallax: the pixel that sees a pocket's top sees the reference at another XY."""
    top = max(clean.truth.pockets, key=lambda p: p.peak_mm)
    scan, reference = to_mold(clean, clean.scan), to_mold(clean, clean.reference)
    i, j = np.unravel_index(np.argmin(np.hypot(*(scan[..., :2] - top.centre_mm).T).T), scan.shape[:2])
    centre = clean.mold_from_scanner[:3, 3]
    away = scan[i, j, :2] - centre[:2]
    expected = away * top.peak_mm / (centre[2] - scan[i, j, 2])
    np.testing.assert_allclose(reference[i, j, :2] - scan[i, j, :2], expected, rtol=0.1)


def test_mold_fills_the_image(clean):
    on_mold = clean.truth.mold_height(to_mold(clean, clean.reference)[..., :2]) > -100
    assert 0.85 < on_mold.mean() < 1.0
    assert not on_mold[[0, -1]].any()
    assert not on_mold[:, [0, -1]].any()


@pytest.mark.parametrize("pitch", [2.5, 4.0])
def test_pitch_is_the_mean_distance_of_points_on_the_mold(pitch):
    scene = layup(3, (640, 480), pitch, **CLEAN)
    p = to_mold(scene, scene.reference.astype(np.float64))
    on_mold = scene.truth.mold_height(p[..., :2]) > -100
    right = np.linalg.norm(np.diff(p, axis=1), axis=2)[on_mold[:, 1:] & on_mold[:, :-1]]
    down = np.linalg.norm(np.diff(p, axis=0), axis=2)[on_mold[1:] & on_mold[:-1]]
    assert np.concatenate([right, down]).mean() == pytest.approx(pitch, rel=0.03)
    assert np.sqrt(1200 * 900 / on_mold.sum()) == pytest.approx(pitch, rel=0.01)


# --- what lies on the mold ---


def test_fourteen_pockets_of_the_stated_sizes(truth):
    pockets = truth.pockets
    areas = np.array([p.area_mm2 for p in pockets])
    assert len(pockets) == 14
    assert {p.kind for p in pockets} == {"pocket"}
    assert areas[0] == pytest.approx(43800, rel=1e-9)
    assert areas[-1] == pytest.approx(535, rel=1e-9)
    assert np.all(np.diff(areas) < -0.05 * areas[1:])
    peaks = [p.peak_mm for p in pockets]
    assert min(peaks) == pytest.approx(3.6)
    assert max(peaks) == pytest.approx(15.0)
    assert [i for i, p in enumerate(pockets, 1) if p.touches_ply_edge] == [7, 9]
    assert sum(p.radii_mm[0] > 2 * p.radii_mm[1] for p in pockets) == 2
    assert 4 <= sum(p.straight_excess_mm < 0.2 for p in pockets) <= 5
    assert sum(p.straight_excess_mm > 2.4 for p in pockets) == 2


def test_decoys_stay_below_their_tolerance_and_above_the_others(truth):
    kinds = [d.kind for d in truth.decoys]
    assert [kinds.count(k) for k in ("below AreaTol", "below PeakTol", "below CutHeight")] == [2, 2, 2]
    for d in truth.decoys:
        above_cut = d.peak_mm - truth.cut_height_mm
        if d.kind == "below AreaTol":
            assert 150 < d.area_mm2 <= 181
            assert above_cut > 2.0
        elif d.kind == "below PeakTol":
            assert d.area_mm2 > 400
            assert 0.9 < above_cut <= 1.06
        else:
            assert d.area_mm2 == 0
            assert d.outline_mm.shape == (0, 2)
            assert -0.3 < above_cut <= -0.2


def test_areas_and_volumes_at_the_cut_against_a_fine_grid(truth):
    for p in (*truth.pockets, *truth.decoys[:4]):
        xy, cell = cells_around(p.outline_mm)
        height = truth.ply_height_above_mold(xy)
        # A neighbour can reach into the box: only what lies within this foot counts.
        mine = (height > truth.cut_height_mm) & (np.hypot(*p.bell.to_unit(xy[..., 0], xy[..., 1])) < 1)
        assert mine.sum() * cell == pytest.approx(p.area_mm2, rel=5e-4)
        assert height[mine].sum() * cell == pytest.approx(p.volume_mm3, rel=5e-4)
        assert polygon_area(p.outline_mm) == pytest.approx(p.area_mm2, rel=3e-5)


def test_outline_lies_at_the_cut_or_on_the_edge(truth):
    for p in truth.pockets:
        rho = np.hypot(*p.bell.to_unit(*p.outline_mm.T))
        height = truth.thickness_mm + p.bell.height_mm * np.cos(0.5 * np.pi * rho) ** 2
        at_cut = np.abs(height - truth.cut_height_mm) < 1e-9
        assert np.all(height > truth.cut_height_mm - 1e-9)
        if p.touches_ply_edge:
            on_edge = p.outline_mm[~at_cut]
            assert len(on_edge) > 5
            span = np.ptp(on_edge, axis=0).max()
            assert span > 0.5 * p.radii_mm[1]
            inward = on_edge + 0.01 * (np.array(p.centre_mm) - on_edge)
            outward = on_edge - 0.01 * (np.array(p.centre_mm) - on_edge)
            assert np.all(truth.ply_height_above_mold(inward) > 0)
            assert np.all(truth.ply_height_above_mold(outward) == 0)
        else:
            assert at_cut.all()


def test_peak_and_laid_ply(truth):
    for p in truth.pockets:
        assert truth.ply_height_above_mold(p.centre_mm) == pytest.approx(p.peak_mm, abs=1e-12)
        foot = truth.ply_height_above_mold(p.foot_outline_mm + 1e-6 * (p.foot_outline_mm - p.centre_mm))
        assert np.all((np.abs(foot - truth.thickness_mm) < 1e-6) | (foot == 0))
    assert truth.ply_height_above_mold([[590.0, 0.0], [0.0, 440.0]]).tolist() == [0.0, 0.0]
    assert truth.mold_height([[0.0, 0.0], [700.0, 0.0]]).tolist() == [0.0, -110.0]


def test_feet_keep_their_distance(truth):
    bumps = (*truth.pockets, *truth.decoys)
    close = []
    for k, a in enumerate(bumps):
        foot = a.bell.foot(360)
        for b in bumps[k + 1 :]:
            other = b.bell.foot(360)
            d = foot[:, None] - other[None]
            gap = np.sqrt(np.einsum("ijk,ijk->ij", d, d).min())
            assert gap > 5
            assert np.hypot(*b.bell.to_unit(*foot.T)).min() > 1  # outside, not within
            assert np.hypot(*a.bell.to_unit(*other.T)).min() > 1
            if gap < 14:
                close.append(round(gap))
    assert close == [7]


def test_inner_feet_keep_off_the_free_edge():
    scene = layup(2, (64, 48))
    for p in scene.truth.pockets:
        d = p.bell.foot(180)[:, None] - scene.ply_outline[None]
        gap = np.sqrt(np.einsum("ijk,ijk->ij", d, d).min())
        assert (gap > 25) != p.touches_ply_edge


def test_straight_excess():
    for p in layup(0, (64, 48)).truth.pockets:
        x = np.linspace(-1, 1, 200_001)
        y = p.bell.height_mm * np.cos(0.5 * np.pi * x) ** 2
        length = np.hypot(np.diff(x * p.radii_mm[1]), np.diff(y)).sum()
        assert p.straight_excess_mm == pytest.approx(length - 2 * p.radii_mm[1], rel=1e-6)
        shallow = np.pi**2 * p.bell.height_mm**2 / (8 * p.radii_mm[1])
        assert p.straight_excess_mm == pytest.approx(shallow, rel=0.15)


def test_outline_is_irregular_rounded_and_on_the_mold():
    outline = layup(1, (64, 48)).ply_outline
    assert polygon_area(outline) > 0.9e6  # counter-clockwise
    assert np.abs(outline).max(axis=0) == pytest.approx([565, 415], abs=3.1)
    steps = np.hypot(*(np.roll(outline, -1, axis=0) - outline).T)
    assert steps.min() > 3
    assert steps.max() < 5
    edges = np.roll(outline, -1, axis=0) - outline
    turn = np.degrees(np.diff(np.unwrap(np.arctan2(*edges.T[::-1]))))
    assert np.abs(turn).max() < 8  # no sharp corner
    side = outline[(outline[:, 0] > 500) & (np.abs(outline[:, 1]) < 300), 0]
    assert 0.5 < np.ptp(side) < 6.1


@pytest.mark.parametrize(("thickness", "cut"), [(0.05, 2.2), (0.6, 1.2), (0.25, 2.0)])
def test_other_thicknesses_and_cuts_keep_the_areas(thickness, cut):
    truth = layup(0, (64, 48), thickness_mm=thickness, cut_height_mm=cut).truth
    assert [p.area_mm2 for p in truth.pockets][::13] == pytest.approx([43800, 535], rel=1e-9)
    assert truth.pockets[6].area_mm2 == pytest.approx(3300, rel=1e-9)  # solved at the edge
    assert min(p.peak_mm for p in truth.pockets) == pytest.approx(3.6)


# --- faults ---


def range_error(spoiled, clean, cloud):
    a, b = getattr(spoiled, cloud).astype(np.float64), getattr(clean, cloud).astype(np.float64)
    return (a[..., 2] - b[..., 2]) * np.linalg.norm(rays(clean), axis=2)


@pytest.mark.parametrize(("cloud", "prefix"), [("scan", ""), ("reference", "reference_")])
def test_noise_along_the_ray(pair, cloud, prefix):
    spoiled, clean = pair
    error = range_error(spoiled, clean, cloud)
    good = ~(getattr(spoiled.truth, prefix + "dropout") | getattr(spoiled.truth, prefix + "flying"))
    left = np.arange(1280) < 426
    assert error[:, ~left][good[:, ~left]].std() == pytest.approx(0.05, rel=0.01)
    assert error[:, left][good[:, left]].std() == pytest.approx(0.15, rel=0.01)
    assert abs(error[good].mean()) < 5e-4
    aside = np.where(good[..., None], np.cross(getattr(spoiled, cloud), rays(clean)), 0.0)
    assert np.abs(aside).max() < 1e-3  # nothing across the ray


def test_scan_and_reference_have_faults_of_their_own(pair):
    spoiled, clean = pair
    a, b = range_error(spoiled, clean, "scan"), range_error(spoiled, clean, "reference")
    good = (np.abs(a) < 0.5) & (np.abs(b) < 0.5)
    assert abs(np.corrcoef(a[good], b[good])[0, 1]) < 0.01
    assert (spoiled.truth.dropout & spoiled.truth.reference_dropout).mean() < 0.001
    assert (spoiled.truth.flying & spoiled.truth.reference_flying).mean() < 0.0001


def test_neighbouring_blocks_of_rows_have_noise_of_their_own(pair):
    error = range_error(*pair, "scan")
    a, b = error[0:16, 500:], error[16:32, 500:]
    good = (np.abs(a) < 0.3) & (np.abs(b) < 0.3)
    assert abs(np.corrcoef(a[good], b[good])[0, 1]) < 0.05


@pytest.mark.parametrize("prefix", ["", "reference_"])
def test_flying_pixels(pair, prefix):
    spoiled, clean = pair
    flying = getattr(spoiled.truth, prefix + "flying")
    error = range_error(spoiled, clean, "reference" if prefix else "scan")
    assert flying.mean() == pytest.approx(0.005, rel=0.05)
    off = error[flying]
    assert np.abs(off).max() < 21
    assert np.abs(off).max() > 19
    assert np.abs(off).min() > 0.5 - 0.75  # half a millimetre less five sigma
    assert abs((off > 0).mean() - 0.5) < 0.05
    beside = np.zeros_like(flying)
    beside[:, 1:] |= flying[:, :-1]
    beside[:, :-1] |= flying[:, 1:]
    assert (flying & beside).sum() / flying.sum() == pytest.approx(0.5, abs=0.05)  # half of them in runs


@pytest.mark.parametrize(("cloud", "prefix"), [("scan", ""), ("reference", "reference_")])
def test_dropouts(pair, cloud, prefix):
    dropout = getattr(pair[0].truth, prefix + "dropout")
    assert np.array_equal(np.isnan(getattr(pair[0], cloud)).all(axis=2), dropout)
    assert np.array_equal(np.isnan(getattr(pair[0], cloud)).any(axis=2), dropout)
    assert dropout.mean() == pytest.approx(0.02, rel=0.05)
    inner = dropout[1:-1, 1:-1]
    beside = dropout[:-2, 1:-1].astype(int) + dropout[2:, 1:-1] + dropout[1:-1, :-2] + dropout[1:-1, 2:]
    assert (inner & (beside >= 2)).sum() / inner.sum() == pytest.approx(0.5, abs=0.06)  # half of them in discs
    assert not (dropout & getattr(pair[0].truth, prefix + "flying")).any()


def test_shares_of_zero_give_a_clean_scan(clean):
    for name in ("dropout", "flying", "reference_dropout", "reference_flying"):
        assert not getattr(clean.truth, name).any()


def test_noise_scales():
    a, b = (layup(1, (128, 96), noise_mm=n, flying_share=0, dropout_share=0) for n in (0.0, 0.5))
    assert range_error(b, a, "scan")[:, 42:].std() == pytest.approx(0.5, rel=0.05)


# --- bad input ---


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": -1}, r"seed: expected a whole number of 0 .* got -1"),
        ({"seed": 1.5}, r"seed: .* got 1\.5"),
        ({"seed": True}, r"seed: .* got True"),
        ({"pixels": (8, 6)}, r"pixels: expected a whole number of 32 .* got 8"),
        ({"pixels": (-1280, 960)}, r"pixels: .* got -1280"),
        ({"pixels": (640.0, 480)}, r"pixels: .* got 640\.0"),
        ({"pixels": (64, 48, 3)}, r"pixels: expected \(width, height\)"),
        ({"pixels": 64}, r"pixels: expected \(width, height\), but got 64"),
        ({"pitch_mm": 0.0}, r"pitch_mm: expected a positive distance in mm or None, but got 0\.0"),
        ({"pitch_mm": -1}, r"pitch_mm: .* got -1"),
        ({"pitch_mm": float("nan")}, r"pitch_mm: .* got nan"),
        ({"pitch_mm": "fine"}, r"pitch_mm: .* got 'fine'"),
        ({"pitch_mm": 1.0}, r"pitch_mm: expected at least \d+\.\d+ mm, so that the mold fits into 64 x 48 pixels"),
        ({"noise_mm": -0.1}, r"noise_mm: .* got -0\.1"),
        ({"flying_share": 0.6}, r"flying_share: expected a share of 0 to 0\.5"),
        ({"dropout_share": float("inf")}, r"dropout_share: .* got inf"),
        ({"thickness_mm": 0.0}, r"thickness_mm: .* got 0\.0"),
        ({"cut_height_mm": 5.0}, r"cut_height_mm: expected a height of 1\.2 to 2\.2 mm, but got 5\.0"),
        ({"threads": 0}, r"threads: .* got 0"),
    ],
)
def test_bad_arguments(arguments, message):
    with pytest.raises(debulk.InputError, match=message):
        layup(**{"pixels": (64, 48), **arguments})


@pytest.mark.parametrize("xy", [3.0, [1.0, 2.0, 3.0], np.zeros((4, 3))])
def test_truth_refuses_other_shapes(xy):
    truth = layup(0, (64, 48)).truth
    with pytest.raises(debulk.InputError, match=r"xy: expected an array of shape \(\.\.\., 2\)"):
        truth.mold_height(xy)
    with pytest.raises(debulk.InputError, match="xy"):
        truth.ply_height_above_mold(xy)


def test_examples():
    result = doctest.testmod(importlib.import_module("debulk.scenes.scene"))
    assert result.attempted >= 3
    assert result.failed == 0


def test_who_changes_a_layup_changes_no_other_scan_of_it():
    one = layup(3, (64, 48))
    one.ply_outline[:] = 0
    for truth in (one.truth.pockets[0].outline_mm, one.truth.decoys[0].foot_outline_mm):
        with pytest.raises(ValueError, match="read-only"):
            truth[:] = 0
    assert layup(3, (64, 48), repeat=1).ply_outline.any()
