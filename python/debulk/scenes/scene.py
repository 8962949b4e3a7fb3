"""The virtual layup: a scan, its reference, and the truth about it."""

from __future__ import annotations

import functools
import math
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError
from debulk.arguments import typed, whole
from debulk.arrays import Floats, Singles
from debulk.scenes import mold
from debulk.scenes.bump import Bump
from debulk.scenes.camera import aim
from debulk.scenes.debulked import Debulked, Scanner, debulk
from debulk.scenes.outline import StarPolygon, irregular_outline
from debulk.scenes.placement import place
from debulk.scenes.raycast import Target, cast
from debulk.scenes.spoil import spoil

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Truth:
    """The truth about a virtual layup, in the mold frame, mm."""

    pockets: tuple[Bump, ...]
    """The 14 air pockets, largest area at the cut first."""
    decoys: tuple[Bump, ...]
    """Bumps just below AreaTol (2 cm² at the cut), PeakTol (1.25 mm above the cut) or CutHeight, two of each."""
    thickness_mm: float
    cut_height_mm: float
    dropout: Mask = field(repr=False)
    """(H, W): pixels of the scan that saw nothing."""
    flying: Mask = field(repr=False)
    """(H, W): pixels of the scan whose point flies off along its ray."""
    reference_dropout: Mask = field(repr=False)
    reference_flying: Mask = field(repr=False)
    _ply: StarPolygon = field(repr=False)

    def mold_height(self, xy: ArrayLike) -> Floats:
        """Height of the mold, or of the table beside it; (..., 2) mold XY to (...) z, mm."""
        x, y = _xy(xy)
        return np.where(mold.inside(x, y), mold.height(x, y), mold.TABLE_Z_MM)

    def ply_height_above_mold(self, xy: ArrayLike) -> Floats:
        """Height of the ply's upper side above the mold, along z; 0 beside the ply; (..., 2) mold XY to (...), mm."""
        x, y = _xy(xy)
        height = np.full(x.shape, self.thickness_mm)
        for bump in (*self.pockets, *self.decoys):
            bell = bump.bell
            if not all(np.any(np.abs(at - c) < bell.radii_mm[0]) for at, c in zip((x, y), bell.centre_mm, strict=True)):
                continue  # most bells are far from a line of points
            near = np.hypot(x - bell.centre_mm[0], y - bell.centre_mm[1]) < bell.radii_mm[0]
            height[near] += bell.rise(x[near], y[near])
        return np.where(self._ply.inside(x, y), height, 0.0)


@dataclass(frozen=True, eq=False)
class Layup:
    """A virtual layup as a scanner would see it, and the truth about it."""

    scan: Singles = field(repr=False)
    """(H, W, 3) organised cloud of the draped ply, scanner frame, mm; NaN where nothing was seen."""
    reference: Singles = field(repr=False)
    """(H, W, 3) organised cloud of the bare mold, in the same form."""
    mold_from_scanner: Floats
    """4x4, x_mold = T x_scanner."""
    camera: tuple[float, float, float]
    """f, cx, cy in pixels: pixel (i, j) looks along ((j - cx) / f, (i - cy) / f, 1)."""
    ply_outline: Floats = field(repr=False)
    """(M, 2) mold XY, counter-clockwise, with the last point joined to the first, mm."""
    truth: Truth = field(repr=False)
    _scanner: Scanner = field(repr=False)

    def debulked(self, bulk_factor: float = 1.2) -> Debulked:
        """Debulk the layup and scan it again, with faults as in the other scans.

        The result is made from the truth alone, by a rule of thumb. The ply is everywhere its consolidated thickness
        above the mold, and the excess length of a pocket over its short axis, minus 0.2 mm (0.7 mm at the ply's edge,
        where it slides out), remains as one narrow ridge along the long axis. It serves to test `debulk.compare`;
        agreement with it is no evidence for a prediction.

        Parameters
        ----------
        bulk_factor
            Ratio of thickness before debulking to thickness after it, 1 to 5.

        Returns
        -------
        Debulked
            The debulked layup; `debulk.compare` takes its ``scan``.

        Raises
        ------
        debulk.InputError
            If the bulk factor is out of its range.

        Examples
        --------
        >>> after = layup(seed=1, pixels=(64, 48)).debulked()
        >>> after.scan.shape, round(after.thickness_mm, 3)
        ((48, 64, 3), 0.25)
        """
        _check("bulk_factor", bulk_factor, 1.0, 5.0, "a factor of 1 to 5")
        return debulk(self.truth.pockets, self.truth.decoys, self._scanner, self.truth.thickness_mm, bulk_factor)


@typed
def layup(
    seed: int = 0,
    pixels: tuple[int, int] = (1280, 960),
    pitch_mm: float | None = None,
    *,
    noise_mm: float = 0.05,
    flying_share: float = 0.005,
    dropout_share: float = 0.02,
    thickness_mm: float = 0.3,
    cut_height_mm: float = 2.0,
    repeat: int = 0,
    threads: int | None = None,
) -> Layup:
    """Make a virtual layup: a ply with 14 air pockets on a double-curved mold, seen by a tilted pinhole camera.

    The mold is 1.2 x 0.9 m, with its crest 110 mm above a flat table; the camera is 2.4 m above the crest. The pockets
    are bells H cos²(πρ/2) over ellipses, 438 to 5.35 cm² at the cut height and 3.6 to 15 mm high above the reference.
    Two are cut by the ply's edge, two are long and narrow, and two lie 7 mm from each other. The areas at the cut are
    the same for every seed; places and directions are free, and peaks and aspect ratios vary by 4 %. The ply's edge is
    open: beyond a raised edge the rays reach the mold and leave a strip of it unseen.

    Parameters
    ----------
    seed
        Seed, not negative. The same seed and arguments give the same bits.
    pixels
        Width and height of the image, at least 32 each.
    pitch_mm
        Distance between neighbouring points on the mold, mm (the root of a point's mean share of the mold's area).
        None: the mold fills the image. 0.55 at 5120 x 3840 is 0.3 mm² per point, with much table around.
    noise_mm
        Standard deviation along the ray, mm; three times as much in the image's left third.
    flying_share
        Share of pixels that are displaced along their ray by 1 to 20 mm (0.5 to 20 in runs), half of them in short
        rows.
    dropout_share
        Share of pixels that see nothing: half of them are single pixels, half are discs of 2 to 6 mm radius.
    thickness_mm
        Thickness of the ply along z, at most 0.6 mm.
    cut_height_mm
        Height above the reference at which the truth's areas are taken, 1.2 to 2.2 mm. The pockets are sized so that
        they have their areas there.
    repeat
        Number of the scan, from 0: the same ply and scanner with other faults; the reference stays the same.
    threads
        Number of threads; None means one per core. The result does not depend on it.

    Returns
    -------
    Layup
        Scan and reference, each with its own faults, pose, camera, outline and truth.

    Raises
    ------
    debulk.InputError
        If an argument is out of its range, or the mold does not fit into the image at that pitch.

    Examples
    --------
    >>> scene = layup(seed=1, pixels=(64, 48))
    >>> scene.scan.shape, len(scene.truth.pockets)
    ((48, 64, 3), 14)
    >>> [round(p.area_mm2) for p in scene.truth.pockets[:3]]
    [43800, 9000, 6200]
    """
    whole("seed", seed, 0, 2**63 - 1)
    if not isinstance(pixels, tuple | list) or len(pixels) != 2:
        raise InputError(f"pixels: expected (width, height), but got {pixels!r}")
    width, height = (whole("pixels", n, 32, 20000) for n in pixels)
    if pitch_mm is not None:
        _check("pitch_mm", pitch_mm, 0.0, 1000.0, "a positive distance in mm or None", above=True)
    _check("noise_mm", noise_mm, 0.0, 10.0, "a standard deviation of 0 to 10 mm")
    _check("flying_share", flying_share, 0.0, 0.5, "a share of 0 to 0.5")
    _check("dropout_share", dropout_share, 0.0, 0.5, "a share of 0 to 0.5")
    _check("thickness_mm", thickness_mm, 0.0, 0.6, "a thickness above 0, at most 0.6 mm", above=True)
    _check("cut_height_mm", cut_height_mm, 1.2, 2.2, "a height of 1.2 to 2.2 mm")
    whole("repeat", repeat, 0, 10**6)
    if threads is not None:
        whole("threads", threads, 1, 1024)

    camera = aim(_drawing(seed), (width, height), pitch_mm)
    edge, pockets, decoys = _drawn(seed, thickness_mm, cut_height_mm)
    outline = edge.copy()
    ply = StarPolygon(outline)
    target = Target(ply, thickness_mm, tuple(b.bell for b in (*pockets, *decoys)))
    streams = (1 if repeat == 0 else 3 + repeat, 2)  # 3 is for the debulked scan
    faults, reference_faults = (spoil((seed, k), camera, noise_mm, flying_share, dropout_share) for k in streams)
    workers = threads or os.cpu_count() or 1
    scan, reference = cast(camera, target, faults, reference_faults, workers)
    assert reference is not None
    truth = Truth(
        pockets=pockets,
        decoys=decoys,
        thickness_mm=thickness_mm,
        cut_height_mm=cut_height_mm,
        dropout=faults.dropout,
        flying=faults.flying,
        reference_dropout=reference_faults.dropout,
        reference_flying=reference_faults.flying,
        _ply=ply,
    )
    scanner = Scanner(camera, ply, seed, noise_mm, flying_share, dropout_share, workers)
    intrinsics = (camera.f, camera.cx, camera.cy)
    return Layup(scan, reference, camera.mold_from_scanner, intrinsics, outline, truth, scanner)


def _drawing(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64([seed, 0]))


@functools.lru_cache(maxsize=32)  # two thirds of the time of a small scan, of which a layup may have many
def _drawn(seed: int, thickness_mm: float, cut_height_mm: float) -> tuple[Floats, tuple[Bump, ...], tuple[Bump, ...]]:
    """Draw the ply's outline, pockets and decoys of a layup, which are the same in every image of it."""
    rng = _drawing(seed)
    aim(rng, (64, 48), None)  # what is drawn first, for any image
    outline = irregular_outline(rng)
    pockets, decoys = place(rng, outline, thickness_mm, cut_height_mm)
    for bump in (*pockets, *decoys):
        bump.outline_mm.flags.writeable = bump.foot_outline_mm.flags.writeable = False
    return outline, tuple(pockets), tuple(decoys)


def _xy(xy: ArrayLike) -> tuple[Floats, Floats]:
    points = np.asarray(xy, dtype=np.float64)
    if points.ndim == 0 or points.shape[-1] != 2:
        raise InputError(f"xy: expected an array of shape (..., 2), but got {points.shape}")
    return points[..., 0], points[..., 1]


def _check(name: str, value: Any, low: float, high: float, expected: str, above: bool = False) -> None:
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or not low <= value <= high or (above and value == low):
        raise InputError(f"{name}: expected {expected}, but got {value!r}")
