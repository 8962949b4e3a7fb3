"""The preparation of an inspector: its progress, its end when asked, its log; what it keeps of its cloud."""

import logging
import threading

import numpy as np
import pytest

from debulk import Cancelled, Inspector, Recipe, scenes


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=3, pixels=(1280, 960))


@pytest.fixture(scope="module")
def small():
    """For what ends before anything is measured: all stages, a quarter of the points."""
    return scenes.layup(seed=3, pixels=(640, 480))


def make(layup, progress=None, **more):
    pose = layup.mold_from_scanner
    return Inspector(
        None, layup.reference, layup.ply_outline, **{"mold_from_scanner": pose, "progress": progress, **more}
    )


def test_progress_goes_on_from_the_calling_thread(layup):
    calls = []
    make(layup, lambda stage, share: calls.append((stage, share, threading.current_thread())))
    stages = [stage for stage, _, _ in calls]
    shares = [share for _, share, _ in calls]
    assert shares == sorted(shares)
    assert 0 <= shares[0] < 0.1 < 0.9 < shares[-1] < 1
    assert len(set(stages)) >= 7
    assert all(thread is threading.current_thread() for _, _, thread in calls)


class Enough(Exception):
    pass


@pytest.mark.parametrize("error", [Cancelled("enough"), Enough(), KeyboardInterrupt()])
@pytest.mark.parametrize(
    "stage", ["reference: copy", "reference: clean", "reference: grid", "reference: fit", "front end"]
)
def test_an_exception_from_progress_ends_the_preparation(small, stage, error):
    def progress(now, share):
        if now == stage:
            raise error

    before = set(threading.enumerate())
    with pytest.raises(type(error)) as raised:
        make(small, progress)
    assert raised.value is error
    assert set(threading.enumerate()) <= before


def test_a_stage_that_runs_is_stopped(layup):
    stages = []

    def progress(stage, share):
        stages.append(stage)
        if stages.count("reference: grid") == 2:  # while it is at work
            raise Cancelled("enough")

    large = np.repeat(np.repeat(layup.reference, 3, axis=0), 3, axis=1)  # no camera's any more
    recipe = Recipe(clean={"grid_spacing_mm": 0.2})
    with pytest.raises(Cancelled):
        Inspector(recipe, large, mold_from_scanner=layup.mold_from_scanner, progress=progress)
    assert "reference: fit" not in stages


def test_stages_are_logged_with_their_times(layup, caplog):
    with caplog.at_level(logging.DEBUG, logger="debulk"):
        make(layup)
    lines = [record.getMessage() for record in caplog.records if record.levelno == logging.DEBUG]
    for stage in ("copy", "clean", "grid", "fit"):
        assert sum(line.startswith(f"reference: {stage}: ") and line.endswith(" ms") for line in lines) == 1


@pytest.mark.parametrize("read_only", [True, False])
def test_the_cloud_stays_as_it_was(layup, read_only):
    cloud = layup.reference.copy()
    cloud.flags.writeable = not read_only
    mask = np.zeros(cloud.shape[:2], dtype=np.bool_)
    mask[:100, :100] = True
    prepared = Inspector(None, cloud, mold_from_scanner=layup.mold_from_scanner, mask=mask).prepared
    assert np.array_equal(cloud, layup.reference, equal_nan=True)
    assert prepared.cloud == make(layup).prepared.cloud  # the fingerprint is of what was given


def test_neighbours_in_the_image_decide_as_those_in_space(layup):
    """The same cloud without its camera: by the general search, in the same frame."""
    image = make(layup).prepared
    shifted = np.eye(4)
    shifted[:3, 3] = 1.0, 2.0, 3.0  # the camera is not at the origin then
    moved = layup.reference - shifted[:3, 3].astype(np.float32)
    general = Inspector(None, moved, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner @ shifted).prepared
    assert image.image is not None
    assert general.image is None
    assert image.seen.values.shape == general.seen.values.shape
    x, y = np.meshgrid(np.linspace(-300, 300, 50), np.linspace(-200, 200, 40))
    xy = np.stack([x.ravel(), y.ravel()], axis=1)
    np.testing.assert_allclose(image.reference.height(xy), general.reference.height(xy), atol=2e-3)


def test_the_mold_is_known_up_to_its_edge(layup):
    prepared = make(layup).prepared
    edge = scenes.mold.rim()
    inside = edge[:, :2] * (1 - 3 / np.linalg.norm(edge[:, :2], axis=1))[:, None]  # 3 mm
    z = layup.truth.mold_height(inside)
    assert np.abs(prepared.reference.height(inside) - z).max() < 0.15  # 17 mm without regard to the cliff
