"""The truth about a varied layup: each pocket's size, place and excess length, and how much of it was seen."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.varied.bumps import Bump
from lab.varied.fibres import Excess, excess
from lab.varied.ply import Ply
from lab.varied.polygons import distance
from lab.varied.regions import Height, Lattice, Measured, label_regions, measure
from lab.varied.rendering import Stage
from lab.varied.seeing import Camera

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

AREA_TOL_MM2, PEAK_TOL_MM = 200.0, 1.25  # of the paper's segmentation; PeakTol is measured from the cut


@dataclass(frozen=True)
class KnownPocket:
    """A region of the ply above the cut height, or a foot that stays below it, as it is without any noise."""

    kinds: tuple[str, ...]
    """The shapes of which it is made."""
    centre_mm: tuple[float, float]
    """Place of its highest point, mold XY."""
    outline_mm: Floats
    """(M, 2) contour at the cut, within a cell of the quadrature at the ply's edge; (0, 2) if it stays below the
    cut."""
    area_mm2: float
    """Area above the cut, so that the laid ply in the middle of a ring is not part of it."""
    volume_mm3: float
    """Integral of the height above the mold over the area, including the ply's thickness."""
    peak_mm: float
    """Largest height of the ply's upper side above the mold."""
    touches_ply_edge: bool
    excess: Excess
    ridge_mm: float
    """Height of the ridge that the held excess makes, ΔL/2 + 0.43 t, which expresses the decisive excess as a ridge."""
    unseen_share: float
    """Share of the area without a point in the scan, for whatever reason."""
    reference_unseen_share: float
    rim_unseen_share: float
    """Share of a line 3 mm outside the outline that has no point in the scan."""


@dataclass(frozen=True)
class VariedTruth:
    """The truth about a varied layup."""

    pockets: tuple[KnownPocket, ...]
    """Pockets above all tolerances, largest area first."""
    decoys: tuple[KnownPocket, ...]
    """Bumps that the tolerances on area and peak drop, and feet below the cut."""
    thickness_mm: float
    cut_height_mm: float
    mold_kind: str
    bumps: tuple[Bump, ...]
    unseen: Bools
    """(H, W): pixels on the ply without a point in the scan."""
    reference_unseen: Bools
    bad: Bools
    """(H, W): flying pixels and highlights of the scan."""
    ply_seen_share: float
    """Share of the ply's pixels with a point in scan and reference."""
    ply: Ply

    def mold_height(self, xy: ArrayLike) -> Floats:
        """Height of the surface below the ply, at (..., 2) positions, mold frame."""
        xy = np.asarray(xy, dtype=np.float64)
        return self.ply.mold.height(xy[..., 0], xy[..., 1])

    def ply_height_above_mold(self, xy: ArrayLike) -> Floats:
        """Height of the ply's upper side above the mold at (..., 2) positions; 0 beside the ply."""
        xy = np.asarray(xy, dtype=np.float64)
        return self.ply.height_above_mold(xy[..., 0], xy[..., 1])

    @property
    def ridge_mm(self) -> float:
        """Highest ridge that any held excess makes, in pockets and decoys; 0.43 t if there is none."""
        return max((p.ridge_mm for p in (*self.pockets, *self.decoys)), default=0.43 * self.thickness_mm)


@dataclass(frozen=True)
class Surfaces:
    """A known ply on a known mold, from any generator."""

    height: Height
    """Upper side of the ply above the mold; 0 or continued beside the ply."""
    mold: Height
    outline: Floats
    thickness_mm: float
    angles_deg: tuple[float, float]


@dataclass(frozen=True)
class Sized:
    """A region's dimensions and the excess of its fibres."""

    region: Measured
    excess: Excess

    def ridge_mm(self, thickness_mm: float) -> float:
        """Height of the ridge that the held excess makes."""
        return 0.5 * self.excess.held_mm + 0.43 * thickness_mm


def size_up(known: Surfaces, cut_height_mm: float, low_mm: float = 0.25) -> list[Sized]:
    """Measure every region above the cut, and every foot with a peak gap above `low_mm` that contains none."""
    cuts = label_regions(known.height, known.outline, cut_height_mm)
    feet = label_regions(known.height, known.outline, known.thickness_mm + 3e-3)
    found = [_one(known, cuts, feet, label, cut_height_mm) for label in range(1, int(cuts.values.max()) + 1)]
    sized = [one for one in found if one is not None]
    with_cut = np.unique(feet.values[cuts.values > 0])
    x, y = np.meshgrid(
        feet.x0 + feet.step * np.arange(feet.values.shape[1]), feet.y0 + feet.step * np.arange(feet.values.shape[0])
    )
    gaps = np.where(feet.values > 0, known.height(x, y) - known.thickness_mm, 0.0)
    tops = np.zeros(int(feet.values.max()) + 1)
    np.maximum.at(tops, feet.values.ravel(), gaps.ravel())
    for label in range(1, len(tops)):
        if label not in with_cut and tops[label] > low_mm:
            sized.append(_below(known, feet, label, float(tops[label])))
    return sorted(sized, key=lambda s: -s.region.area_mm2)


def _one(known: Surfaces, cuts: Lattice, feet: Lattice, label: int, cut: float) -> Sized | None:
    region = measure(known.height, known.outline, cut, cuts, label)
    if region is None:
        return None
    foot = int(np.bincount(feet.values[cuts.values == label]).argmax())
    return Sized(region, _excess(known, cuts, label, feet.box(foot)))


def _below(known: Surfaces, feet: Lattice, label: int, top: float) -> Sized:
    x, y = feet.places(feet.values == label)
    best = int(np.argmax(known.height(x, y)))
    region = Measured(
        label, 0.0, 0.0, top + known.thickness_mm, (float(x[best]), float(y[best])), np.zeros((0, 2)), False
    )
    return Sized(region, _excess(known, feet, label, feet.box(label)))


def _excess(known: Surfaces, labels: Lattice, label: int, box: tuple[float, float, float, float]) -> Excess:
    return excess(known.height, known.mold, known.outline, known.thickness_mm, known.angles_deg, labels, label, box)


def kinds_at(bumps: tuple[Bump, ...], known: Measured) -> tuple[str, ...]:
    """Names of the bumps that lift the ply at the top of a region, the highest first."""
    x, y = np.array(known.centre_mm[0]), np.array(known.centre_mm[1])
    gaps = [(float(b.gap(x, y)), b.kind) for b in bumps]
    return tuple(dict.fromkeys(kind for gap, kind in sorted(gaps, reverse=True) if gap > 0.05))


def seen_shares(labels: Lattice, count: int, top: Height, camera: Camera, unseen: Bools) -> tuple[Floats, Floats]:
    """Share of each region 1 .. count without a point, and the same for a ring 4 mm wide round it."""
    shares, rims = np.zeros(count), np.zeros(count)
    for label in range(1, count + 1):
        mask = (labels.values == label).astype(np.uint8)
        ring = cv2.dilate(mask, np.ones((9, 9), np.uint8)) - mask
        for nodes, target in ((mask, shares), (ring, rims)):
            hidden = at_pixels(*labels.places(nodes > 0), top, camera, unseen)
            target[label - 1] = hidden.mean() if len(hidden) else 0.0
    return shares, rims


def at_pixels(x: Floats, y: Floats, top: Height, camera: Camera, mask: Bools) -> Bools:
    """Values of an image's mask where the camera sees the surface's points; True outside the image."""
    pixels = np.rint(camera.project(np.stack([x, y, top(x, y)], axis=-1))).astype(np.int64)
    u, v = pixels[..., 0], pixels[..., 1]
    fits = (u >= 0) & (v >= 0) & (u < mask.shape[1]) & (v < mask.shape[0])
    found = mask[np.clip(v, 0, mask.shape[0] - 1), np.clip(u, 0, mask.shape[1] - 1)]
    return np.where(fits, found, True)


def write_truth(
    stage: Stage,
    angles: tuple[float, float],
    cut_height_mm: float,
    unseen: Bools,
    reference_unseen: Bools,
    bad: Bools,
) -> VariedTruth:
    """Measure everything on a stage; `unseen` are pixels without a point, or hidden by a clamp."""
    ply, camera = stage.ply, stage.camera

    def height(x: Floats, y: Floats) -> Floats:
        return ply.thickness_mm + (ply.gap_in_image(x, y) if np.ndim(x) == 2 else ply.gap(x, y))

    known = Surfaces(height, ply.mold.smooth_height, ply.outline, ply.thickness_mm, angles)
    sized = size_up(known, cut_height_mm)
    cuts = label_regions(height, ply.outline, cut_height_mm)
    count = int(cuts.values.max())
    scan_shares, rims = seen_shares(cuts, count, ply.top, camera, unseen)
    reference_shares, _ = seen_shares(cuts, count, ply.mold.smooth_height, camera, reference_unseen)

    def written(one: Sized) -> KnownPocket:
        region = one.region
        k = region.label - 1 if region.area_mm2 > 0 else None
        return KnownPocket(
            kinds=kinds_at(ply.bumps, region),
            centre_mm=region.centre_mm,
            outline_mm=region.outline_mm,
            area_mm2=region.area_mm2,
            volume_mm3=region.volume_mm3,
            peak_mm=region.peak_mm,
            touches_ply_edge=region.touches_ply_edge,
            excess=one.excess,
            ridge_mm=one.ridge_mm(ply.thickness_mm),
            unseen_share=0.0 if k is None else float(scan_shares[k]),
            reference_unseen_share=0.0 if k is None else float(reference_shares[k]),
            rim_unseen_share=0.0 if k is None else float(rims[k]),
        )

    all_known = [written(one) for one in sized]
    large = [p.area_mm2 >= AREA_TOL_MM2 and p.peak_mm >= cut_height_mm + PEAK_TOL_MM for p in all_known]
    low, high = ply.outline.min(axis=0), ply.outline.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0], high[0], 3.0), np.arange(low[1], high[1], 3.0))
    on_ply = distance(ply.outline, x, y) > 0
    hidden = at_pixels(x[on_ply], y[on_ply], ply.top, camera, unseen | reference_unseen)
    return VariedTruth(
        pockets=tuple(p for p, is_large in zip(all_known, large, strict=True) if is_large),
        decoys=tuple(p for p, is_large in zip(all_known, large, strict=True) if not is_large),
        thickness_mm=ply.thickness_mm,
        cut_height_mm=cut_height_mm,
        mold_kind=ply.mold.kind,
        bumps=ply.bumps,
        unseen=unseen,
        reference_unseen=reference_unseen,
        bad=bad,
        ply_seen_share=float(1 - hidden.mean()),
        ply=ply,
    )
