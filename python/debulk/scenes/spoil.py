"""The errors of a scanner: noise along the ray, flying pixels, and drop-outs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.scenes.camera import Camera

LEFT_NOISE = 3.0  # the image's left third is this many times noisier
FLYING_MM = (1.0, 20.0)  # displacement along the ray, either way
_RUN_PIXELS = (2, 7)  # half of the flying pixels are in horizontal runs of 2 to 6
_DISC_MM = (2.0, 6.0)  # radius of a drop-out disc on the mold
_DISC_LEAST_PIXELS = 1.6


@dataclass(frozen=True, eq=False)
class Spoiling:
    """The faults of one scan. ``dropout`` and ``flying``: (H, W) bool, never both."""

    dropout: NDArray[np.bool_]
    flying: NDArray[np.bool_]
    flying_index: NDArray[np.int64]  # flat and sorted
    flying_offset_mm: Floats  # along the ray
    noise_mm: float
    seed: tuple[int, int]  # scene, scan; each block of rows draws its noise from its own stream

    def block(self, rows: slice, range_per_depth: Floats, depth: Floats) -> None:
        """Add noise and flying offsets to a block's depths (z in the scanner frame), in place."""
        width = depth.shape[1]
        if self.noise_mm > 0:
            rng = np.random.Generator(np.random.SFC64([*self.seed, rows.start]))
            noise = rng.standard_normal(depth.shape, dtype=np.float32)
            sigma = np.full(width, float(self.noise_mm))
            sigma[: width // 3] *= LEFT_NOISE
            depth += noise * sigma / range_per_depth
        first, last = np.searchsorted(self.flying_index, [rows.start * width, rows.stop * width])
        here = self.flying_index[first:last] - rows.start * width
        depth.reshape(-1)[here] += self.flying_offset_mm[first:last] / range_per_depth.reshape(-1)[here]


def spoil(
    seed: tuple[int, int], camera: Camera, noise_mm: float, flying_share: float, dropout_share: float
) -> Spoiling:
    """Draw the faults of one scan; half of the drop-outs are single pixels, half are discs of a few millimetres."""
    rng = np.random.Generator(np.random.SFC64([*seed, 2**31]))
    height, width = camera.height, camera.width
    count = height * width
    dropout = np.zeros((height, width), dtype=np.bool_)
    dropout.reshape(-1)[rng.integers(0, count, round(0.5 * dropout_share * count))] = True
    _discs(rng, camera, 0.5 * dropout_share * count, dropout)

    singles = rng.integers(0, count, round(0.5 * flying_share * count))
    runs = round(0.5 * flying_share * count / (0.5 * (_RUN_PIXELS[0] + _RUN_PIXELS[1] - 1)))
    lengths = rng.integers(*_RUN_PIXELS, runs)
    starts = rng.integers(0, height, runs) * width + rng.integers(0, width - _RUN_PIXELS[1], runs)
    along = np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    index = np.concatenate([singles, np.repeat(starts, lengths) + along])
    offset = rng.uniform(*FLYING_MM, singles.size + runs) * rng.choice([-1.0, 1.0], singles.size + runs)
    # Within a run, points are displaced alike, as on a smeared edge: by half to all of the run's offset.
    fade = rng.uniform(0.5, 1.0, along.size)
    offset = np.concatenate([offset[: singles.size], np.repeat(offset[singles.size :], lengths) * fade])
    index, chosen = np.unique(index, return_index=True)
    seen = ~dropout.reshape(-1)[index]
    index, offset = index[seen], offset[chosen][seen]
    flying = np.zeros((height, width), dtype=np.bool_)
    flying.reshape(-1)[index] = True
    return Spoiling(dropout, flying, index.astype(np.int64), offset, noise_mm, seed)


def _discs(rng: np.random.Generator, camera: Camera, pixels: float, dropout: NDArray[np.bool_]) -> None:
    """Place discs until they cover this many pixels."""
    pixels_per_mm = camera.f / float(camera.centre[2])
    covered = 0.0
    while covered < pixels:
        radius = max(_DISC_LEAST_PIXELS, rng.uniform(*_DISC_MM) * pixels_per_mm)
        radius = min(radius, np.sqrt((pixels - covered) / np.pi) + 0.5)
        x, y = rng.uniform(0, camera.width), rng.uniform(0, camera.height)
        j0, j1 = max(int(x - radius), 0), min(int(x + radius) + 2, camera.width)
        i0, i1 = max(int(y - radius), 0), min(int(y + radius) + 2, camera.height)
        i, j = np.ogrid[i0:i1, j0:j1]
        disc = (i - y) ** 2 + (j - x) ** 2 <= radius**2
        covered += max(float(np.count_nonzero(disc)), 1.0)
        dropout[i0:i1, j0:j1] |= disc
