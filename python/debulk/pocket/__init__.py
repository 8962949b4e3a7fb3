"""Pockets of a height map: segmentation, foot contours, and the patches for the nets (paper, "Segmentation").

`threads` is the number of threads, 0 as many as the process may use, on which no result depends. Cancelling a `stop`
from another thread ends a search with a RuntimeError.
"""

from __future__ import annotations

from debulk import _core
from debulk.pocket.foot import Feet, Foot, feet
from debulk.pocket.foot import feet_from_core as feet_from_core
from debulk.pocket.foot import feet_with as feet_with
from debulk.pocket.outline import distance_to_outline, inside, inside_outline, polygon_area
from debulk.pocket.patches import Patch, patch
from debulk.pocket.segmentation import Dropped, Pocket, Segmentation, height_noise, segment
from debulk.pocket.segmentation import from_core as from_core
from debulk.pocket.segmentation import segment_with as segment_with

UnseenHole = _core.pocket.UnseenHole
Unseen = _core.pocket.Unseen

__all__ = [
    "Dropped",
    "Feet",
    "Foot",
    "Patch",
    "Pocket",
    "Segmentation",
    "Unseen",
    "UnseenHole",
    "distance_to_outline",
    "feet",
    "height_noise",
    "inside",
    "inside_outline",
    "patch",
    "polygon_area",
    "segment",
]
