"""The scanner: cycles, stopping, memory."""

import threading
import time

import numpy as np
import pytest

from debulk import InputError
from debulk.scanner import ScanCancelled, Scanner, ScanTooLate, decode, triangulate


def test_a_cycle_is_its_steps(fringes, scanned):
    scan, _ = scanned
    alone = triangulate(decode(fringes.left), decode(fringes.right), fringes.calibration)
    assert np.array_equal(alone.points_mm, scan.points_mm, equal_nan=True)
    assert np.array_equal(alone.uncertainty_mm, scan.uncertainty_mm, equal_nan=True)


def test_the_second_cycle_is_the_first_and_uses_the_same_memory(fringes):
    instrument = Scanner(fringes.calibration, threads=1)
    out = np.empty((480, 640, 3), np.float32), np.empty((480, 640), np.float32)
    first = instrument.scan(fringes.left, fringes.right, out=out)
    kept, places = first.points_mm.copy(), (instrument.left.phase_rad.ctypes.data, first.points_mm.ctypes.data)
    second = instrument.scan(fringes.left, fringes.right, out=out)
    assert np.array_equal(kept, second.points_mm, equal_nan=True)
    assert (instrument.left.phase_rad.ctypes.data, second.points_mm.ctypes.data) == places


def test_progress_grows_and_names_its_stages(fringes):
    told = []
    Scanner(fringes.calibration).scan(
        fringes.left, fringes.right, progress=lambda stage, done: told.append((stage, done))
    )
    assert [stage for stage, _ in told][:4] == ["checking images", "decoding left", "decoding right", "triangulating"]
    shares = [done for _, done in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_a_deadline_ends_the_scan(fringes):
    with pytest.raises(ScanTooLate, match=r"the deadline of 0.001 s passed"):
        Scanner(fringes.calibration).scan(fringes.left, fringes.right, deadline_s=0.001)
    with pytest.raises(InputError, match="deadline_s"):
        Scanner(fringes.calibration).scan(fringes.left, fringes.right, deadline_s=0)


def test_cancelling_ends_the_scan_and_the_next_one_runs(fringes):
    instrument = Scanner(fringes.calibration)
    ended = []

    def run():
        try:
            instrument.scan(fringes.left, fringes.right, progress=lambda stage, done: began.set() if done else None)
        except ScanCancelled:
            ended.append(time.perf_counter())

    began = threading.Event()
    thread = threading.Thread(target=run)
    thread.start()
    began.wait(30)
    instrument.cancel()
    thread.join(30)
    assert len(ended) == 1
    assert np.isfinite(instrument.scan(fringes.left, fringes.right).points_mm[..., 2]).any()


def test_bad_input_is_named(fringes):
    instrument = Scanner(fringes.calibration)
    with pytest.raises(InputError, match=r"left_images: expected images of shape \(480, 640\)"):
        instrument.scan(fringes.left[..., :600], fringes.right)
    with pytest.raises(InputError, match="right_images: expected 12 images of exposure 1"):
        instrument.scan(fringes.left, fringes.right[:, :11])
    with pytest.raises(InputError, match="calibration: expected"):
        Scanner(None)
    with pytest.raises(InputError, match="sensor_noise"):
        Scanner(fringes.calibration, sensor_noise=(-1, 0)).scan(fringes.left, fringes.right)
