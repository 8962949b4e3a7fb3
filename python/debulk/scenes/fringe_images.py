"""The virtual scanner: the fringe images that two cameras would take of a layup, and the truth about them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.arguments import typed
from debulk.arrays import Floats, Singles
from debulk.scanner import Calibration, fringe_patterns
from debulk.scenes.fringe_light import AMBIENT, Texture, light_lines, reflectance
from debulk.scenes.fringe_rig import Rig, View, depths, rig
from debulk.scenes.raycast import Target
from debulk.scenes.scene import Layup

PROJECTOR_PIXELS = (1920, 1200)
FULL_WELL = 14_000.0  # electrons at the greatest grey value
READ_ELECTRONS = 6.0
LENS_BLUR_PIXELS = 0.6  # standard deviation
WHITE = 0.7  # reflectance that just saturates the exposure of 1
_BAND_ROWS = 256  # that are traced at once, to save memory
_HIDDEN = 2e-4  # share of the way from the projector: a surface nearer by more than this blocks the light


@dataclass(frozen=True, eq=False)
class FringeTruth:
    """The truth about fringe images."""

    points_mm: Singles = field(repr=False)
    """(H, W, 3) on the rectified left camera's pixel grid, in its frame: the cloud that a perfect scanner would
    give."""
    seen: NDArray[np.bool_] = field(repr=False)
    """(H, W): those of these points that the projector lights and the right camera sees."""
    left_phase_rad: Singles = field(repr=False)
    """(H, W) in the original left image, NaN where the projector does not light it."""
    right_phase_rad: Singles = field(repr=False)


@dataclass(frozen=True, eq=False)
class FringeImages:
    """The images of a virtual scanner, with calibration, pose and truth."""

    left: NDArray[np.uint8] | NDArray[np.uint16] = field(repr=False)
    """(E, n, H, W), shortest exposure first."""
    right: NDArray[np.uint8] | NDArray[np.uint16] = field(repr=False)
    calibration: Calibration = field(repr=False)
    mold_from_scanner: Floats = field(repr=False)
    """(4, 4) x_mold = T x, for a point in the rectified left camera's frame."""
    truth: FringeTruth = field(repr=False)


@typed
def fringe_images(
    layup: Layup,
    pixels: tuple[int, int] = (1280, 960),
    exposures: Sequence[float] = (1.0, 4.0, 16.0),
    *,
    periods: Sequence[int] = (50, 51),
    steps: int = 6,
    bits: int = 8,
    bare: bool = False,
    repeat: int = 0,
) -> FringeImages:
    """Render the fringe images of a layup that two cameras 420 mm apart would take from a height of 2.4 m.

    A projector between the cameras (1920 x 1200, with its own gamma and blur, and some light where it is black) shows
    `debulk.scanner.fringe_patterns`. The ply is dark carbon fibre with bright highlights at different places for each
    camera; reflectances differ by a factor of 20 and more. The images include ambient light, shadow beside raised
    edges, lens distortion and blur, shot noise, read noise and saturation. Grey values are whole numbers.

    Parameters
    ----------
    layup
        A layup from `debulk.scenes.layup`. The virtual scanner differs from the one that made the layup's clouds.
    pixels
        Width and height of both cameras' images.
    exposures
        Relative exposures in ascending order; 1 is just not saturated by the brightest highlight.
    periods, steps
        As in `debulk.scanner.fringe_patterns`.
    bits
        Bits of a grey value: 8 (uint8), or 10 to 16 (uint16).
    bare
        Whether to render the mold without the ply, from which the reference is scanned.
    repeat
        Number of the scan: the same scene with other noise.

    Returns
    -------
    FringeImages
        Both cameras' images, calibration, pose and truth.

    Raises
    ------
    debulk.InputError
        If an argument is out of its range.

    Examples
    --------
    >>> from debulk.scenes import layup
    >>> images = fringe_images(layup(seed=1, pixels=(64, 48)), pixels=(160, 120), exposures=(1.0, 4.0))
    >>> images.left.shape, images.left.dtype
    ((2, 12, 120, 160), dtype('uint8'))
    """
    if bits not in (8, *range(10, 17)):
        raise InputError(f"bits: expected 8, or 10 to 16, but got {bits!r}")
    times = [float(t) for t in exposures]
    if not times or min(times) <= 0 or sorted(times) != times:
        raise InputError(f"exposures: expected positive times, growing, but got {exposures!r}")
    patterns = fringe_patterns((PROJECTOR_PIXELS[0], 8), periods, steps)
    lines = light_lines(patterns)
    seed = layup._scanner.seed
    instrument = rig(seed, pixels, PROJECTOR_PIXELS)
    bumps = (*layup.truth.pockets, *layup.truth.decoys)
    target = Target(layup._scanner.ply, layup.truth.thickness_mm, tuple(bump.bell for bump in bumps))
    rng = np.random.Generator(np.random.SFC64([seed, 8]))
    textures = Texture.drawn(rng), Texture.drawn(rng)

    taken, phases = [], []
    for side, camera in enumerate((instrument.left, instrument.right)):
        at, bright = (np.empty((camera.height, camera.width)) for _ in range(2))
        for rows in _bands(camera.height):
            rays = camera.rays(rows)
            way = depths(camera, rays, rows.start, camera.centre, target, not bare)
            points = camera.centre + way[..., None] * rays
            at[rows] = _field(points, rows.start, instrument, camera, target, not bare)
            on_ply = target.ply.inside(points[..., 0], points[..., 1]) & (not bare)
            bright[rows] = reflectance(points, on_ply, target, camera, instrument.projector, textures)
        taken.append(_take(lines, at, bright, times, bits, (seed, 10 + 2 * repeat + side, int(bare))))
        phases.append((2 * np.pi * periods[0] * at).astype(np.float32))
    calibration = instrument.calibration()
    cloud, seen, pose = _true_cloud(calibration, instrument, target, not bare)
    truth = FringeTruth(cloud, seen, phases[0], phases[1])
    return FringeImages(taken[0], taken[1], calibration, pose, truth)


def _bands(height: int) -> Iterator[slice]:
    for first in range(0, height, _BAND_ROWS):
        yield slice(first, min(first + _BAND_ROWS, height))


def _field(points: Floats, first: int, instrument: Rig, camera: View, target: Target, ply: bool) -> Floats:
    """Position of the points of some rows in the projector's field, 0 to 1; NaN in shadow or outside."""
    projector = instrument.projector
    local = (points - projector.centre) @ projector.rotation
    f, cx, cy = projector.matrix[0, 0], projector.matrix[0, 2], projector.matrix[1, 2]
    u = (local[..., 0] / local[..., 2] * f + cx + 0.5) / projector.width
    v = (local[..., 1] / local[..., 2] * f + cy + 0.5) / projector.height
    way = depths(camera, points - projector.centre, first, projector.centre, target, ply, spare=24)
    lit = (u > 0) & (u < 1) & (v > 0) & (v < 1) & (way > 1 - _HIDDEN)
    return np.where(lit, u, np.nan)


def _take(
    lines: Floats, at: Floats, bright: Floats, times: list[float], bits: int, seed: tuple[int, int, int]
) -> NDArray[np.uint8]:
    """Expose, blur, add noise, quantise."""
    import cv2

    white = (1 << bits) - 1
    kind = np.uint8 if bits == 8 else np.uint16
    out = np.empty((len(times), len(lines), *at.shape), kind)
    lit = np.isfinite(at)
    grid = (np.arange(lines.shape[1]) + 0.5) / lines.shape[1]

    def take(k: int) -> None:
        line = lines[k]
        light = np.where(lit, np.interp(np.where(lit, at, 0.5), grid, line), 0.0) + AMBIENT
        image = cv2.GaussianBlur((bright * light).astype(np.float32), (0, 0), LENS_BLUR_PIXELS)
        for e, time in enumerate(times):
            rng = np.random.Generator(np.random.SFC64([*seed, k, e]))
            electrons = image * np.float32(time / WHITE * FULL_WELL)
            electrons += rng.standard_normal(at.shape, dtype=np.float32) * np.sqrt(
                electrons + np.float32(READ_ELECTRONS**2)
            )
            levels = np.rint(electrons * np.float32(white / FULL_WELL))
            out[e, k] = np.clip(levels, 0, white).astype(kind)

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(take, range(len(lines))))
    return out


def _true_cloud(
    calibration: Calibration, instrument: Rig, target: Target, ply: bool
) -> tuple[Singles, NDArray[np.bool_], Floats]:
    """Points on the rectified left grid, which of them are lit and seen by both cameras, and the pose."""
    rectified, left = calibration.rectified, instrument.left
    width, height = rectified.pixels
    f, cx, cy = rectified.camera
    turned = left.rotation @ rectified.rotation.T
    matrix = np.array([[f, 0, cx], [0, f, cy], [0, 0, 1.0]])
    grid = View(turned, left.centre, matrix, np.zeros(5), width, height)
    cloud, seen = np.empty((height, width, 3), np.float32), np.empty((height, width), np.bool_)
    across = (np.arange(width) - cx)[None, :] / f
    for rows in _bands(height):
        rays = grid.rays(rows)
        depth = depths(grid, rays, rows.start, left.centre, target, ply)
        points = left.centre + depth[..., None] * rays
        down = (np.arange(rows.start, rows.stop) - cy)[:, None] / f
        cloud[rows] = np.stack([across * depth, down * depth, depth], axis=-1)
        lit = np.isfinite(_field(points, rows.start, instrument, grid, target, ply))
        way = points - instrument.right.centre
        back = depths(grid, way, rows.start, instrument.right.centre, target, ply, spare=24)
        seen[rows] = lit & (back > 1 - _HIDDEN)
        for view in (instrument.right, left):
            place = view.project(points.reshape(-1, 3)).reshape(*depth.shape, 2)
            inside = (place >= 0).all(axis=-1) & (place[..., 0] <= view.width - 1) & (place[..., 1] <= view.height - 1)
            seen[rows] &= inside
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turned, left.centre
    return cloud, seen, pose
