"""From a stage to two clouds with faults, and the truth about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.varied import faults
from lab.varied.polygons import distance
from lab.varied.rendering import Stage
from lab.varied.seeing import Camera
from lab.varied.truth import VariedTruth, write_truth

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class VariedLayup:
    """A virtual layup of the second family, with the attributes of `debulk.scenes.Layup` and a few more.

    Attributes
    ----------
    scan, reference
        (H, W, 3) float32, scanner's frame, mm, NaN where nothing was seen.
    mold_from_scanner
        (4, 4) rigid motion, x_mold = T x_scanner.
    camera
        (f, cx, cy) in pixels.
    ply_outline
        (M, 2) mold XY, mm, counter-clockwise.
    fibre_angles_deg
        The two fibre directions from mold +x, degrees.
    mask
        (H, W) bool, True where a clamp hides the ply; None without a clamp.
    truth
        The surfaces, pockets and unseen areas.
    """

    scan: NDArray[np.float32]
    reference: NDArray[np.float32]
    mold_from_scanner: Floats
    camera: tuple[float, float, float]
    ply_outline: Floats
    fibre_angles_deg: tuple[float, float]
    mask: Bools | None
    truth: VariedTruth


def scanned(
    rng: np.random.Generator,
    stage: Stage,
    angles: tuple[float, float],
    noise: faults.Noise,
    holes_mm: Sequence[float] | int | None,
    cut_height_mm: float,
) -> VariedLayup:
    """Scan a stage with and without the ply, each scan with its own noise and holes."""
    camera, ply, view = stage.camera, stage.ply, stage.scan
    sizes: Sequence[float]
    if holes_mm is None:
        sizes = [float(s) for s in np.exp(rng.uniform(np.log(2), np.log(15), int(rng.integers(0, 7))))]
    elif isinstance(holes_mm, int):
        sizes = [float(s) for s in np.exp(rng.uniform(np.log(2), np.log(100), holes_mm))]
    else:
        sizes = holes_mm
    scan, bad = faults.with_noise(rng, view.depth, noise)
    reference, _ = faults.with_noise(rng, stage.reference, noise)
    few = np.exp(rng.uniform(np.log(2), np.log(10), int(rng.integers(0, 4)))).tolist()
    for depths, widths in ((scan, sizes), (reference, few)):
        x, y = stage.at(depths)
        for width in widths:
            depths[faults.random_hole(rng, _place(rng, ply.outline), width).covers(x, y)] = np.nan
    single = rng.random((2, *scan.shape)) < rng.uniform(0, 0.004)
    scan[single[0]], reference[single[1]] = np.nan, np.nan
    truth = write_truth(stage, angles, cut_height_mm, ~np.isfinite(scan) | view.clamped, ~np.isfinite(reference), bad)
    return VariedLayup(
        scan=_cloud(camera, scan),
        reference=_cloud(camera, reference),
        mold_from_scanner=camera.mold_from_scanner,
        camera=(camera.focal, *camera.middle),
        ply_outline=ply.outline,
        fibre_angles_deg=angles,
        mask=view.clamped if stage.clamp is not None else None,
        truth=truth,
    )


def _place(rng: np.random.Generator, outline: Floats) -> tuple[float, float]:
    """Draw a place on the ply, or up to 5 mm beside it."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    while True:
        x, y = (float(v) for v in rng.uniform(low, high))
        if float(distance(outline, np.array(x), np.array(y))) > -5:
            return x, y


def _cloud(camera: Camera, depth: Floats) -> NDArray[np.float32]:
    """Points at the given depths, in the camera's frame."""
    width, height = camera.size
    u = (np.arange(width) - camera.middle[0]) / camera.focal
    v = (np.arange(height) - camera.middle[1]) / camera.focal
    cloud = np.empty((height, width, 3), np.float32)
    cloud[..., 0], cloud[..., 1], cloud[..., 2] = depth * u[None, :], depth * v[:, None], depth
    return cloud
