"""`debulk scan`: patterns, images to a cloud, calibration."""

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from debulk import files, scanner, scenes
from debulk.cli import app

RUNNER = CliRunner()


def run(*words):
    done = RUNNER.invoke(app, [str(word) for word in words])
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The images of both cameras as a cell would leave them: left in subfolders, right in one folder."""
    root = tmp_path_factory.mktemp("images")
    images = scenes.fringe_images(scenes.layup(seed=2, pixels=(64, 48)), pixels=(320, 240), exposures=(1.0, 8.0))
    images.calibration.save(root / "c.json")
    for e, exposure in enumerate(images.left):
        (root / "left" / f"exposure{e + 1}").mkdir(parents=True)
        for k, image in enumerate(exposure):
            cv2.imwrite(str(root / "left" / f"exposure{e + 1}" / f"{k + 1}.png"), image)  # 10 comes after 9
    (root / "right").mkdir()
    for k, image in enumerate(images.right.reshape(-1, 240, 320)):
        cv2.imwrite(str(root / "right" / f"{k:03d}.png"), image)
    return root, images


def test_images_become_a_cloud_and_a_picture(folders):
    root, images = folders
    code, output = run(
        "scan", root / "left", root / "right", "--calibration", root / "c.json", "-o", root / "s.pcd",
        "--picture", root / "s.png",
    )  # fmt: skip
    assert code == 0, output
    assert "points of" in output
    cloud = files.load_cloud(root / "s.pcd")
    expected = scanner.Scanner(images.calibration).scan(images.left, images.right)
    assert np.array_equal(cloud, expected.points_mm, equal_nan=True)
    picture = cv2.imread(str(root / "s.png"))
    assert picture.shape[1] == 1400
    assert picture.std() > 20


def test_what_is_wrong_is_one_sentence(folders, tmp_path):
    root, _ = folders
    common = ("--calibration", root / "c.json", "-o", tmp_path / "s.pcd")
    for words, message in (
        ((root / "left", root / "nowhere", *common), "expected a folder with images"),
        ((root / "left", root / "right", *common, "--steps", "5"), "expected 10 images"),
        ((root / "right", root / "left", *common), "exchanged"),
        (
            (root / "left", root / "right", "--calibration", root / "none.json", "-o", tmp_path / "s.pcd"),
            "cannot be read",
        ),
        ((root / "left", root / "right", "--calibration", root / "c.json", "-o", tmp_path / "s.jpg"), "ending in .npy"),
        ((root / "left", root / "right", *common, "--periods", "fifty"), "--periods"),
    ):
        code, output = run("scan", *words)
        assert code == 2, output
        assert message in output
        assert output.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_patterns_are_written_in_order(tmp_path):
    code, output = run("scan", "patterns", tmp_path / "p", "--pixels", "64x32", "--periods", "5,6", "--steps", "4")
    assert code == 0
    assert "8 patterns" in output
    written = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((tmp_path / "p").iterdir())]
    assert np.array_equal(written, scanner.fringe_patterns((64, 32), (5, 6), 4))
    assert run("scan", "patterns", tmp_path / "q", "--pixels", "64")[0] == 2


def test_a_calibration_without_a_board_is_refused(folders, tmp_path):
    root, _ = folders
    code, output = run(
        "scan", "calibrate", root / "right", root / "right", "-o", tmp_path / "c.json", "--squares", "10x7",
        "--square-mm", "20",
    )  # fmt: skip
    assert code == 2
    assert "found it in 0 of 24" in output
    assert not (tmp_path / "c.json").exists()


def test_the_projector_is_learnt_and_held_against(folders, tmp_path):
    root, _ = folders
    images = root / "left", root / "right"
    code, output = run("scan", "projector", *images, "--calibration", root / "c.json", "-o", tmp_path / "p.json")
    assert code == 0, output
    assert "their noise included" in output
    assert scanner.Calibration.load(tmp_path / "p.json").projector is not None
    code, output = run("scan", *images, "--calibration", tmp_path / "p.json", "-o", tmp_path / "s.pcd")
    assert code == 0, output
    assert "cameras and projector agree within 0." in output
    assert run("scan", "projector", *images, "--calibration", root / "c.json", "-o", tmp_path / "p.txt")[0] == 2


def test_hidden_files_are_no_frames(folders, tmp_path):
    root, _ = folders
    for name in ("left", "right"):
        (root / name / ".thumbnails").mkdir(exist_ok=True)
        for hidden in (root / name / "._frame01.png", root / name / ".thumbnails" / "1.png"):
            hidden.write_bytes(b"no image")
    code, output = run(
        "scan", root / "left", root / "right", "--calibration", root / "c.json", "-o", tmp_path / "s.pcd"
    )  # fmt: skip
    assert code == 0, output
