"""Images that are taken in while they arrive give the bits of the whole stack; what is wrong has one clear error."""

import threading

import numpy as np
import pytest

from debulk import InputError, _core
from debulk.scanner import ScanCancelled, Scanner, inputs
from debulk.scanner.arriving import Camera
from debulk.scanner.decode import decode_into, noise_of
from debulk.scanner.faults import refuse_faults
from debulk.scanner.inputs import checked_stack

MAPS = ("phase", "noise", "modulation", "offset", "residual", "exposure")


def decoded(images, periods, steps, bits, planes=None):
    """Return the maps of one camera's exposures, (E, n, H, W), and the counts."""
    stack, stop = checked_stack(list(images), steps * len(periods), bits=bits), _core.Stop()
    noise = noise_of(stack, steps, None, 1, stop)
    start = refuse_faults(stack, periods, steps, noise)
    maps = {name: np.empty(stack.shape, np.uint8 if name == "exposure" else np.float32) for name in MAPS}
    phase = decode_into(maps, stack, periods, steps, noise, start, None, 2, stop, planes=planes)
    return maps, {name: count for name, count in phase.counts.items() if name != "read"}  # all images were read before


def taken_in(images, periods, steps, bits):
    camera = Camera("images", images.shape[2:], periods, steps, len(images), bits, [])
    for image in images.reshape(-1, *images.shape[2:]):
        camera.add(camera.checked(image), threads=2)
    return camera.planes


@pytest.mark.parametrize("kind", ["8 bits", "12 bits", "12 bits, high in the word", "10 bits"])
@pytest.mark.parametrize(
    ("periods", "steps", "gains", "columns"),  # rows of 640 columns are whole groups of sixteen pixels
    [
        ((50, 51), 6, (1.0,), 640),
        ((40, 41), 8, (1.0,), 635),
        ((50, 51), 3, (1.0,), 639),
        ((30, 31), 12, (1.0,), 640),
        ((1, 8, 64), 4, (1.0,), 637),
        ((50, 51), 6, (0.2, 0.7, 2.4), 635),
        ((1, 8, 64), 4, (0.3, 1.7), 640),
    ],
)
def test_every_pattern_has_the_bits_of_the_whole_stack(formula, periods, steps, gains, columns, kind):
    grey = formula(periods, steps)[..., :columns].astype(np.float64)
    white = {"8": 255, "10": 1023, "12": 4095}[kind.split()[0]]
    images = np.stack([np.minimum(np.rint(grey * gain * white / 255), white) for gain in gains])
    images = images.astype(np.uint8 if white == 255 else np.uint16)
    if "high" in kind:
        images <<= 4
    bits = 10 if kind == "10 bits" else None
    whole, counts = decoded(images, periods, steps, bits)
    planes = taken_in(images, periods, steps, bits)
    assert (planes.white == checked_stack(list(images), grey.shape[0], bits=bits).white) == ("high" not in kind)
    maps, same = decoded(images, periods, steps, bits, planes)
    assert counts == same
    assert counts["lit"] > 0.5 * grey[0].size
    for name in MAPS:
        assert maps[name].tobytes() == whole[name].tobytes(), name


def test_the_planes_are_what_is_decoded(formula):
    images = formula()[None]
    planes = taken_in(images, (50, 51), 6, None)
    with np.errstate(all="ignore"):  # planes that are not needed are not filled
        planes.best[2:] += 0.25  # a quarter of a turn
    maps, _ = decoded(images, (50, 51), 6, None, planes)
    assert not np.array_equal(maps["phase"], decoded(images, (50, 51), 6, None)[0]["phase"], equal_nan=True)


def arrived(scanner, fringes, count=None):
    arriving = scanner.arriving(exposures=len(fringes.left))
    pairs = [pair for stacks in zip(fringes.left, fringes.right, strict=True) for pair in zip(*stacks, strict=True)]
    for left, right in pairs[:count]:
        arriving.add(left, right)
    return arriving


def test_the_cloud_has_the_bits_of_a_scan(fringes, scanned):
    scan, instrument = scanned
    scanner = Scanner(fringes.calibration, details=True)
    arriving = arrived(scanner, fringes)
    for _ in range(2):  # it can be asked for again, as after a deadline
        found = arriving.cloud()
        assert found.points_mm.tobytes() == scan.points_mm.tobytes()
        assert found.uncertainty_mm.tobytes() == scan.uncertainty_mm.tobytes()
        assert scanner.right.noise_rad.tobytes() == instrument.right.noise_rad.tobytes()
        assert found.counts == scan.counts
        assert scanner.left.counts == instrument.left.counts | {"read": fringes.left.size}


def test_only_the_last_image_is_sampled_after_it_came(fringes, monkeypatch):
    scanner = Scanner(fringes.calibration)
    arriving, sampled = arrived(scanner, fringes), []
    sample_of = inputs.sample_of
    monkeypatch.setattr(inputs, "sample_of", lambda image: sampled.append(image) or sample_of(image))
    arriving.cloud()
    assert {image.ctypes.data for image in sampled} == {
        images[-1, -1].ctypes.data for images in (fringes.left, fringes.right)
    }
    stack = checked_stack(list(fringes.left), fringes.left.shape[1], sampled=arriving._cameras[0].sampled)
    assert np.array_equal(stack.sample, checked_stack(list(fringes.left), fringes.left.shape[1]).sample)


def test_the_next_scan_takes_the_memory_of_one_that_was_let_go(fringes, scanned):
    scanner = Scanner(fringes.calibration)
    given_up = arrived(scanner, fringes, 20)
    memory = {camera.planes.best.ctypes.data for camera in given_up._cameras}
    other = arrived(scanner, fringes)
    assert memory.isdisjoint(camera.planes.best.ctypes.data for camera in other._cameras)
    given_up = None
    again = arrived(scanner, fringes)
    assert memory == {camera.planes.best.ctypes.data for camera in again._cameras}
    for arriving in (other, again):
        assert arriving.cloud().points_mm.tobytes() == scanned[0].points_mm.tobytes()


def test_floats_and_colours_are_taken_too(fringes, scanned):
    scanner = Scanner(fringes.calibration)
    arriving = scanner.arriving(exposures=len(fringes.left))
    for e in range(len(fringes.left)):
        for left, right in zip(fringes.left[e], fringes.right[e], strict=True):
            arriving.add(left / 255.0, right.astype(np.float32))
    assert arriving.cloud().points_mm.tobytes() == scanned[0].points_mm.tobytes()


def test_what_is_wrong_is_said_once_and_clearly(fringes):
    scanner = Scanner(fringes.calibration)
    left, right = fringes.left, fringes.right
    with pytest.raises(InputError, match="exposures: expected a whole number"):
        scanner.arriving(0)
    arriving = scanner.arriving(exposures=len(left))
    arriving.add(left[0][0], right[0][0])
    with pytest.raises(
        InputError, match=r"right_images, image 2 of exposure 1: expected an image of shape \(480, 640\)"
    ):
        arriving.add(left[0][1], right[0][1][:, 1:])
    with pytest.raises(InputError, match="left_images, image 2 of exposure 1: expected uint8 like the first"):
        arriving.add(left[0][1].astype(np.uint16), right[0][1])
    with pytest.raises(InputError, match=r"image 2 of exposure 1: expected an \(H, W\) array"):
        arriving.add("frame.png", right[0][1])
    assert arriving.missing == 35  # a refused image does not count, in neither camera
    with pytest.raises(InputError, match="images: expected 36 of each camera, but only 1 have arrived"):
        arriving.cloud()
    whole = arrived(scanner, fringes)
    with pytest.raises(InputError, match="left_images: expected 36 images, but got another one"):
        whole.add(left[0][0], right[0][0])


def test_memory_that_is_used_again_is_noticed(fringes):
    arriving = Scanner(fringes.calibration).arriving(exposures=3)
    buffer = np.empty_like(fringes.left[0][0])
    for e in range(3):
        for left, right in zip(fringes.left[e], fringes.right[e], strict=True):
            buffer[:] = left
            arriving.add(buffer, right)
    with pytest.raises(InputError, match="left_images, image 1 of exposure 1: expected memory that keeps the image"):
        arriving.cloud()


def test_images_out_of_order_are_named(fringes):
    scanner = Scanner(fringes.calibration)
    order = [1, 0, *range(2, 12)]
    with pytest.raises(InputError) as whole:
        scanner.scan(fringes.left[:, order], fringes.right)
    arriving = scanner.arriving(exposures=3)
    for e in range(3):
        for k in range(12):
            arriving.add(fringes.left[e][order[k]], fringes.right[e][k])
    with pytest.raises(InputError) as found:
        arriving.cloud()
    assert str(found.value) == str(whole.value)
    assert "image" in str(found.value)


def test_cancelling_leaves_no_thread_and_the_images_where_they_are(fringes, scanned):
    scanner = Scanner(fringes.calibration)
    before = threading.active_count()
    arriving = arrived(scanner, fringes)
    assert threading.active_count() == before

    def stop(stage, done):
        scanner.cancel()

    with pytest.raises(ScanCancelled):
        arriving.cloud(progress=stop)
    assert threading.active_count() == before
    assert arriving.cloud().points_mm.tobytes() == scanned[0].points_mm.tobytes()
