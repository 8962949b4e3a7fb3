"""Stretches of fibre lines off the mold, grouped into places: neighbours on adjacent lines belong together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Floats
from debulk.fibre import FibreRuns

Numbers = NDArray[np.intp]
_EDGE_MM, _EDGE_SHARE = 3.0, 0.05  # how near to the outline a line must end, at least and per length beyond a place


@dataclass(frozen=True, eq=False)
class Places:
    """The stretches, one row of every array for each, sorted by family, line, and place along the line."""

    rows: Numbers
    """(N,) their numbers among the runs."""
    line: Numbers
    """(R,) for each run, the number of its line, which counts through both families."""
    place: Numbers
    """(N,) number of the place to which the stretch belongs."""
    along: Floats
    """(N, 2) direction of the line there, from `from_mm` to `to_mm`."""
    ends_mm: Floats
    exits_mm: Floats
    """`ends_mm`, `exits_mm`: (N, 2, 2) both ends of the stretch, and where the line leaves the ply beyond each; mold
    XY."""
    flat_mm: Floats
    away_mm: Floats
    """`flat_mm`, `away_mm`: (N, 2) flat ply from each end to the next stretch on the line, or to the ply's edge; and
    all flat ply from there to the edge."""
    following: NDArray[np.intp]
    """(N, 2) number of that next stretch; -1: it is the edge."""
    span_mm: Floats
    """(R, 2) for each run, where it begins and ends along its line."""
    to_edge: NDArray[np.bool_]
    """(N, 2) whether nothing unseen lies between that end and the ply's edge."""


def places_of(runs: FibreRuns, crossed: NDArray[np.int32], outline: Floats | None, apart_mm: float) -> Places:
    """Group the single stretches among the runs, of which neighbours are `apart_mm` apart.

    `crossed` is (R,) the number of the pocket that each run crosses; 0: none. Stretches of different pockets are
    different places.
    """
    key = np.unique(np.stack([runs.family, runs.line]), axis=1, return_inverse=True)[1].reshape(-1)
    chord = runs.to_mm - runs.from_mm
    summed = np.stack([np.bincount(key, chord[:, k]) for k in (0, 1)], axis=1).astype(np.float64)[key]
    of_line = summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), 1e-9)
    span = np.stack([(at * of_line).sum(axis=1) for at in (runs.from_mm, runs.to_mm)], axis=1)
    rows = np.flatnonzero(runs.spans == 1)
    rows = rows[np.lexsort((span[rows, 0], key[rows]))]
    line, ends, beyond = key[rows], np.stack([runs.from_mm[rows], runs.to_mm[rows]], axis=1), runs.beyond_mm[rows]
    along = chord[rows] / np.maximum(np.linalg.norm(chord[rows], axis=1, keepdims=True), 1e-9)
    exits = ends + np.stack([-along, along], axis=1) * beyond[:, :, None]
    following, flat = np.full((len(rows), 2), -1, dtype=np.intp), beyond.copy()
    same = np.flatnonzero(line[1:] == line[:-1])
    following[same, 1], following[same + 1, 0] = same + 1, same
    flat[same, 1] = flat[same + 1, 0] = np.linalg.norm(ends[same + 1, 0] - ends[same, 1], axis=1)
    away = flat.copy()
    for k in range(1, len(rows)):
        away[k, 0] += away[k - 1, 0] if following[k, 0] >= 0 else 0.0
        away[-1 - k, 1] += away[-k, 1] if following[-1 - k, 1] >= 0 else 0.0
    if outline is None:
        to_edge = np.zeros((len(rows), 2), dtype=bool)
    else:
        off = pocket.distance_to_outline(outline, exits.reshape(-1, 2)).reshape(-1, 2)
        to_edge = off <= _EDGE_MM + _EDGE_SHARE * beyond
    place = _joined(2 * crossed[rows].astype(np.intp) + runs.family[rows], along, ends, apart_mm)
    return Places(rows, key, place, along, ends, exits, flat, away, following, span, to_edge)


def _joined(kind: Numbers, along: Floats, ends: Floats, apart_mm: float) -> Numbers:
    """Give stretches of one kind that overlap on lines next to each other the number of one place."""
    middle, half = ends.mean(axis=1), 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    place = np.full(len(kind), -1, dtype=np.intp)
    for first in range(len(kind)):
        if place[first] >= 0:
            continue
        place[first], open_ends = place.max() + 1, [first]
        while open_ends:
            k = open_ends.pop()
            off = middle - middle[k]
            lengthwise, across = off @ along[k], off @ np.array([-along[k, 1], along[k, 0]])
            near = (kind == kind[k]) & (np.abs(across) < 1.6 * apart_mm) & (np.abs(lengthwise) < half + half[k])
            new = np.flatnonzero(near & (place < 0))
            place[new] = place[k]
            open_ends += new.tolist()
    return place
