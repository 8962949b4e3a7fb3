"""The projector as a third view: a camera that was turned about the upright is named, though its rows still agree."""

import json

import cv2
import numpy as np
import pytest

from debulk import InputError, scenes
from debulk.scanner import Calibration, Scanner, calibrate_projector, triangulate
from debulk.scanner.third_view import learn


@pytest.fixture(scope="module")
def known(layup, fringes):
    """The calibration with the projector, learnt from a scan of the bare mold."""
    bare = scenes.fringe_images(layup, pixels=(640, 480), bare=True)
    return calibrate_projector(fringes.calibration, [(bare.left, bare.right)])


def turned(calibration, axis, degrees):
    """The calibration as it would be, had the right camera been turned back."""
    turn = cv2.Rodrigues(np.deg2rad(degrees) * np.eye(3)[axis])[0]
    return Calibration(
        calibration.camera_matrices,
        calibration.distortions,
        turn @ calibration.rotation,
        turn @ calibration.translation_mm,
        calibration.pixels,
        projector=calibration.projector,
    )


def test_cameras_that_stand_as_they_stood_agree_with_it(known, fringes):
    scan = Scanner(known).scan(fringes.left, fringes.right)  # a ply, where a bare mold was learnt from
    assert scan.projector_mm < 0.1
    assert np.isnan(Scanner(known.with_projector(None)).scan(fringes.left, fringes.right).projector_mm)


@pytest.mark.parametrize("degrees", [0.01, -0.01, 0.3])
def test_a_camera_turned_about_the_upright_is_named(known, fringes, scanned, degrees):
    _, instrument = scanned
    unseen = triangulate(instrument.left, instrument.right, turned(known, 1, degrees).with_projector(None))
    assert unseen.epipolar.error_px < 0.4  # the rows say nothing
    with pytest.raises(InputError, match=r"differ by \d+\.\d\d mm: a camera or the projector was moved"):
        Scanner(turned(known, 1, degrees)).scan(fringes.left, fringes.right)


def test_it_survives_its_file(known, tmp_path):
    known.save(tmp_path / "c.json")
    again = Calibration.load(tmp_path / "c.json").projector
    points = np.random.default_rng(0).uniform([-500, -400, 2300], [500, 400, 2500], (50, 3))
    assert np.array_equal(again.at(points), known.projector.at(points))
    data = json.loads((tmp_path / "c.json").read_text())
    for spoilt in (
        {},
        [1],
        {**data["projector"], "pinhole": [[1, 2]]},
        {**data["projector"], "lens": [float("nan")] * 7},
    ):
        (tmp_path / "bad.json").write_text(json.dumps({**data, "projector": spoilt}))
        with pytest.raises(InputError, match=r"bad\.json: projector: expected"):
            Calibration.load(tmp_path / "bad.json")


def seen_by_a_bent_lens(points):
    """Places in the field of a projector 210 mm beside the camera, tilted, whose lens pulls the corners in by 0.4 %."""
    turn = cv2.Rodrigues(np.array([0.02, -0.08, 0.01]))[0]
    x, y, z = (points @ turn.T + [-210.0, 30.0, 15.0]).T
    a, b = x / z, y / z
    return 0.5 + 1.7 * a * (1 - 0.04 * (a * a + b * b))


def plate(z, tilt, rng):
    xy = rng.uniform([-550, -400], [550, 400], (6000, 2))
    return np.column_stack([xy, z + tilt * xy[:, 0]])


def test_plates_at_three_distances_determine_it_and_its_lens():
    rng = np.random.default_rng(1)
    views = [plate(2300, 0.0, rng), plate(2400, 0.1, rng), plate(2500, -0.1, rng)]
    found = learn([(p, seen_by_a_bent_lens(p) + rng.normal(0, 2e-5, len(p))) for p in views])
    other = plate(2440, 0.03, rng)
    assert np.abs(found.at(other) - seen_by_a_bent_lens(other)).max() < 3e-5
    assert 0.1 < found.error_mm < 1.0  # the noise of single points


def test_one_plate_does_not(fringes):
    rng = np.random.default_rng(1)
    flat = plate(2400, 0.1, rng)
    with pytest.raises(InputError, match="views: expected surfaces at several depths"):
        learn([(flat, seen_by_a_bent_lens(flat))])
    with pytest.raises(InputError, match="views: expected surfaces that fill the image"):
        learn([(flat[:100], seen_by_a_bent_lens(flat[:100]))])
    with pytest.raises(InputError, match="views: expected images"):
        calibrate_projector(fringes.calibration, [])


def test_a_projector_at_the_cameras_place_is_no_third_view():
    rng = np.random.default_rng(1)
    views = [plate(2300, 0.0, rng), plate(2500, 0.1, rng)]
    with pytest.raises(InputError, match="beside the left camera"):
        learn([(p, 0.5 + 1.7 * p[:, 0] / p[:, 2] + rng.normal(0, 2e-5, len(p))) for p in views])
