"""Fringe images of a sensor, for many exposures: shot and read noise, dark and bright texture, glints, gamma."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np


@dataclass(frozen=True)
class Scene:
    """What two takes have in common: where each pixel lies in the field, and how it reflects."""

    u: np.ndarray
    reflectance: np.ndarray


def scene(rng, shape=(64, 640), sigma=1.25, glints=10):
    """Draw a surface, lognormal, half of it texture of single pixels, with glints that saturate."""
    height, width = shape
    slant = rng.uniform(-0.02, 0.02)
    u = (
        np.broadcast_to((np.arange(width) + 0.5) / width * 0.96 + 0.02, shape)
        + slant * np.linspace(-0.5, 0.5, height)[:, None]
    )
    fine, smooth = rng.normal(size=shape), cv2.GaussianBlur(rng.normal(size=shape), (0, 0), 8.0)
    texture = 0.7 * fine + 0.7 * smooth / smooth.std()
    bright = np.exp(sigma * texture / texture.std())
    y, x = np.mgrid[:height, :width]
    for _ in range(glints):
        near = np.hypot(y - rng.uniform(0, height), x - rng.uniform(0, width)) < rng.uniform(1.5, 5)
        bright[near] *= rng.uniform(30, 300)
    return Scene(u, bright)


def taken(rng, of, exposures, *, periods=(50, 51), steps=6, bits=8, gamma=1.0, well=10_000.0, read=6.0):
    """Take the (E, n, H, W) images; an exposure of 1 is one that a reflectance of 1 does not quite saturate."""
    white = (1 << bits) - 1
    kind = np.uint8 if bits == 8 else np.uint16
    steps_of = [2 * np.pi * (n * of.u + k / steps) for n in periods for k in range(steps)]
    lights = [0.03 + 0.95 * (0.5 + 0.5 * np.cos(phase)) ** gamma for phase in steps_of]
    out = []
    for time in exposures:
        bright = well * time * of.reflectance
        for light in lights:
            electrons = np.minimum(bright * light, 50 * well)
            electrons += rng.normal(size=electrons.shape) * np.sqrt(electrons + read**2)
            electrons *= white / well
            out.append(np.clip(np.rint(electrons, out=electrons), 0, white, out=electrons).astype(kind))
    return np.array(out).reshape(len(exposures), -1, *of.u.shape)


def hdr(seed):
    """Draw one of many stacks: 3 to 6 exposures over 2 to 3 decades. Returns scene, images, exposures and bits."""
    rng = np.random.default_rng(seed)
    of = scene(rng, sigma=rng.uniform(1.0, 1.5))
    count, decades = int(rng.integers(3, 7)), rng.uniform(2, 3)
    # The reflectance of 1 is the median: some stacks are too dark for most of the surface, some too bright.
    longest = 10 ** rng.uniform(-0.3, 1.3)
    exposures = longest * 10 ** (-decades * np.arange(count)[::-1] / (count - 1))
    bits = int(rng.choice([8, 10, 12]))
    return of, taken(rng, of, exposures, bits=bits), exposures, bits
