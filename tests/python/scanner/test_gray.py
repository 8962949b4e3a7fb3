"""Gray code and phase shift: patterns, orders, refusals; and three frequencies, which `decode` takes."""

import importlib

import numpy as np
import pytest

from debulk import InputError
from debulk.scanner import decode, decode_gray, fringe_patterns, gray_patterns

PERIODS = 24
WIDE, TALL = 480, 64


def seen(patterns, gamma=1.0, blur=0.7, noise=1.0, seed=0, exposure=1.0):
    """Images of a wall of uneven brightness that turns away from the camera; a box stands before its middle rows."""
    import cv2

    rng = np.random.default_rng(seed)
    bright = np.clip(rng.normal(0.7, 0.2, (TALL // 8, WIDE // 8)), 0.2, 1).astype(np.float32)
    bright = cv2.resize(bright, (WIDE, TALL), interpolation=cv2.INTER_CUBIC)
    x = (np.arange(WIDE) + 0.5) / WIDE
    u = np.broadcast_to(0.05 + 0.9 * (x + 0.1 * x * (1 - x)), (TALL, WIDE)).copy()
    u[20:40, 200:300] -= 0.06
    lit = np.ones((TALL, WIDE), bool)
    lit[20:40, 300:315] = False  # shadow
    grid = (np.arange(patterns.shape[2]) + 0.5) / patterns.shape[2]
    images = []
    for line in patterns[:, 0].astype(float) / 255:
        light = np.interp(u, grid, line**gamma) * lit
        image = cv2.GaussianBlur(bright * (8 + 220 * light).astype(np.float32), (0, 0), blur) * exposure
        images.append(image + rng.normal(0, noise, image.shape))
    images = np.clip(np.rint(images), 0, 255).astype(np.uint8)
    return images, np.where(lit, u, np.nan)


def test_each_image_is_its_formula():
    patterns = gray_patterns((320, 16), 10, 4)
    assert patterns.shape == (4 + 5, 16, 320)
    for column in (0, 15, 16, 161, 319):
        u = (column + 0.5) / 320
        for k in range(4):
            assert abs(int(patterns[k, 3, column]) - 127.5 * (1 + np.cos(2 * np.pi * (10 * u + k / 4)))) <= 0.5
        # A Gray code: number = 0, 1, 2, ..., of which bit by bit is the exclusive or of all bits before.
        bits = np.bitwise_xor.accumulate(patterns[4:, 3, column] // 255)
        assert int("".join(map(str, bits)), 2) == int(20 * u)
    assert len(gray_patterns((320, 16), 10, 4, complementary=False)) == 4 + 4
    flat = gray_patterns((64, 320), 10, 4, "horizontal")
    assert np.array_equal(flat, gray_patterns((320, 64), 10, 4).transpose(0, 2, 1))
    assert (np.abs(np.diff(patterns[4:, 3].astype(int), axis=1)).sum(axis=0) <= 255).all()  # one change at a time


@pytest.mark.parametrize("complementary", [True, False])
@pytest.mark.parametrize("steps", [3, 4, 6, 12])
@pytest.mark.parametrize(("gamma", "blur", "by"), [(1.0, 0.5, None), (1.0, 1.2, "inverted"), (1.8, 0.8, "white_black")])
def test_no_order_is_wrong(complementary, steps, gamma, blur, by):
    patterns = gray_patterns((1920, 8), PERIODS, steps, complementary=complementary)
    turned, ends = 255 - patterns[steps:], np.stack([0 * patterns[0] + 255, 0 * patterns[0]])
    extra = {None: patterns[:0], "inverted": turned, "white_black": ends}[by]
    images, u = seen(np.concatenate([patterns, extra]), gamma, blur, seed=steps)
    count = len(patterns)
    phase = decode_gray(images[:steps], images[steps:count], PERIODS, steps, **({by: images[count:]} if by else {}))
    off = phase.phase_rad / (2 * np.pi) - PERIODS * u
    inside = np.isfinite(u)
    inside[:, 2:-2] &= np.abs(u[:, 4:] - u[:, :-4]) < 0.03  # blurred edges of the box lie between its sides
    known = np.isfinite(off) & inside
    assert (np.abs(off[known]) > 0.5).sum() == 0
    assert known.sum() > (0.99 if complementary else 0.85) * inside.sum()
    assert phase.periods == (PERIODS,)
    assert phase.counts["lit"] >= np.isfinite(phase.phase_rad).sum()
    if steps == 3:
        assert np.isnan(phase.noise_rad).all()
    elif gamma == 1 and blur == 0.5:
        error = off[10:18, 10:-10] * 2 * np.pi
        local = error - np.mean(error, axis=0)  # without what the texture and the blur do
        assert 0.7 < np.nanstd(local) / np.nanmedian(phase.noise_rad) < 1.6


def test_exposures_are_chosen_per_pixel():
    patterns = gray_patterns((1920, 8), PERIODS, 4)
    stack = np.stack([seen(patterns, exposure=e)[0] for e in (0.3, 1.4)])
    u = seen(patterns)[1]
    phase = decode_gray(stack[:, :4], stack[:, 4:], PERIODS, 4)
    assert set(np.unique(phase.exposure)) == {0, 1}
    assert phase.brightness[1] == pytest.approx(1.4 / 0.3, rel=0.02)
    off = phase.phase_rad[:18] / (2 * np.pi) - PERIODS * u[:18]
    assert np.isfinite(off).mean() > 0.98
    assert np.nanmax(np.abs(off)) < 0.5


def exchanged(images, i, j):
    images = images.copy()
    images[[i, j]] = images[[j, i]]
    return images


FAULTS = {
    "exchanged wide": (lambda f, g: (f, exchanged(g, 0, 1)), "gray_images: images 1 and 2 are exchanged"),
    "exchanged narrow": (lambda f, g: (f, exchanged(g, 2, 5)), "gray_images: images 3 and 6 are exchanged"),
    "reversed": (lambda f, g: (f, g[::-1]), "begin with the narrowest stripes"),
    "missing": (lambda f, g: (f, g[1:]), "gray_images: "),
    "two missing": (
        lambda f, g: (f, g[2:]),
        "expected 6 images for 24 periods, or 5 without .* got 4: an image is missing",
    ),
    "dark": (lambda f, g: (f, np.where(np.arange(6)[:, None, None] == 4, 3, g).astype(np.uint8)), "gray_images: "),
    "repeated": (lambda f, g: (f, g[[0, 1, 1, 3, 4, 5]]), "gray_images: "),
    "fringes exchanged": (lambda f, g: (exchanged(f, 1, 2), g), "images: the fringes do not follow 6 steps"),
    "fringes repeated": (lambda f, g: (f[[0, 0, 2, 3, 4, 5]], g), "images: the fringes do not follow 6 steps"),
    "fringes backwards": (lambda f, g: (f[::-1], g), "steps of the fringes run backwards"),
    "fringes rolled": (
        lambda f, g: (np.roll(f, -2, axis=0), g),
        r"start_rad=2\.\d\d if the projector's patterns begin so",
    ),
    "no code": (lambda f, g: (f, np.repeat(f[:1], 6, axis=0)), "gray_images: "),
    "fringes with a float": (lambda f, g: (f + 0.3, g), "images: expected uint8 or uint16, or floats that are whole"),
    "another size": (lambda f, g: (f, g[:, :32]), "gray_images: expected images like those of the fringes"),
}


@pytest.fixture(scope="module")
def good():
    images, u = seen(gray_patterns((1920, 8), PERIODS, 6))
    return images[:6], images[6:], u


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_named(good, name):
    change, message = FAULTS[name]
    with pytest.raises(InputError, match=message):
        decode_gray(*change(*good[:2]), PERIODS, 6)


@pytest.mark.parametrize("image", range(6))
def test_black_for_white_is_named(good, image):
    patterns = gray_patterns((1920, 8), PERIODS, 6)
    patterns[6 + image] = 255 - patterns[6 + image]
    images, _ = seen(patterns)
    with pytest.raises(InputError, match=f"image {image + 1} shows black for white"):
        decode_gray(images[:6], images[6:], PERIODS, 6)


def test_bad_arguments_are_named(good):
    fringes, code, _ = good
    for arguments, message in (
        ({"periods": 1}, "periods: expected a whole number of 2"),
        ({"steps": 2}, "steps: expected a whole number of 3"),
        ({"start_rad": np.nan}, "start_rad: expected"),
        ({"sensor_noise": (-1, 0)}, "sensor_noise: expected"),
        ({"inverted": code, "white_black": code[:2]}, "expected one of the two"),
        ({"inverted": code[:3]}, "inverted: expected 6 images, but got 3"),
        ({"white_black": code[:3]}, "white_black: expected 2 images, but got 3"),
    ):
        with pytest.raises(InputError, match=message):
            decode_gray(fringes, code, **{"periods": PERIODS, "steps": 6, **arguments})
    with pytest.raises(InputError, match="direction: expected one of"):
        gray_patterns(direction="up")


def test_darkness_is_no_error_and_gives_nothing():
    rng = np.random.default_rng(0)
    images = rng.integers(0, 4, (12, 40, 64)).astype(np.uint8)
    assert np.isnan(decode_gray(images[:6], images[6:], PERIODS, 6).phase_rad).mean() > 0.99


def test_another_start_is_taken_out(good):
    fringes, code, _ = good
    phase = decode_gray(fringes, code, PERIODS, 6).phase_rad
    later = decode_gray(np.roll(fringes, -2, axis=0), code, PERIODS, 6, start_rad=2 * np.pi / 3, blur_px=0.0).phase_rad
    assert np.nanmedian(np.abs(later - phase)) < 0.01


@pytest.mark.parametrize("periods", [(1, 8, 64), (1, 4, 16, 64), (70, 64, 59), (64, 63), (28, 26, 24)])
@pytest.mark.parametrize("steps", [4, 6])
def test_hierarchies_and_heterodyne_sets_decode(periods, steps):
    if periods == (28, 26, 24):
        with pytest.raises(InputError, match="periods: expected numbers from which one period"):
            decode(np.zeros((3 * steps, TALL, WIDE), np.uint8), periods, steps)
        return
    images, u = seen(fringe_patterns((1920, 8), periods, steps), blur=0.5)
    phase = decode(images, periods, steps)
    off = phase.phase_rad / (2 * np.pi) * max(periods) / periods[0] - max(periods) * u
    whole = np.isfinite(off[:18])
    assert (np.abs(off[:18][whole]) > 0.5).sum() == 0
    assert whole.mean() > 0.97


def test_the_virtual_scanner_shows_a_gray_code(layup, monkeypatch):
    # Dark carbon fibre with highlights in three exposures, seen through the lenses of both cameras.
    module = importlib.import_module("debulk.scenes.fringe_images")
    monkeypatch.setattr(module, "fringe_patterns", lambda pixels, periods, steps: gray_patterns(pixels, 32, 6))
    images = module.fringe_images(layup, (320, 240), periods=(32, 31))
    for stack, true in ((images.left, images.truth.left_phase_rad), (images.right, images.truth.right_phase_rad)):
        phase = decode_gray(stack[:, :6], stack[:, 6:], 32, 6)
        off = phase.phase_rad - true
        assert (np.abs(off) > np.pi).sum() == 0
        assert np.isfinite(off).sum() > 0.99 * np.isfinite(true).sum()
