"""Clouds are taken piece by piece: the same points as in one go, and a raised stop is heeded between two pieces."""

import numpy as np
import pytest

from debulk import InputError, _core, cloud
from debulk.inspection.clouds import cleaning, fingerprint
from debulk.stopping import Running
from debulk.workers import Workers

pytestmark = pytest.mark.unit

RNG = np.random.default_rng(4)
IMAGE = RNG.normal(size=(70, 50, 3)) * 100


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch):
    monkeypatch.setattr(cleaning, "_PIECE", 300)  # a few rows


class Patience(_core.Stop):
    """A stop that is raised when it was looked at so often."""

    def __init__(self, looks):
        super().__init__()
        self.looks = looks

    def now(self):
        self.looks -= 1
        return self.looks < 0


@pytest.mark.parametrize(
    "given",
    [
        IMAGE,
        IMAGE.astype(np.float32),
        IMAGE[::2, ::3],
        IMAGE.reshape(-1, 3),
        np.ma.masked_array(IMAGE, np.abs(IMAGE) > 100),
        IMAGE.tolist(),
        np.empty((0, 3)),
    ],
    ids=["float64", "float32", "strided", "points", "masked", "list", "none"],
)
def test_pieces_make_the_cloud_that_one_go_makes(given):
    whole = cloud.as_cloud(given)
    for taken in (cleaning.as_points(given, "scan", _core.Stop()), cleaning.owned(given, "scan", _core.Stop())):
        assert taken.dtype == np.float32
        np.testing.assert_array_equal(taken, whole)
    assert fingerprint.of_cloud(given) == fingerprint.of_cloud(whole)


def test_a_plain_scan_is_borrowed_and_a_copy_is_a_copy():
    plain = IMAGE.astype(np.float32)
    assert np.shares_memory(cleaning.as_points(plain, "scan", _core.Stop()), plain)
    assert not np.shares_memory(cleaning.owned(plain, "scan", _core.Stop()), plain)


@pytest.mark.parametrize("wrong", [np.zeros((900, 2)), np.zeros(9), np.zeros((9, 3), int)])
def test_what_is_no_cloud_is_refused_in_the_same_words(wrong):
    with pytest.raises(InputError) as one_go:
        cloud.as_cloud(wrong, "scan")
    with pytest.raises(InputError) as by_pieces:
        cleaning.as_points(wrong, "scan", _core.Stop())
    assert str(by_pieces.value) == str(one_go.value)


def test_a_stop_is_heeded_between_two_pieces():
    plain = IMAGE.astype(np.float32)
    for looks in (0, 1, 5):
        with pytest.raises(_core.Stopped):
            cleaning.as_points(IMAGE, "scan", Patience(looks))
        with pytest.raises(_core.Stopped):
            cleaning.owned(plain, "scan", Patience(looks))
        assert fingerprint.of_cloud(plain, Patience(looks)).sha256 is None


def test_a_mask_is_taken_out_by_pieces_and_a_stop_heeded_between_them():
    plain, mask = IMAGE.astype(np.float32), RNG.random(IMAGE.shape[:2]) < 0.3
    given, without = plain.copy(), np.where(mask[..., None], np.float32(np.nan), plain)
    np.testing.assert_array_equal(cleaning.masked(plain, mask, "scan", _core.Stop()), without)
    np.testing.assert_array_equal(plain, given)
    assert np.shares_memory(cleaning.masked(plain, None, "scan", _core.Stop()), plain)
    cleaning.masked(plain, None, "scan", Patience(1))  # the first piece shows that it is neither empty nor in metres
    for looks in (0, 1, 5, 12):  # before it is checked, and while it is copied
        with pytest.raises(_core.Stopped):
            cleaning.masked(plain, mask, "scan", Patience(looks))
    hidden = plain.copy()
    cleaning.hide(hidden, mask, "scan", _core.Stop())
    np.testing.assert_array_equal(hidden, without)
    with pytest.raises(_core.Stopped):
        cleaning.hide(hidden, mask, "scan", Patience(1))


@pytest.mark.parametrize("wrong", [np.full((70, 50, 3), np.nan), IMAGE / 1e3, IMAGE[:, :0]])
def test_what_is_wrong_with_a_cloud_is_said_in_the_same_words(wrong):
    with pytest.raises(InputError) as one_go:
        cloud.checked(wrong, "scan")
    with pytest.raises(InputError) as by_pieces:
        cleaning.masked(wrong, None, "scan", _core.Stop())
    assert str(by_pieces.value) == str(one_go.value)


def test_running_calls_are_stopped_and_no_other():
    running, one, other, later = Running(), _core.Stop(), _core.Stop(), _core.Stop()
    with running.holding(one):
        with running.holding(other):
            pass
        running.cancel()
        with running.holding(later):
            pass
    running.cancel()
    assert [stop.cancelled for stop in (one, other, later)] == [True, False, False]


@pytest.mark.parametrize(("error", "raises_it"), [(KeyboardInterrupt, True), (OSError, True), (InputError, False)])
def test_what_no_computation_throws_ends_the_threads_that_compute(error, raises_it):
    stop = _core.Stop()
    with pytest.raises(error), Workers(1, stop):
        raise error
    assert stop.cancelled is raises_it
