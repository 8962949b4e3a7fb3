"""Triangulation: against planes and the truth of the virtual scanner."""

import numpy as np
import pytest

import plain_rows
from debulk import InputError
from debulk.scanner import Calibration, match, triangulate
from debulk.scanner.triangulate import triangulate_into


def test_the_cloud_is_a_pinholes(scanned):
    scan, _ = scanned
    f, cx, cy = scan.camera
    rows, columns = np.nonzero(np.isfinite(scan.points_mm[..., 2]))
    points = scan.points_mm[rows, columns].astype(np.float64)
    pixel = points[:, :2] / points[:, 2:] * f + [cx, cy]
    assert np.abs(pixel - np.column_stack([columns, rows])).max() < 1e-2


def test_the_cloud_is_the_truth(fringes, scanned):
    scan, _ = scanned
    truth = fringes.truth
    along = np.linalg.norm(scan.points_mm, axis=-1) - np.linalg.norm(truth.points_mm, axis=-1)
    there = np.isfinite(along) & truth.seen
    assert there.sum() > 0.97 * truth.seen.sum()
    assert abs(np.median(along[there])) < 0.02
    assert (np.abs(along[there]) > 3).mean() < 0.02  # on the edges of mold and ply
    # What was seen by one camera alone, or lay in shadow, hardly has points.
    assert np.isfinite(scan.points_mm[..., 2])[~truth.seen].sum() < 0.01 * truth.seen.sum()


def test_plain_phases_and_phases_give_the_same_points(fringes, scanned):
    scan, instrument = scanned
    plain = triangulate(instrument.left.phase_rad, instrument.right.phase_rad, fringes.calibration)
    assert np.array_equal(plain.points_mm, scan.points_mm, equal_nan=True)
    assert plain.epipolar is None
    assert np.nanmax(plain.uncertainty_mm) == 0


def test_same_bits_on_any_threads_and_instructions(fringes, scanned):
    _, instrument = scanned
    from debulk import _core

    def run(threads, widest):
        points, uncertainty = np.empty((480, 640, 3), np.float32), np.empty((480, 640), np.float32)
        triangulate_into(
            points, uncertainty, instrument.left, instrument.right, fringes.calibration, threads, _core.Stop(), widest
        )
        return points.tobytes() + uncertainty.tobytes()

    assert len({run(threads, widest) for threads in (1, 3) for widest in (2, 3, 4)}) == 1


def test_nothing_is_bridged(fringes, scanned):
    _, instrument = scanned
    left = instrument.left.phase_rad.copy()
    left[200:220, 300:320] = np.nan
    whole = triangulate(instrument.left.phase_rad, instrument.right.phase_rad, fringes.calibration)
    scan = triangulate(left, instrument.right.phase_rad, fringes.calibration)
    lost = np.isfinite(whole.points_mm[..., 2]) & np.isnan(scan.points_mm[..., 2])
    assert 330 <= lost.sum() <= 700
    assert np.array_equal(scan.points_mm[~lost], whole.points_mm[~lost], equal_nan=True)


@pytest.mark.parametrize(("dropped", "off_order"), [(0, 0), (0.01, 0), (0.03, 0), (0, 0.01)])
def test_as_complete_as_a_plain_row_search_and_less_often_wrong(fringes, dropped, off_order):
    rng = np.random.default_rng(7)
    phases = []
    for true in (fringes.truth.left_phase_rad, fringes.truth.right_phase_rad):
        phase = true + rng.normal(0, 0.03, true.shape).astype(np.float32)
        phase[rng.random(true.shape) < dropped] = np.nan
        phase += 2 * np.pi * rng.choice([-1, 1], true.shape) * (rng.random(true.shape) < off_order)
        phases.append(phase.astype(np.float32))
    rectified = fringes.calibration.rectified
    rows = np.arange(2, 480, 7)
    depth = triangulate(*phases, fringes.calibration).points_mm[rows, :, 2]
    scale = rectified.focal_px * rectified.baseline_mm
    true = scale / fringes.truth.points_mm[rows, :, 2]
    mine = scale / depth
    plain = plain_rows.disparity(*phases, rectified, rows) + rectified.right_cx - rectified.left_centre[0]
    wrong = [np.count_nonzero(np.abs(found - true) > 1) / np.isfinite(found).sum() for found in (mine, plain)]
    assert np.isfinite(mine).sum() > 0.95 * np.count_nonzero(np.abs(plain - true) <= 1)
    assert wrong[0] < 0.0005
    assert wrong[0] <= wrong[1]


def sphere_seen(matrix, distortion, rotation, translation, pixels, centre, radius):
    """Phases that a camera sees on a sphere in the left camera's frame; fringes stand upright in space."""
    import cv2

    grid = np.stack(np.meshgrid(*(np.arange(n, dtype=np.float64) for n in pixels)), axis=-1).reshape(-1, 1, 2)
    flat = cv2.undistortPoints(grid, np.array(matrix), np.array(distortion)).reshape(-1, 2)
    rays = np.column_stack([flat, np.ones(len(flat))]) @ rotation
    place = -rotation.T @ translation
    along, off = rays @ (place - centre), (place - centre) @ (place - centre) - radius**2
    square = (rays**2).sum(axis=1)
    root = along**2 - square * off
    distance = np.where(root > 0, (-along - np.sqrt(np.maximum(root, 0))) / square, np.nan)
    points = place + distance[:, None] * rays
    return (2 * np.pi * 64 * np.arctan2(points[:, 0] + 300, points[:, 2])).reshape(pixels[::-1]).astype(np.float32)


@pytest.mark.parametrize("toed_in_deg", [0.0, 20.0])
def test_cameras_that_are_toed_in_lose_no_resolution(toed_in_deg):
    angle = np.radians(toed_in_deg)
    rotation = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    place = np.array([200.0, 0, -40.0]) if toed_in_deg else np.array([200.0, 0, 0])
    matrices, lenses = [matrix(880), matrix(890)], [[0.02, -0.03, 1e-3, -1e-3, 0], [-0.01, 0.02, 0, 1e-3, 0]]
    calibration = Calibration(matrices, lenses, rotation, -rotation @ place, (640, 480))
    centre, radius = np.array([60.0, 0, 1000]), 180.0
    left, right = (
        sphere_seen(k, d, r, t, (640, 480), centre, radius)
        for k, d, r, t in zip(matrices, lenses, (np.eye(3), rotation), (np.zeros(3), -rotation @ place), strict=True)
    )
    scan = triangulate(left, right, calibration)
    rectified = calibration.rectified
    assert (rectified.pixels == (640, 480)) == (toed_in_deg == 0)
    assert scan.points_mm.shape == (*rectified.pixels[::-1], 3)
    assert rectified.focal_px > 0.95 * 880
    known = np.isfinite(scan.points_mm[..., 2])
    assert known.sum() > 0.8 * np.isfinite(left).sum()  # the right camera does not see the sphere's left side
    off = np.abs(np.linalg.norm(scan.points_mm[known] @ rectified.rotation - centre, axis=1) - radius)
    assert np.quantile(off, 0.95) < 0.1
    assert (off > 1).mean() < 0.002  # at the rim, where the sphere turns away


def test_bad_phases_are_named(fringes):
    with pytest.raises(InputError, match=r"left: expected phases of shape \(480, 640\)"):
        triangulate(np.zeros((5, 40)), np.zeros((5, 40)), fringes.calibration)
    with pytest.raises(InputError, match="right: expected 8 rows"):
        match(np.zeros((8, 40)), np.zeros((9, 40)))
    with pytest.raises(InputError, match="find a partner in their row"):
        along = np.repeat(np.linspace(0, 300, 480)[:, None], 640, axis=1)
        triangulate(along, along, fringes.calibration)


def matrix(f=1000.0):
    return [[f, 0, 320], [0, f, 240], [0, 0, 1]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"camera_matrices": [matrix()]}, "camera_matrices: expected finite numbers of shape"),
        ({"camera_matrices": [matrix(), matrix(-1)]}, "camera_matrices: expected \\[\\[fx"),
        ({"distortions": np.zeros((2, 3))}, "distortions: expected two rows"),
        ({"rotation": 2 * np.eye(3)}, "rotation: expected a rotation"),
        ({"translation_mm": (0, 0, 0)}, "translation_mm: expected the way"),
        ({"translation_mm": (np.nan, 0, 0)}, "translation_mm: expected finite"),
        ({"pixels": (640,)}, "pixels: expected"),
    ],
)
def test_bad_calibrations_are_named(change, message):
    good = {
        "camera_matrices": [matrix(), matrix()], "distortions": np.zeros((2, 5)), "rotation": np.eye(3),
        "translation_mm": (-100, 0, 0), "pixels": (640, 480),
    }  # fmt: skip
    with pytest.raises(InputError, match=message):
        Calibration(**{**good, **change})


def test_cameras_that_stand_wrongly_are_named():
    for way, message in (((100, 0, 0), "to the left: exchange them"), ((0, -100, 0), "above or below")):
        calibration = Calibration([matrix(), matrix()], np.zeros((2, 5)), np.eye(3), way, (640, 480))
        with pytest.raises(InputError, match=message):
            calibration.rectified  # noqa: B018


def test_a_calibration_survives_its_file(tmp_path, fringes):
    fringes.calibration.save(tmp_path / "c.json")
    again = Calibration.load(tmp_path / "c.json")
    for name in ("camera_matrices", "distortions", "rotation", "translation_mm"):
        assert np.array_equal(getattr(again, name), getattr(fringes.calibration, name))
    assert again.pixels == fringes.calibration.pixels
    for text in (
        "",
        "{}",
        "[1]",
        '{"debulk scanner calibration": 1}',
        '{"debulk scanner calibration": 1, "pixels": [1, 2]}',
    ):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(InputError, match=r"bad\.json: "):
            Calibration.load(tmp_path / "bad.json")
    with pytest.raises(InputError, match="cannot be read"):
        Calibration.load(tmp_path / "none.json")
