"""Pixels of a coarse image that fly side by side: they keep each other from counting as outliers.

On a fine grid the filter of spikes takes them out. A coarse one has a few of them in each cell, and a bump that stands
over few cells looks like them. What tells the two apart is the ply: fibres that lie side by side cannot differ in
length by more than it shears, so that what stands on it falls off along its crest, too, over more than a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from debulk.arrays import Bools, Cloud, Floats
from debulk.inspection.evidence.pieces import pieces_of
from debulk.recipe import options


@dataclass(frozen=True)
class Limits:
    """Of pixels that fly; `tests/python/inspection/test_flying.py` has such pixels, and bumps that are none."""

    steep: float = 2.0  # height over the pitch, or a bump's over its foot's width: a wall of 63 degrees all round
    foot_share: float = 0.25  # of its height, which a group's own surroundings reach if it falls off as a ply does
    unseen_share: float = 0.3  # of the pixels round a group: it may fall off among them
    widest: int = 3  # pixels along each side of a square that stands: what holds one is a bump
    longest_mm: float = 40.0  # what is longer is a standing wrinkle


LIMITS = Limits()
FAR_MM = np.float32(1e6)  # beyond all heights


def without_flying(scan: Cloud, up: Floats, pitch_mm: float) -> Cloud:
    """Return an organised scan (H, W, 3) with NaN for pixels that fly, in a copy; a fine scan is returned as it is.

    `up` (3,) is the mold's z in the scanner's frame.
    """
    if scan.ndim != 3 or not options.SPIKE_SPACING_MM <= pitch_mm < np.inf:
        return scan
    flies = flying(np.einsum("ijk,k->ij", scan, up.astype(np.float32)), pitch_mm)  # `@` would call BLAS
    return np.where(flies[..., None], np.float32(np.nan), scan) if flies.any() else scan


def flying(height: Cloud, pitch_mm: float) -> Bools:
    """Return which pixels of an image of heights (H, W), NaN where nothing was seen, fly above those around."""
    square = np.ones((LIMITS.widest, LIMITS.widest), np.uint8)
    known = np.abs(height) < FAR_MM
    low = cv2.erode(np.where(known, height, FAR_MM), square)
    stands = np.where(known, height - cv2.dilate(np.where(low < FAR_MM, low, -FAR_MM), square), 0)
    flies = stands > LIMITS.steep * pitch_mm
    pieces = pieces_of(flies, 8)
    of, beside = pieces.rings()
    count = len(pieces.sizes)
    unseen_share = np.bincount(of, ~known.flat[beside], count) / np.maximum(np.bincount(of, minlength=count), 1)
    foot = np.zeros(count, np.float32)
    np.maximum.at(foot, of, stands.flat[beside])
    alone = (
        (pitch_mm * np.hypot(*np.diff(pieces.boxes)[:, ::2].T) < LIMITS.longest_mm)
        & (unseen_share <= LIMITS.unseen_share)
        & (foot <= LIMITS.foot_share * pieces.medians(stands))
    )
    return np.asarray(flies & alone[pieces.labels])
