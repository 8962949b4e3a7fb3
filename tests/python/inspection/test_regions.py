"""Regions of interest find what the whole scan shows: the same pockets, areas to a thousandth, nothing missed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import debulk
from debulk.inspection.find import whole_scan
from debulk.inspection.find.found import Found
from debulk.inspection.find.front import FrontEnd
from debulk.inspection.find.regions import RegionFinder
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import options

Floats = NDArray[np.float64]


def without_regions(recipe: debulk.Recipe) -> debulk.Recipe:
    return recipe.model_copy(update={"segmentation": {"regions": False}})


@pytest.fixture
def of_any_share(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small images are processed by regions, too, though these are most of the image."""
    made = options.regions

    def regions(*given: Any) -> Any:
        wanted = made(*given)
        wanted.largest_share = 0.8
        return wanted

    monkeypatch.setattr(options, "regions", regions)


def pockets(found: Found) -> list[debulk.pocket.Pocket]:
    return [one.pocket for one in found.pockets]


def feet(found: Found) -> list[debulk.pocket.Foot]:
    return [one.foot for one in found.pockets]


def assert_same(regions: Found, whole: Found, tolerance: float = 1e-3) -> None:
    ours, theirs = pockets(regions), pockets(whole)
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs, strict=True):
        assert a.area_mm2 == pytest.approx(b.area_mm2, rel=tolerance)
        assert a.volume_mm3 == pytest.approx(b.volume_mm3, rel=2 * tolerance)
        assert a.peak_mm == pytest.approx(b.peak_mm, abs=0.02)
        assert np.allclose(a.centroid_mm, b.centroid_mm, atol=0.2)
        assert (a.touches_ply_edge, a.touches_unknown) == (b.touches_ply_edge, b.touches_unknown)
    for f, g in zip(feet(regions), feet(whole), strict=True):
        assert f.area_mm2 == pytest.approx(g.area_mm2, rel=3 * tolerance)
        assert (f.closed, f.touches_ply_edge, f.parted) == (g.closed, g.touches_ply_edge, g.parted)


@dataclass
class Bench:
    """A flat mold under a pinhole camera, and what is laid on it."""

    tilt_deg: float = 0.0
    width: int = 448
    height: int = 384
    pitch_mm: float = 0.5

    def __post_init__(self) -> None:
        self.depth_mm = 800.0
        self.f = self.depth_mm / self.pitch_mm
        tilt = np.deg2rad(self.tilt_deg)
        c, s = np.cos(tilt), np.sin(tilt)
        # x to the right, y up, z towards the camera; then tilted about x.
        self.pose = np.eye(4)
        self.pose[:3, :3] = np.array([[1, 0, 0], [0, -c, -s], [0, s, -c]])
        self.pose[:3, 3] = -self.pose[:3, :3] @ np.array([0, 0, self.depth_mm])
        i, j = np.meshgrid(np.arange(self.width), np.arange(self.height))
        self.rays = np.dstack(
            [(i - (self.width - 1) / 2) / self.f, (j - (self.height - 1) / 2) / self.f, np.ones(i.shape)]
        )
        self.turned = self.rays @ self.pose[:3, :3].T
        flat = self.scan(lambda x, y: np.zeros_like(x), np.random.default_rng(0), noise_mm=0.01)
        outline = 0.98 * 0.5 * self.pitch_mm * np.array([self.width, self.height])
        self.outline = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (outline - 4.0)
        recipe = debulk.Recipe()
        self.regions = debulk.Inspector(recipe, flat, self.outline, mold_from_scanner=self.pose)
        self.whole = debulk.Inspector(
            without_regions(recipe), self.regions.prepared, self.outline, mold_from_scanner=self.pose
        )

    def scan(
        self, height, rng: np.random.Generator, noise_mm: float = 0.05, flying: float = 0.0
    ) -> NDArray[np.float32]:
        """What the camera sees of z = height(x, y), by fixed-point iteration along the rays."""
        o = self.pose[:3, 3]
        z = np.zeros(self.rays.shape[:2])
        for _ in range(12):
            depth = (z - o[2]) / self.turned[..., 2]
            z = height(o[0] + depth * self.turned[..., 0], o[1] + depth * self.turned[..., 1])
        depth = (z - o[2]) / self.turned[..., 2] + noise_mm * rng.standard_normal(z.shape)
        wild = rng.random(z.shape) < flying
        depth[wild] += rng.uniform(1, 20, wild.sum()) * rng.choice([-1, 1], wild.sum())
        return (depth[..., None] * self.rays).astype(np.float32)

    def both(self, scan: NDArray[np.float32]) -> tuple[Found, Found]:
        return self.regions.find(scan), self.whole.find(scan)


@pytest.fixture(scope="module")
def level() -> Bench:
    return Bench()


def ridge(width_mm: float, length_mm: float, angle_deg: float, at: tuple[float, float], height_mm: float = 6.0):
    """A straight ridge, raised cosine across, with rounded ends; width at the cut of 2 mm over a ply of 0.3 mm."""
    c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    foot = width_mm / 2 / (np.arccos(2 * (2.0 - 0.3) / height_mm - 1) / np.pi)

    def height(x: Floats, y: Floats) -> Floats:
        u, v = c * (x - at[0]) + s * (y - at[1]), c * (y - at[1]) - s * (x - at[0])
        rho = np.hypot(np.maximum(np.abs(u) - length_mm / 2, 0), v) / foot
        return 0.3 + 0.5 * height_mm * (1 + np.cos(np.pi * np.minimum(rho, 1)))

    return height


@pytest.mark.parametrize("angle_deg", [0, 1, 3, 20, 45, 70, 88, 90])
def test_narrow_ridges_in_any_direction_and_phase(level: Bench, angle_deg: float) -> None:
    rng = np.random.default_rng(angle_deg)
    for phase in range(3):
        at = tuple(rng.uniform(-2, 2, 2) + phase)
        found, whole = level.both(level.scan(ridge(3.0, 110.0, angle_deg, at), rng))
        assert found.regions
        assert len(pockets(whole)) == 1
        assert_same(found, whole, 2e-3)


def test_what_the_bound_allows_is_not_a_pocket_of_the_whole_scan(level: Bench) -> None:
    rng = np.random.default_rng(5)
    missed = 0
    for width in (0.4, 0.7, 1.0, 1.5, 2.0, 2.5):  # down to below a pixel: the whole scan has no pocket either
        for angle in (0.0, 30.0, 90.0):
            found, whole = level.both(
                level.scan(ridge(width, 160.0, angle, tuple(rng.uniform(-2, 2, 2)), 12.0), rng, 0.02)
            )
            assert len(pockets(found)) == len(pockets(whole)), (width, angle)
            missed += not pockets(whole)
    assert missed > 0


@settings(max_examples=20, deadline=None, print_blob=True)
@given(
    width_mm=st.floats(2.0, 9.0),
    length_mm=st.floats(20.0, 130.0),
    height_mm=st.floats(3.5, 12.0),
    angle_deg=st.floats(0.0, 180.0),
    place=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    noise_mm=st.floats(0.01, 0.12),
    seed=st.integers(0, 10**6),
)
def test_a_ridge_of_any_size_at_any_place(
    level: Bench,
    width_mm: float,
    length_mm: float,
    height_mm: float,
    angle_deg: float,
    place: tuple[float, float],
    noise_mm: float,
    seed: int,
) -> None:
    """Up to the ply's edge and past it; also of such an area that it is just a pocket, or just none.

    Other examples in every run. Close to a limit the two ways may call a bump differently, but both must see it alike.
    """
    at = (place[0] * level.outline[1, 0], place[1] * level.outline[2, 1])
    scan = level.scan(ridge(width_mm, length_mm, angle_deg, at, height_mm), np.random.default_rng(seed), noise_mm)
    found, whole = level.both(scan)
    assert found.regions
    if not any(is_close_to_a_limit(bump) for bump in bumps(whole)):
        assert_same(found, whole, 3e-3)
    for bump in (*pockets(found), *pockets(whole)):
        others = [b for b in bumps(whole if bump in pockets(found) else found) if near(bump, b)]
        assert len(others) == 1
        assert others[0].area_mm2 == pytest.approx(bump.area_mm2, rel=3e-3)
        assert others[0].peak_mm == pytest.approx(bump.peak_mm, abs=0.02)


def bumps(found: Found) -> list[debulk.pocket.Pocket | debulk.pocket.Dropped]:
    return [*pockets(found), *found.dropped]


def near(a: debulk.pocket.Pocket | debulk.pocket.Dropped, b: debulk.pocket.Pocket | debulk.pocket.Dropped) -> bool:
    return bool(np.linalg.norm(a.centroid_mm - b.centroid_mm) < 0.5)


def is_close_to_a_limit(bump: debulk.pocket.Pocket | debulk.pocket.Dropped) -> bool:
    return abs(bump.area_mm2 / 200 - 1) < 3e-3 or abs(bump.peak_mm - 3.25) < 0.02


@pytest.mark.parametrize("noise_mm", [0.15, 0.3])
def test_a_ridge_in_strong_noise(level: Bench, noise_mm: float) -> None:
    rng = np.random.default_rng(1)
    found, whole = level.both(level.scan(ridge(4.0, 100.0, 12.0, (3.3, 1.7)), rng, noise_mm))
    assert len(pockets(whole)) == 1
    assert len(pockets(found)) == 1
    assert pockets(found)[0].area_mm2 == pytest.approx(pockets(whole)[0].area_mm2, rel=1e-2)


def test_flying_pixels_neither_hide_a_ridge_nor_make_regions_everywhere(level: Bench) -> None:
    rng = np.random.default_rng(2)
    found, whole = level.both(level.scan(ridge(4.0, 80.0, 90.0, (10.0, 5.0)), rng, 0.05, flying=0.01))
    assert found.regions
    assert_same(found, whole, 3e-3)
    assert found.regions.image_share < 0.4


def test_pockets_at_the_plys_edge_and_at_the_image_border(level: Bench) -> None:
    rng = np.random.default_rng(3)
    x = level.outline[1, 0]
    found, whole = level.both(level.scan(ridge(12.0, 60.0, 90.0, (x, 0.0)), rng))
    assert pockets(whole)[0].touches_ply_edge
    assert_same(found, whole)
    no_outline = {"mold_from_scanner": level.pose}
    regions = debulk.Inspector(None, level.regions.prepared, None, **no_outline)
    plain = debulk.Inspector(without_regions(debulk.Recipe()), level.regions.prepared, None, **no_outline)
    scan = level.scan(ridge(12.0, 60.0, 0.0, (0.0, 0.5 * level.pitch_mm * level.height)), rng)
    found, whole = regions.find(scan), plain.find(scan)
    assert len(pockets(whole)) == 1
    assert_same(found, whole)


def test_holes_beside_and_on_a_pocket(level: Bench) -> None:
    rng = np.random.default_rng(4)
    scan = level.scan(ridge(14.0, 50.0, 30.0, (0.0, 0.0), 8.0), rng)
    row, column = np.mgrid[: level.height, : level.width]
    for at, radius in (((192, 224), 8), ((160, 260), 12), ((230, 200), 6), ((200, 236), 5)):
        scan[np.hypot(row - at[0], column - at[1]) < radius] = np.nan
    scan[rng.random(scan.shape[:2]) < 0.02] = np.nan
    found, whole = level.both(scan)
    assert len(pockets(whole)) == 1
    assert_same(found, whole, 2e-3)


def test_a_tilted_camera() -> None:
    bench = Bench(tilt_deg=25.0)
    rng = np.random.default_rng(6)
    for angle, at in ((10.0, (-30.0, -40.0)), (95.0, (30.0, 35.0))):
        found, whole = bench.both(bench.scan(ridge(8.0, 60.0, angle, at, 9.0), rng))
        assert found.regions
        assert len(pockets(whole)) == 1
        assert_same(found, whole)


def test_what_is_missing_outside_the_regions_lowers_the_coverage(level: Bench) -> None:
    rng = np.random.default_rng(7)
    scan = level.scan(ridge(10.0, 40.0, 30.0, (-60.0, 0.0)), rng)
    scan[100:200, 330:400] = np.nan  # 50 by 35 mm, no pocket near
    a, b = level.regions.inspect(scan), level.whole.inspect(scan)
    assert level.regions.find(scan).regions
    assert a.verdict is b.verdict is debulk.Verdict.INVALID
    assert a.coverage == pytest.approx(b.coverage, abs=3e-3)
    # Points that are there but scattered tell no height: nor do they count as seen.
    scan = level.scan(ridge(10.0, 40.0, 30.0, (-60.0, 0.0)), rng)
    scan[100:200, 330:400] *= (1 - np.abs(rng.normal(0, 0.05, (100, 70, 1)))).astype(np.float32)
    assert level.regions.find(scan).unseen.coverage < 0.97


def test_the_mask_hides_pixels_without_a_copy(level: Bench) -> None:
    scan = level.scan(ridge(12.0, 60.0, 30.0, (0.0, 0.0)), np.random.default_rng(8))
    clamp = scan.copy()
    clamp[20:120, 20:120] *= 0.97  # a tool, 24 mm above
    mask = np.zeros(scan.shape[:2], dtype=np.bool_)
    mask[16:124, 16:124] = True
    outline, pose = level.outline, level.pose
    masked = debulk.Inspector(None, level.regions.prepared, outline, mold_from_scanner=pose, mask=mask)
    whole = debulk.Inspector(
        without_regions(debulk.Recipe()), level.regions.prepared, outline, mold_from_scanner=pose, mask=mask
    )
    before = clamp.copy()
    found = masked.find(clamp)
    assert found.regions
    assert_same(found, whole.find(clamp))
    assert found.unseen.coverage == pytest.approx(
        whole.find(clamp).unseen.coverage, abs=0.01
    )  # a row of points, 2 mm apart
    assert np.array_equal(before, clamp, equal_nan=True)


def test_a_mask_of_another_shape_is_refused_by_both_finders(level: Bench) -> None:
    scan = level.scan(ridge(12.0, 60.0, 30.0, (0.0, 0.0)), np.random.default_rng(8))
    mask = np.zeros((level.height, level.width - 1), dtype=np.bool_)
    for recipe in (debulk.Recipe(), without_regions(debulk.Recipe())):
        inspector = debulk.Inspector(
            recipe, level.regions.prepared, level.outline, mold_from_scanner=level.pose, mask=mask
        )
        with pytest.raises(debulk.InputError, match=r"mask: expected the shape of the scan's image, \(384, 448\)"):
            inspector.find(scan)


def test_scans_that_regions_do_not_take_are_processed_whole(level: Bench) -> None:
    scan = level.scan(ridge(12.0, 60.0, 30.0, (0.0, 0.0)), np.random.default_rng(9))
    other = scan[:, :-8]
    for points in (other, scan.reshape(-1, 3)):
        found = level.regions.find(points)
        assert not found.regions
        assert "regions of interest" in {entry.what for entry in found.left_out}
        assert len(pockets(found)) == 1
    bent = scan + np.float32([3.0, 0, 0])  # off its rays
    assert not level.regions.find(bent).regions
    high = level.scan(lambda x, y: np.full_like(x, 5.0), np.random.default_rng(9))
    assert not level.regions.find(high).regions
    in_metres = level.regions.inspect(scan / 1000)
    assert in_metres.verdict is debulk.Verdict.INVALID and "metres" in in_metres.reason
    with pytest.raises(debulk.InputError, match="finite"):
        level.regions.inspect(np.full_like(scan, np.nan))


def test_the_reason_for_the_whole_scan_is_the_true_one(level: Bench) -> None:
    scan = level.scan(ridge(12.0, 60.0, 30.0, (0.0, 0.0)), np.random.default_rng(9))

    def why(inspector: debulk.Inspector, points: Floats) -> str:
        (entry,) = [e for e in inspector.find(points).left_out if e.what == "regions of interest"]
        return entry.why

    pose, outline, seen = level.pose, level.outline, level.regions.prepared
    every = debulk.Recipe(segmentation={"area_tol_mm2": 0})
    assert "area tolerance of 0" in why(debulk.Inspector(every, seen, outline, mold_from_scanner=pose), scan)
    assert "another shape" in why(level.regions, scan[:, :-8])
    no_camera = Prepared(seen.reference, seen.seen, seen.grid_spacing_mm)
    assert "not an image of a pinhole" in why(debulk.Inspector(None, no_camera, outline, mold_from_scanner=pose), scan)
    assert "not an image of the camera" in why(level.regions, scan + np.float32([3.0, 0, 0]))
    assert not [e for e in level.whole.find(scan).left_out if e.what == "regions of interest"]  # not asked for


def test_the_first_cycle_finds_everything_prepared(level: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def counted(*args, **options) -> FrontEnd:
        made.append(1)
        return FrontEnd(*args, **options)

    monkeypatch.setattr(whole_scan, "FrontEnd", counted)
    pose, outline, seen = level.pose, level.outline, level.regions.prepared
    scan = level.scan(ridge(12.0, 60.0, 30.0, (0.0, 0.0)), np.random.default_rng(9))
    no_camera = Prepared(seen.reference, seen.seen, seen.grid_spacing_mm)
    # Beside regions the front end of whole scans, and its memory, waits until a scan needs it.
    for recipe, prepared, count in (
        (debulk.Recipe(), seen, 0),
        (without_regions(debulk.Recipe()), seen, 1),
        (debulk.Recipe(), no_camera, 1),
    ):
        made.clear()
        inspector = debulk.Inspector(recipe, prepared, outline, mold_from_scanner=pose)
        assert len(made) == count
        inspector.find(scan)
        assert len(made) == count


def test_results_that_are_held_do_not_change(level: Bench) -> None:
    scans = [level.scan(ridge(12.0, 60.0, angle, (0.0, 0.0)), np.random.default_rng(9)) for angle in (30.0, 80.0)]

    def look(scan: Floats) -> Found:
        found = level.regions.find(scan)
        assert found.regions
        return found

    def arrays(found: Found) -> list[NDArray]:
        ((segmentation, feet),) = found.parts
        maps = segmentation.labels, segmentation.heights, feet.labels, feet.heights, found.overview
        return [grid.values for grid in maps]

    first = look(scans[0])
    copies = [values.copy() for values in arrays(first)]
    second = look(scans[1])
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(arrays(first), copies, strict=True))
    assert not np.array_equal(arrays(first)[0], arrays(second)[0])
    place = second.parts[0][0].heights.values.ctypes.data
    del second
    assert look(scans[1]).parts[0][0].heights.values.ctypes.data == place  # nobody held it
    # Nor does a report.
    report = level.regions.inspect(scans[0])
    outlines = [p.outline_mm.copy() for p in report.pockets]
    heights = report.height_map.values.copy()
    level.regions.inspect(scans[1])
    assert np.array_equal(report.height_map.values, heights, equal_nan=True)
    assert all(np.array_equal(p.outline_mm, o) for p, o in zip(report.pockets, outlines, strict=True))


@pytest.mark.parametrize("stage", ["height map", "debulk"])
def test_a_cancelled_cycle_leaves_the_next_one_right(level: Bench, stage: str) -> None:
    scan = level.scan(ridge(12.0, 60.0, 30.0, (0.0, 0.0)), np.random.default_rng(9))
    inspector = level.regions
    expected = inspector.inspect(scan)

    def cancel(name: str, share: float) -> None:
        if name == stage:
            inspector.cancel()

    with pytest.raises(debulk.Cancelled):
        inspector.inspect(scan, progress=cancel)
    for deadline_s in (1e-6, 1e-3, 3e-3, 1e-2):
        late = inspector.inspect(scan, deadline_s=deadline_s)
        assert late.verdict in (debulk.Verdict.UNDECIDED, debulk.Verdict.INVALID, expected.verdict)
    again = inspector.inspect(scan)
    assert [p.verdict for p in again.pockets] == [p.verdict for p in expected.pockets]
    for a, b in zip(again.pockets, expected.pockets, strict=True):
        assert np.array_equal(a.outline_mm, b.outline_mm)
        assert a.rms_mm == b.rms_mm


def test_the_same_bits_on_any_number_of_threads(level: Bench) -> None:
    rng = np.random.default_rng(10)
    scan = level.scan(ridge(9.0, 60.0, 30.0, (0.0, 0.0)), rng, flying=0.005)
    results = []
    for threads in (1, 2, 4):
        recipe = debulk.Recipe(run={"threads": threads})
        inspector = debulk.Inspector(recipe, level.regions.prepared, level.outline, mold_from_scanner=level.pose)
        found = inspector.find(scan)
        assert found.regions
        results.append((found.unseen.coverage, found.overview.values, *(f.outline_mm for f in feet(found))))
    for other in results[1:]:
        for a, b in zip(results[0], other, strict=True):
            assert np.array_equal(a, b, equal_nan=True)


@pytest.mark.usefixtures("of_any_share")
def test_windows_grow_until_they_hold_what_a_sparse_mesh_saw_in_part() -> None:
    layup = debulk.scenes.layup(seed=1, pixels=(1280, 960))
    inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    found = RegionFinder(inspector.setup, mesh=(16, 256)).find(layup.scan)  # a row in 18 mm
    assert found.regions
    assert (found.regions.rows, found.regions.columns) == (16, 256)
    other = inspector.find(layup.scan)
    assert_same(found, other)
    for a, b in zip(pockets(found), pockets(other), strict=True):  # what a window took over is what it would have made
        assert np.array_equal(a.outline_mm, b.outline_mm)
    with pytest.raises(debulk.InputError, match="mesh"):
        RegionFinder(inspector.setup, mesh=(0, 64))


def test_a_scan_of_which_regions_are_more_than_half_is_read_whole() -> None:
    layup = debulk.scenes.layup(seed=3, pixels=(1280, 960))
    inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    found = inspector.find(layup.scan)
    assert found.regions is None
    assert [one.why for one in found.left_out] == ["what stands up covers most of the scan"]


@pytest.mark.usefixtures("of_any_share")
def test_flying_pixels_do_not_make_windows_grow_into_each_other() -> None:
    layup = debulk.scenes.layup(seed=3, pixels=(1280, 960))
    inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    found = inspector.find(layup.scan)
    assert found.regions
    assert found.regions.windows == 4  # they grew into 2 where pairs of flying pixels counted as what stands up


@pytest.mark.usefixtures("of_any_share")
@pytest.mark.parametrize("seed", [0, 3])
def test_virtual_layups(seed: int) -> None:
    layup = debulk.scenes.layup(seed=seed, pixels=(1280, 960))
    regions = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    whole = debulk.Inspector(
        without_regions(debulk.Recipe()), regions.prepared, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner
    )
    found = regions.find(layup.scan)
    assert found.regions
    assert_same(found, whole.find(layup.scan))
    a, b = regions.inspect(layup.scan), whole.inspect(layup.scan)
    assert [p.verdict for p in a.pockets] == [p.verdict for p in b.pockets]
    assert a.verdict is b.verdict
    assert a.coverage == pytest.approx(b.coverage, abs=2e-3)
    assert a.height_map is not None
    assert np.nanmedian(np.abs(a.height_map.values)) < 0.5
