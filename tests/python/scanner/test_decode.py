"""Decoding: the phase convention, HDR, noise, refusals."""

import numpy as np
import pytest

from debulk import InputError
from debulk.scanner import decode, fringe_patterns
from debulk.scanner.decode import decode_into
from debulk.scanner.inputs import checked_stack


def test_the_convention_on_images_written_by_hand():
    # Four pixels of 32, each at one place of the field, their grey values from a table of cosines.
    u = np.repeat([0.1, 0.26, 0.5, 0.87], 8)
    images = [120 + 100 * np.cos(2 * np.pi * n * u + 2 * np.pi * k / 4) for n in (5, 6) for k in range(4)]
    stack = np.rint(images).astype(np.uint8)[:, None, :].repeat(8, axis=1)
    phase = decode(stack, periods=(5, 6), steps=4)
    assert phase.phase_rad[0, ::8] == pytest.approx(2 * np.pi * 5 * np.array([0.1, 0.26, 0.5, 0.87]), abs=0.01)
    assert phase.offset[0] == pytest.approx(120, abs=0.5)
    assert phase.modulation[0] == pytest.approx(100, abs=0.5)


@pytest.mark.parametrize(("periods", "steps"), [((50, 51), 6), ((59, 64, 70), 4), ((40, 41), 8)])
def test_the_projectors_own_patterns_decode_to_its_columns(periods, steps):
    patterns = fringe_patterns((1024, 16), periods, steps)
    phase = decode(np.minimum(patterns, 254), periods, steps)
    expected = 2 * np.pi * periods[0] * (np.arange(1024) + 0.5) / 1024
    assert np.abs(phase.phase_rad[5, 2:-2] - expected[2:-2]).max() < 0.02
    assert np.nanmax(phase.order_residual) < 0.2


def test_orders_survive_noise(formula):
    phase = decode(formula(noise=2.0))
    expected = 2 * np.pi * 50 * (np.arange(640) + 0.5) / 640
    error = (phase.phase_rad - expected)[:, 3:-3]
    assert np.isfinite(error).mean() > 0.97
    assert (np.abs(error) > 1).sum() == 0
    ratio = np.sqrt(np.nanmean(error**2) / np.nanmean(phase.noise_rad[:, 3:-3] ** 2))
    assert 0.9 < ratio < 1.1


def test_twelve_bits_in_sixteen_decode_alike(formula):
    eight = formula(noise=0.0)
    twelve = eight.astype(np.uint16) * 16
    assert decode(twelve).phase_rad == pytest.approx(decode(eight).phase_rad, abs=1e-3, nan_ok=True)
    with pytest.raises(InputError, match=r"expected grey values up to 4095, but got \d+: give the sensor's bits"):
        decode(twelve * 2)
    assert np.isfinite(decode(twelve * 2, bits=16).phase_rad).mean() > 0.99


def test_exposures_as_arrays_or_lists_are_the_same(formula):
    long = formula()
    short = np.rint(long / 4.0).astype(np.uint8)
    one = decode(np.stack([short, long]))
    other = decode([list(short), list(long)])
    assert np.array_equal(one.phase_rad, other.phase_rad, equal_nan=True)
    assert set(np.unique(one.exposure)) <= {0, 1}


def test_saturated_pixels_fall_back_or_stay_empty(formula):
    images = formula()
    bright = images.copy()
    bright[:, 20:30] = np.minimum(images[:, 20:30].astype(int) * 3, 255)
    alone = decode(bright)
    assert np.isnan(alone.phase_rad[20:30]).mean() > 0.5
    assert (alone.exposure[20:30][np.isnan(alone.modulation[20:30])] == 255).all()
    short = np.rint(bright / 4.0).astype(np.uint8)
    short[:, 20:30] = np.rint(images[:, 20:30] * 0.75).astype(np.uint8)
    both = decode(np.stack([short, bright]))
    assert np.isfinite(both.phase_rad[20:30]).mean() > 0.9
    assert (both.exposure[31:] == 1).all()


def test_same_bits_on_any_threads_and_instructions(formula):
    stack = checked_stack(np.stack([formula(seed=1) // 4, formula(seed=1)]), 12)

    def run(threads, widest):
        maps = {
            name: np.empty((60, 640), np.float32) for name in ("phase", "noise", "modulation", "offset", "residual")
        }
        from debulk import _core

        decode_into(
            maps | {"exposure": np.empty((60, 640), np.uint8)},
            stack,
            (50, 51),
            6,
            (0.5, 0.01),
            0.0,
            0.6,
            threads,
            _core.Stop(),
            widest,
        )
        return b"".join(map_.tobytes() for map_ in maps.values())

    assert len({run(threads, widest) for threads in (1, 2, 5) for widest in (2, 3, 4)}) == 1


@pytest.mark.parametrize(
    ("images", "message"),
    [
        (np.zeros((11, 20, 40), np.uint8), "expected 12 images .*got 11: an image is missing"),
        (np.zeros((12, 20, 40), np.int32), "image 1: expected an \\(H, W\\) array of uint8 or uint16"),
        (np.zeros((12, 20, 8), np.uint8), "at least 32 x 8 pixels"),
        ([np.zeros((20, 40), np.uint8)] * 11 + [np.zeros((20, 41), np.uint8)], "one shape and type"),
        ([], "expected images of shape"),
        (None, "expected images of shape"),
    ],
)
def test_bad_images_are_named(images, message):
    with pytest.raises(InputError, match=message):
        decode(images)


def test_darkness_is_no_error_and_gives_nothing():
    rng = np.random.default_rng(0)
    phase = decode(rng.integers(0, 4, (12, 40, 64)).astype(np.uint8))
    assert np.isnan(phase.phase_rad).mean() > 0.99


@pytest.mark.parametrize(
    "stored",
    [
        lambda images: images[..., None],
        lambda images: np.repeat(images[..., None], 3, axis=-1),
        lambda images: [np.dstack([image, image, image, np.full_like(image, 255)]) for image in images],
        lambda images: images / 255,
        lambda images: images.astype(np.float32),
        lambda images: (images.astype(np.uint16) * 16).astype(">u2"),
        lambda images: images.astype(np.uint16) << 8,  # 8 bits in the upper ones of 16
        lambda images: (images.astype(np.uint16) * 4) << 6,  # 10 bits
    ],
)
def test_images_as_others_store_them_decode_alike(formula, stored):
    images = formula()
    assert decode(stored(images)).phase_rad == pytest.approx(decode(images).phase_rad, abs=1e-5, nan_ok=True)


def test_saturation_is_found_where_bits_lie_high_or_few():
    bits = np.random.default_rng(0).integers(0, 4096, (12, 64, 64)).astype(np.uint16)
    assert checked_stack(bits << 4, 12).white == 65520
    assert checked_stack(bits << 4, 12, bits=12).white == 65520
    assert checked_stack((bits >> 2) << 6, 12).white == 65472
    assert checked_stack(bits, 12).white == 4095
    with pytest.raises(InputError, match="saturate at 1023: give bits=10"):
        checked_stack(np.minimum(bits, 1023), 12)


@pytest.mark.parametrize(
    ("images", "message"),
    [
        (np.arange(12 * 32 * 40 * 3).reshape(12, 32, 40, 3).astype(np.uint8), "image 1: .* 3 colours that differ"),
        (np.full((12, 32, 40), 0.3), "floats that are whole grey values"),
    ],
)
def test_images_that_cannot_be_converted_are_named(images, message):
    with pytest.raises(InputError, match=message):
        decode(images)


@pytest.mark.parametrize(
    ("start", "sign", "first", "wave", "expected"),
    [
        (0.45, 1, 0, np.cos, 0.45),
        (0.5, 1, 0, np.cos, 0.5),
        (0.0, 1, 1, np.cos, 1 / 6),
        (0.0, 1, 0, np.sin, 0.75),
        (0.0, -1, 0, np.cos, 0.0),
        (0.0, -1, 1, np.sin, 5 / 12),
    ],
)
def test_other_start_phases_are_estimated(start, sign, first, wave, expected):
    u = (np.arange(640) + 0.5) / 640
    turns = [n * u + start + sign * (k + first) / 6 for n in (50, 51) for k in range(6)]
    images = np.rint([np.broadcast_to(120 + 100 * wave(2 * np.pi * t), (64, 640)) for t in turns]).astype(np.uint8)
    phase = decode(images)
    assert phase.start_phase_rad == pytest.approx(2 * np.pi * expected, abs=0.06)
    # The start phase stays part of the phase, at the mean of the numbers of periods; steps backwards mirror the field.
    place = (phase.phase_rad / (2 * np.pi) - expected * 50 * 101 / (50**2 + 51**2)) / 50
    assert place[5, 5:-5] == pytest.approx((u if sign > 0 else 1 - u)[5:-5], abs=1e-4)
    given = decode(images, start_phase_rad=2 * np.pi * (expected + 3))
    assert given.phase_rad == pytest.approx(phase.phase_rad, abs=2e-3, nan_ok=True)


def test_a_start_phase_that_the_periods_cannot_tell_is_asked_for():
    u = (np.arange(640) + 0.5) / 640
    turns = [n * u + 0.2 + k / 6 for n in (1, 8, 64) for k in range(6)]
    images = np.rint([np.broadcast_to(120 + 100 * np.cos(2 * np.pi * t), (64, 640)) for t in turns]).astype(np.uint8)
    with pytest.raises(InputError, match="cannot tell: give start_phase_rad"):
        decode(images, (1, 8, 64))
    assert np.isfinite(decode(images, (1, 8, 64), start_phase_rad=0.4 * np.pi).phase_rad).mean() > 0.9
