"""Many exposures of dark and bright surfaces: no false refusal, no wrong order, every planted fault found."""

import numpy as np
import pytest

import fringe_stacks
from debulk import InputError
from debulk.scanner import decode


def refused_and_wrong(seeds):
    refused, wrong, known = [], 0, 0
    for seed in seeds:
        scene, images, exposures, bits = fringe_stacks.hdr(seed)
        try:
            phase = decode(images, bits=bits)
        except InputError as error:
            refused.append(f"{seed}: {exposures.round(3)}, {bits} bits: {error}")
            continue
        off = np.abs(phase.phase_rad - 2 * np.pi * 50 * scene.u)
        assert phase.start_phase_rad == 0
        wrong += np.count_nonzero(off > np.pi)
        known += np.count_nonzero(np.isfinite(off))
    return refused, wrong, known


@pytest.mark.parametrize("seed", range(4))
def test_exposures_over_decades_are_decoded(seed):
    refused, wrong, known = refused_and_wrong([seed])
    assert (refused, wrong) == ([], 0)
    assert known > 5000


@pytest.mark.slow
def test_two_hundred_stacks_are_decoded():
    refused, wrong, known = refused_and_wrong(range(200))
    assert refused == []
    assert wrong <= 1e-6 * known


def exchanged(i, j):
    def spoil(images):
        images[[i, j]] = images[[j, i]]

    return spoil


def repeated(k):
    def spoil(images):
        images[k] = images[k - 1]

    return spoil


def darker(images, factor):
    """What was saturated stays so, because the light changes before the sensor cuts it off."""
    return np.where(images == 255, 255, np.rint(images * factor))


def scaled(k, factor):
    def spoil(images):
        images[k] = darker(images[k], factor)

    return spoil


def flicker(images):
    images[:] = darker(images, np.random.default_rng(3).uniform(0.94, 1, (len(images), 1, 1)))


def rolled(by):
    def spoil(images):
        images[:] = np.roll(images, by, axis=0)

    return spoil


def dark(images):
    images[6] = np.random.default_rng(3).integers(0, 3, images[6].shape)


FAULTS = [
    (exchanged(2, 3), "images 3 and 4 {} are exchanged"),
    (exchanged(1, 9), "images 2 and 10 {} are exchanged"),
    (repeated(8), "images 8 and 9 {} show the same pattern"),
    (scaled(4, 0.9), "image 5 {} is differently exposed: 0.9"),
    (scaled(7, 0.7), "image 8 {} is differently exposed: 0.7"),
    (flicker, "the light flickers: images {} differ in brightness"),
    (dark, "image 7 {} is dark"),
    (rolled(1), "the images {} begin with the last pattern"),
    (rolled(-1), "the images {} begin with the second pattern"),
]


@pytest.fixture(scope="module")
def stack():
    """Three exposures, each of which a fifth of the pixels or more take their phase from; 8 bits."""
    rng = np.random.default_rng(11)
    scene = fringe_stacks.scene(rng, sigma=1.5)
    images = fringe_stacks.taken(rng, scene, (0.125, 0.5, 2.0))
    decode(images)
    return images


@pytest.mark.parametrize("exposure", range(3))
@pytest.mark.parametrize(("spoil", "message"), FAULTS)
def test_a_fault_in_an_exposure_that_is_used_is_named(stack, spoil, message, exposure):
    images = stack.copy()
    spoil(images[exposure])
    with pytest.raises(InputError, match=message.format(f"of exposure {exposure + 1}")):
        decode(images)


def test_wrong_steps_and_periods_are_refused():
    rng = np.random.default_rng(12)
    images = fringe_stacks.taken(rng, fringe_stacks.scene(rng), (0.5, 2, 8), periods=(47, 48))
    with pytest.raises(InputError, match="do not follow the fringes of 6 steps"):
        decode(images)
    with pytest.raises(InputError, match=r"do not follow the fringes of 4 steps|flickers"):
        decode(images, (47, 48, 49), 4)


# The numbers of periods that decode with so much gamma: with few steps it takes the phases far from a straight line.
@pytest.mark.parametrize(
    ("steps", "periods"), [(3, (2, 3)), (4, (8, 9)), (5, (8, 9)), (6, (8, 9)), (8, (8, 9)), (12, (8, 9))]
)
@pytest.mark.parametrize("gamma", [0.45, 1.0, 2.2])
def test_noise_is_that_of_two_takes(steps, periods, gamma):
    rng = np.random.default_rng(1)
    scene = fringe_stacks.scene(rng, shape=(48, 640), sigma=0.5, glints=3)
    one, other = (
        decode(images, periods, steps, blur_px=0)
        for images in (
            fringe_stacks.taken(rng, scene, (0.3,), periods=periods, steps=steps, gamma=gamma) for _ in range(2)
        )
    )
    share = (one.phase_rad - other.phase_rad) / np.hypot(one.noise_rad, other.noise_rad)
    share = share[np.isfinite(share)]
    assert share.size > 20_000
    assert 0.8 < np.sqrt(np.mean(share**2)) < 1.25


def test_the_ripple_of_flicker_is_that_of_the_formula():
    u = (np.arange(1280) + 0.5) / 1280
    turns = np.array([n * u + k / 6 for n in (50, 51) for k in range(6)])
    lines = 1800 + 1650 * np.cos(2 * np.pi * turns)
    even, uneven = (
        decode(np.rint(lines * light[:, None])[:, None, :].repeat(16, axis=1).astype(np.uint16), blur_px=0)
        for light in (np.ones(12), 1 + 0.02 * np.eye(12)[4])
    )
    off = (uneven.phase_rad - even.phase_rad)[5]
    expected = 0.02 * 2 / 6 * np.sqrt(0.5 * (1800 / 1650) ** 2 + 1 / 8) * 50**2 / (50**2 + 51**2)
    assert np.nanstd(off) == pytest.approx(expected, rel=0.03)
