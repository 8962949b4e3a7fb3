"""The crests of a net at a minimum: lines that join the peak of one post-processed section to that of the next.

No report draws them: from start to start they differ by a radius of the pocket (bench/study/places.txt).
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import ridge
from debulk.arrays import Floats

_ALONG = ((0, 1), (2, 3))  # columns of a net's neighbours, ahead and back, for each of the two fibre directions
_ACROSS = _ALONG[::-1]  # columns of the neighbours on the next fibre, to either side

Links = list[list[int]]


@dataclass(frozen=True, eq=False)
class NetCrest:
    """A ridge of the net."""

    nodes: tuple[int, ...]
    """Its peaks in order, each on a different fibre."""
    points_mm: Floats
    """(K, 3) positions of these nodes, with one more point at each end, half the path on to the next fibre."""
    section: ridge.RidgeSection
    """Its highest section."""


def net_crests(found: ridge.PostProcessed, neighbours: NDArray[np.int32], nodes_mm: Floats) -> list[NetCrest]:
    """Return the ridges of a post-processed minimum, highest first."""
    links = neighbours.tolist()
    sections = {section.peak: section for section in found.sections}
    crests = []
    for fibre in (0, 1):
        left = {peak for peak, section in sections.items() if section.fibre == fibre}
        while left:
            highest = max((sections[peak] for peak in left), key=lambda s: (s.height_mm, -s.peak))
            nodes = _trace(highest.peak, fibre, links, left, nodes_mm)
            left.difference_update(nodes)
            ends = [
                nodes_mm[node] + 0.5 * _outward(node, links, nodes_mm, side, fibre)
                for node, side in zip((nodes[0], nodes[-1]), reversed(_ACROSS[fibre]), strict=True)
            ]
            crests.append(NetCrest(nodes, np.vstack([ends[0], nodes_mm[list(nodes)], ends[1]]), highest))
    return sorted(crests, key=lambda crest: -crest.section.height_mm)


def _trace(start: int, fibre: int, links: Links, peaks: Collection[int], nodes_mm: Floats) -> tuple[int, ...]:
    """Follow a crest both ways to the nearest peak on each next fibre, at most one node along that fibre."""
    ahead, back = _ALONG[fibre]
    ways = []
    for side in _ACROSS[fibre]:
        path = [start]
        while (beside := links[path[-1]][side]) >= 0:
            near = [node for node in (beside, links[beside][ahead], links[beside][back]) if node in peaks]
            near = [node for node in near if node not in path]
            if not near:
                break
            here = nodes_mm[path[-1], :2]
            path.append(min(near, key=lambda node: float(np.hypot(*(nodes_mm[node, :2] - here)))))
        ways.append(path)
    return (*reversed(ways[1][1:]), *ways[0])


def _outward(node: int, links: Links, nodes_mm: Floats, side: int, fibre: int) -> Floats:
    """Return the vector from a node to the next fibre on one side.

    Without a neighbour on that side, it is the vector from the neighbour on the other side to the node. Without any
    neighbour beside the fibre, it is as long as a segment of the fibre, and at right angles to it.
    """
    other = _ACROSS[fibre][0] + _ACROSS[fibre][1] - side
    if links[node][side] >= 0:
        return np.asarray(nodes_mm[links[node][side]] - nodes_mm[node])
    if links[node][other] >= 0:
        return np.asarray(nodes_mm[node] - nodes_mm[links[node][other]])
    ends = [nodes_mm[links[node][path] if links[node][path] >= 0 else node] for path in _ALONG[fibre]]
    x, y = (ends[0] - ends[1])[:2]
    segment_mm = max(float(np.linalg.norm(end - nodes_mm[node])) for end in ends)
    to_north = 1.0 if (side == _ACROSS[fibre][0]) == (fibre == 0) else -1.0
    return np.asarray(to_north * segment_mm / math.hypot(x, y) * np.array([-y, x, 0.0]))


def distance_mm(line: Floats, points: Floats) -> Floats:
    """Return how far (..., 2) points are from a line in the plane, (K, 2)."""
    from_a, ab = points[..., None, :] - line[:-1], np.diff(line, axis=0)
    share = np.clip((from_a * ab).sum(axis=-1) / np.maximum((ab**2).sum(axis=-1), 1e-30), 0.0, 1.0)
    off = from_a - share[..., None] * ab
    return np.asarray(np.sqrt((off**2).sum(axis=-1)).min(axis=-1))
