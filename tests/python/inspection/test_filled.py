"""What a scanner's own software fills in or clips has not been seen, and passes no pocket."""

from __future__ import annotations

import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest

import debulk
import laid_ply
from debulk import _core
from debulk.inspection.evidence.cloud_image import CloudImage
from debulk.inspection.rawscan.rounded import made_in
from debulk.inspection.rawscan.shared_noise import noise_is_shared, squares_on
from debulk.inspection.rawscan.vouched import UP, asked_in
from debulk.verdict import Verdict
from stranger_scenes import bump, cloud, flat, laid, outline, ridge_mm

SIZE, PLY = (460.0, 420.0), (420.0, 380.0)
RADIUS, HIGH, PITCH = 60.0, 9.5, 1.0
TOLD = "carry no measuring noise"
CAPTURES = Path(__file__).resolve().parents[4] / "shared" / "data" / "organised_clouds"


def _tilted(degrees):
    """Pose of a scanner that looks at the mold from 800 mm above, aslant."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    mold_from_scanner = np.eye(4)
    mold_from_scanner[:3, :3] = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.diag([1.0, -1.0, -1.0])
    mold_from_scanner[:3, 3] = -800 * mold_from_scanner[:3, 2]
    return mold_from_scanner


def _noise(kind, shape, rng):
    """Heights' errors of a kind, mm."""
    white = 0.03 * rng.standard_normal(shape)
    if kind == "correlated":
        return white / 2 + 0.3 * cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), 4)
    if kind == "banding":
        return white + 0.04 * np.sin(0.4 * np.arange(shape[1]))
    if kind == "highlights":
        y, x = np.mgrid[: shape[0], : shape[1]]
        return white * (1 + 9 * (np.hypot(y - 210, x - 160) < 40))
    if kind == "smoothed":  # by the scanner's own filter
        return cv2.blur(white, (3, 3))
    if kind == "median":
        return cv2.medianBlur(white.astype(np.float32), 5)
    if kind == "uneven":
        return white * np.linspace(0.4, 2, shape[1])
    return white


def _scans(kind="white", standing=None):
    surfaces = [laid(flat, standing or bump(RADIUS, HIGH), PLY), flat]
    scans = []
    for seed, surface in enumerate(surfaces, start=1):
        points = cloud(surface, SIZE, PITCH, seed, noise_mm=0.0)
        points[..., 2] += _noise(kind, points.shape[:2], np.random.default_rng(seed))
        if kind.startswith("quantised"):
            step = float(kind.split()[1])
            points[..., 2] = np.round(points[..., 2] / step) * step
        scans.append(points)
    return scans


def _within(points, radius_mm):
    return np.hypot(points[..., 0], points[..., 1]) < radius_mm


def _plane(points, radius_mm):
    inside = _within(points, radius_mm)
    rim = _within(points, radius_mm + 3) & ~inside
    terms = np.dstack([points[..., 0], points[..., 1], np.ones(inside.shape)])
    points[inside, 2] = terms[inside] @ np.linalg.lstsq(terms[rim], points[rim, 2], rcond=None)[0]


def _laplace(points, radius_mm):
    """Heights of no mean curvature between those of the rim, by relaxation; those of a rim that was smoothed."""
    inside, z = _within(points, radius_mm), points[..., 2]
    smooth = cv2.GaussianBlur(z, (0, 0), 3)
    z[inside] = z[_within(points, radius_mm + 3) & ~inside].mean()
    known = np.where(inside, z, smooth)
    for _ in range(4000):
        known = np.where(inside, cv2.filter2D(known, -1, np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]]) / 4), known)
    z[inside] = known[inside]


def _thin_plate(points, radius_mm):
    """A curved crown: the paraboloid that meets the rim's heights and slopes."""
    inside, z = _within(points, radius_mm), points[..., 2]
    rim = _within(points, radius_mm + 6) & ~_within(points, radius_mm)
    r2 = points[..., 0] ** 2 + points[..., 1] ** 2
    slope, base = np.polyfit(r2[rim], z[rim], 1)
    z[inside] = 0.3 * slope * (r2[inside] - radius_mm**2) + base + slope * radius_mm**2


def _constant(points, radius_mm):
    inside = _within(points, radius_mm)
    points[inside, 2] = np.median(points[_within(points, radius_mm + 3) & ~inside, 2])


def _clipped(points, high_mm):
    np.minimum(points[..., 2], high_mm, out=points[..., 2])


def _rounded(points, how, step):
    """Round heights as a scanner does: along z, as a disparity 800 mm below it, or as single precision far off."""
    z = points[..., 2]
    if how == "disparity":
        depth, whole = 800 - z, 800**2 / step
        z[:] = 800 - whole / np.round(whole / depth)
    elif how == "far":  # one step of single precision
        far = 2.0**23 * step
        z[:] = (z + 1.5 * far).astype(np.float32).astype(np.float64) - 1.5 * far
    else:
        z[:] = np.round(z / step) * step


def _inspected(scan, reference, pose=None, **recipe):
    pose = np.eye(4) if pose is None else pose
    scan, reference = ((points - pose[:3, 3]) @ pose[:3, :3] for points in (scan, reference))
    return debulk.inspect(scan, reference, debulk.Recipe(**recipe), outline(*PLY), mold_from_scanner=pose)


def _doubted(report):
    return report.verdict in (Verdict.UNDECIDED, Verdict.INVALID) and any(TOLD in one.reason for one in report.findings)


@pytest.mark.parametrize(
    ("fill", "size"),
    [(_plane, 30), (_plane, 58), (_plane, 15), (_laplace, 40), (_thin_plate, 35), (_constant, 45), (_clipped, 1.9),
     (_clipped, 0.5)],
)  # fmt: skip
def test_a_patch_without_noise_passes_no_pocket(fill, size):
    assert ridge_mm(bump(RADIUS, HIGH), RADIUS) > 0.9
    scan, reference = _scans()
    fill(scan, size)
    report = _inspected(scan, reference)
    assert _doubted(report) or (report.verdict is Verdict.CREASE and size < 20), report.reason


def test_a_patch_too_small_for_squares_is_found_by_its_pixels():
    standing = bump(10, 4.0)
    assert ridge_mm(standing, 10) > 0.9
    scan, reference = _scans(standing=standing)
    _plane(scan, 8.5)
    assert _doubted(_inspected(scan, reference))


@pytest.mark.parametrize("fill", [_plane, _clipped])
def test_it_is_found_from_aslant(fill):
    scan, reference = _scans()
    fill(scan, 45 if fill is _plane else 1.9)
    assert _doubted(_inspected(scan, reference, _tilted(20)))


@pytest.mark.parametrize("kind", ["correlated", "banding", "highlights", "smoothed", "median", "uneven"])
def test_it_is_found_in_other_noise(kind):
    scan, reference = _scans(kind)
    _plane(scan, 45)
    assert _doubted(_inspected(scan, reference))


@pytest.mark.parametrize("how", ["z", "disparity", "far"])
@pytest.mark.parametrize("late", [False, True])  # filled in after the rounding
@pytest.mark.parametrize(
    ("fill", "size", "step"),
    [(_plane, 30, 0.0625), (_laplace, 40, 0.0625), (_thin_plate, 35, 0.03125), (_constant, 45, 0.03125),
     (_clipped, 1.9, 0.0625)],
)  # fmt: skip
def test_it_is_found_in_a_rounded_scan(fill, size, step, late, how):
    """Up to twice the noise: a step hides what lies within half of it, but no noise reaches farther."""
    scan, reference = _scans()
    if late:
        _rounded(scan, how, step)
    fill(scan, size)
    if not late:
        _rounded(scan, how, step)
    _rounded(reference, how, step)
    assert _doubted(_inspected(scan, reference))


@pytest.mark.parametrize("kind", ["smoothed", "uneven", "banding", "correlated"])
def test_it_is_found_in_other_noise_that_is_rounded(kind):
    scan, reference = _scans(kind)
    _plane(scan, 45)
    step = 0.02 if kind == "smoothed" else 0.03
    _rounded(scan, "z", step), _rounded(reference, "z", step)
    report = _inspected(scan, reference)
    assert _doubted(report) or (kind in ("smoothed", "uneven") and _left_out(report))


def test_steps_that_hide_all_noise_are_said():
    """A patch that was filled in before the rounding cannot be told there; one that was filled in after it can."""
    scan, reference = _scans(standing=bump(60, 3.0))
    for points in (scan, reference):
        _rounded(points, "z", 0.2)
    report = _inspected(scan, reference)
    assert TOLD not in report.reason
    assert "steps of 0.2 mm" in _left_out(report)[0]
    late, _ = _scans()
    _rounded(late, "z", 0.2)
    _thin_plate(late, 35)
    assert _doubted(_inspected(late, reference))


def test_the_reason_names_the_patch():
    scan, reference = _scans()
    scan[..., 0] -= 20
    _plane(scan, 30)  # beside the crown
    scan[..., 0] += 20
    report = _inspected(scan, reference)
    assert report.verdict is Verdict.CREASE  # by the rest of the crown
    (found,) = [one for one in report.findings if one.check == "filled"]
    assert found.at_best is Verdict.UNDECIDED
    place, area = (20.0, 0.0), np.pi * 3.0**2
    words = found.reason.split(TOLD)[0].replace("(", "").replace(")", "").replace(",", "").split()
    at = words.index("cm²")
    assert float(words[at - 1]) == pytest.approx(area, rel=0.15)
    assert [float(words[at + 2]), float(words[at + 3])] == pytest.approx(place, abs=2.0)
    assert "hole filling" in found.reason


@pytest.mark.parametrize(
    "kind",
    ["white", "correlated", "banding", "highlights", "smoothed", "median", "uneven",
     *(f"quantised {step}" for step in (0.02, 0.05, 0.07, 0.1, 0.2, 1.0))],
)  # fmt: skip
def test_no_noise_is_taken_for_a_patch(kind):
    assert TOLD not in _inspected(*_scans(kind, bump(60, 3.0))).reason


@pytest.mark.parametrize("steps", [4, 4.5, 5.5, 7.5, 9.5])
@pytest.mark.parametrize("slope", [0.1, 0.2, 0.36, 0.7])
def test_coarse_steps_on_a_slope_are_not_told_from_a_patch(slope, steps):
    """Where the slope is a whole number of steps a pixel, plateaus are as quiet as what was filled in."""
    step, (y, x) = 0.03 * steps, 0.7 * np.mgrid[:400, :600].astype(np.float32)
    z = 800 + slope * x + ((x - 210) ** 2 + (y - 140) ** 2) / 40000
    z += 0.03 * np.random.default_rng(1).standard_normal(z.shape)
    scan = np.dstack([x, y, np.round(z / step) * step]).astype(np.float32)
    assert not _wide(scan, 0.7)


def _everywhere(at):
    return np.ones(len(at), dtype=bool)


def _parts(scan, pitch_mm, axes=(UP,)):
    """Parts of a scan, all of it ply, that software made, by the odds or in spite of rounded depths."""
    image = CloudImage(scan, scan, pitch_mm)
    asked = asked_in(image, axes)
    on_ply = np.isfinite(asked.points).all(axis=2)
    return made_in(image, asked, asked.points[..., :2], on_ply, axes)


def _wide(*given):
    return [part for part in _parts(*given)[0] if part.wide_mm > 8]  # narrower ones hide half of what creases


def _left_out(report):
    return [entry.why for entry in report.left_out if "filled in or clipped" in entry.what]


def test_what_cannot_be_looked_at_is_left_out():
    scan, reference = _scans("quantised 0.2", bump(60, 3.0))
    assert "rounded" in _left_out(_inspected(scan, reference))[0]
    scan, reference = _scans(standing=bump(60, 3.0))
    assert not _left_out(_inspected(scan, reference))
    assert "patches less than 25 mm wide" in _left_out(_inspected(scan[::2, ::2], reference))[0]
    assert not _left_out(_inspected(scan.reshape(-1, 3), reference.reshape(-1, 3)))


def test_an_image_of_one_row_or_column_is_too_small_to_look_at():
    scan, reference = _scans(standing=bump(60, 3.0))
    for shape in ((1, -1, 3), (-1, 1, 3)):
        report = _inspected(scan.reshape(shape), reference)
        assert _left_out(report) == ["the scan's image has not 12 rows and columns"]
        assert report.pockets[0].area_mm2 == pytest.approx(_inspected(scan, reference).pockets[0].area_mm2, rel=0.01)


def test_a_scan_without_any_noise_is_said():
    points = [cloud(surface, SIZE, PITCH, 0, noise_mm=0.0) for surface in (laid(flat, flat, PLY), flat)]
    assert "too little noise" in _left_out(_inspected(*points))[0]


def test_a_patch_that_the_mask_hides_is_no_patch():
    scan, reference = _scans()
    _plane(scan, 14)
    mask = _within(scan, 24)
    report = debulk.inspect(scan, reference, None, outline(*PLY), mold_from_scanner=np.eye(4), mask=mask)
    assert report.verdict is not Verdict.CEASE
    assert TOLD not in report.reason
    assert _doubted(_inspected(scan, reference)) or _inspected(scan, reference).verdict is Verdict.CREASE


def test_where_nothing_of_the_ply_was_seen_nothing_is_looked_for():
    scan, reference = _scans()
    scan[(np.abs(scan[..., 0]) < 215) & (np.abs(scan[..., 1]) < 195)] = np.nan
    report = _inspected(scan, reference)
    assert report.verdict is Verdict.INVALID
    assert TOLD not in report.reason


@pytest.mark.parametrize("slant", [0.0, 0.2])
@pytest.mark.parametrize("name", ["office1", "milk_cartoon_all_small_clorox"])
def test_steps_of_a_real_camera_are_no_patches(name, slant):
    path = CAPTURES / f"{name}.pcd"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    with warnings.catch_warnings():  # old versions of PCL wrote half a turn where they meant the identity
        warnings.simplefilter("ignore", debulk.files.CloudWarning)
        scan = np.asarray(debulk.files.load_cloud(path, unit="m"), dtype=np.float32)
    up = (slant, 0.0, float(np.sqrt(1 - slant**2)))
    squares = squares_on(scan, 1.0, 16.0, _everywhere)
    assert not _wide(scan, 1.0, (UP, up))
    image = CloudImage(scan, scan, 1.0)
    assert not any(noise_is_shared(image, squares, step) for step in (1, 2, 4))
    assert "rounded to steps" in _parts(scan, 1.0, (UP, up))[1]


def _rough(noise_mm, step_mm, late, patch=True, axes=(UP,)):
    """A slope with white noise, rounded to steps (0: not), and a part without noise in its middle, rounded or not."""
    y, x = np.mgrid[:200.0, :240.0]
    smooth = 800 + 0.013 * x + 0.021 * y + 1e-4 * x**2
    inside = patch & (np.hypot(x - 120, y - 100) < 30)
    z = smooth + np.where(inside, 0.0, noise_mm) * np.random.default_rng(1).standard_normal(x.shape)
    if step_mm:
        z = np.where(inside & late, z, np.round(z / step_mm) * step_mm)
    return np.dstack([x, y, z]).astype(np.float32)


def _is_middle(parts):
    (one,) = parts
    return np.hypot(one.centre_mm[0] - 120, one.centre_mm[1] - 100) < 3 and 45 < one.wide_mm < 70


@pytest.mark.parametrize("step_mm", [0.0, 0.01, 0.02, 0.05, 0.075])  # 0.4 steps of noise in the last
@pytest.mark.parametrize("late", [False, True])
def test_a_part_is_found_in_any_noise_that_steps_do_not_hide(step_mm, late):
    found, unknown = _parts(_rough(0.03, step_mm, late), 1.0)
    assert _is_middle(found)
    assert late or not unknown
    assert not _wide(_rough(0.03, step_mm, late, patch=False), 1.0)


def test_where_steps_hide_the_noise_only_what_was_filled_in_after_is_found():
    found, unknown = _parts(_rough(0.01, 0.1, late=False), 1.0)
    assert not found
    assert "steps of 0.1 mm" in unknown
    assert _is_middle(_parts(_rough(0.01, 0.1, late=True), 1.0)[0])


def test_the_steps_of_a_disparity_vary_with_the_depth():
    y, x = np.mgrid[:200.0, :240.0]
    whole = 800**2 / 0.1  # a step of 0.1 mm at 800 mm
    noise = 0.05 * np.random.default_rng(1).standard_normal(x.shape)
    for patch in (True, False):
        z = 740 + 0.513 * x + 0.021 * y + noise * ~(patch & (np.hypot(x - 120, y - 100) < 30))
        found, unknown = _parts(np.dstack([x, y, whole / np.round(whole / z)]).astype(np.float32), 1.0)
        assert _is_middle(found) if patch else not found
        assert not unknown


def test_heights_are_clipped_along_another_axis_than_the_scanners():
    y, x = np.mgrid[:200.0, :240.0]
    sideways, noise = 0.03 * np.random.default_rng(1).standard_normal((2, *x.shape))
    inside = np.hypot(x - 120, y - 100) < 30
    scan = np.dstack([x + sideways, y, 500 - 0.3 * x + np.where(inside, -0.3 * sideways, noise)]).astype(np.float32)
    assert not any(part.wide_mm > 20 for part in _parts(scan, 1.0)[0])
    assert _is_middle(_parts(scan, 1.0, (UP, tuple((np.array([0.3, 0.0, 1.0]) / np.hypot(0.3, 1)).tolist())))[0])


def test_the_search_heeds_a_stop_and_a_deadline_leaves_a_doubt(monkeypatch):
    inspector, scan = laid_ply.inspector(), laid_ply.scan(lambda x, y: 0 * x)
    assert inspector.inspect(scan).verdict is Verdict.CEASE
    image = inspector._image(scan, inspector._placing.look(scan, _core.Stop()))
    late, cancelled = _core.Stop(), _core.Stop()
    late.set_deadline(1e-9)
    filled = inspector._filled.find(image, late)
    assert "deadline" in filled.left_out()[0].why
    cancelled.cancel()
    with pytest.raises(_core.Stopped):
        inspector._filled.find(image, cancelled)
    monkeypatch.setattr(inspector._filled, "find", lambda *given: filled)
    report = inspector.inspect(scan)
    assert report.verdict is Verdict.UNDECIDED
    assert [one.check for one in report.findings if one.at_best is Verdict.UNDECIDED] == ["deadline"]
