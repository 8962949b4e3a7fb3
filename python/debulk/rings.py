"""Outlines with cut-outs: rings one after another in one array, each of which ends with its first corner again.

So an outline is (M, 2) corners everywhere, in files and reports as in the core, and one without cut-outs is what it
was: a polygon whose last corner leads to its first. A cut-out's edge is an edge of the ply like the outer one.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from debulk import _core, arrays
from debulk._core import InputError
from debulk.arrays import Floats

_APART_MM = 0.01  # rings that are nearer to each other touch


def split(outline: Floats) -> list[Floats]:
    """Return the rings of an outline, (N, 2) each, the outside first; no last corner repeats the first.

    Examples
    --------
    >>> square = np.array([(0, 0), (4, 0), (4, 4), (0, 4)])
    >>> [len(ring) for ring in split(joined([square, 0.5 * square + 1]))], [len(ring) for ring in split(square)]
    ([4, 4], [4])
    """
    return [outline[begin:end] for begin, end in _core.pocket.rings(outline)]


def joined(rings: Sequence[Floats]) -> Floats:
    """Return one array of all rings; a single ring stays as it is."""
    return rings[0] if len(rings) == 1 else np.concatenate([np.vstack([ring, ring[:1]]) for ring in rings])


def said(outline: Floats) -> str:
    """Return how many corners an outline has, and how many cut-outs."""
    corners, *cut = split(outline)
    cuts = f", {len(cut)} cut-out{'s'[: len(cut) > 1]}" if cut else ""
    return f"{len(corners) + sum(map(len, cut))} corners{cuts}"


def outline(value: ArrayLike, name: str) -> Floats:
    """Return the checked corners of a ply, (M, 2), as a copy, from one polygon or from a sequence of rings.

    The first ring is the outside and runs counter-clockwise, the others are cut out of it and run clockwise; a single
    polygon keeps its direction. Each ring is checked as `arrays.outline` says. Refused are rings that cross, touch or
    lie within another cut-out, or outside the first.

    Examples
    --------
    >>> square = np.array([(0, 0), (400, 0), (400, 300), (0, 300)])
    >>> outline([square, 0.1 * square + 100], "ply_outline").shape
    (10, 2)
    >>> outline([0.1 * square + 100, square], "ply_outline")
    Traceback (most recent call last):
    ...
    debulk._core.InputError: ply_outline, cut-out 1: expected a ring inside the first, which is the ply's outside, ...
    """
    given = _given(value, name)
    if given is None:
        return arrays.outline(value, name)
    names = [name if k == 0 else f"{name}, cut-out {k}" for k in range(len(given))]
    found = [arrays.outline(ring, each) for ring, each in zip(given, names, strict=True)]
    if len(found) == 1:
        return found[0]
    for ring, each in zip(found, names, strict=True):
        if len(np.unique(ring, axis=0)) < len(ring):
            raise InputError(f"{each}: expected a ring that does not touch itself, but it has a corner twice")
    found = [ring if (_core.pocket.polygon_area(ring) > 0) == (k == 0) else ring[::-1] for k, ring in enumerate(found)]
    _check_apart(found, names)
    return joined(found)


def _given(value: ArrayLike, name: str) -> list[ArrayLike] | None:
    """Return the rings of a sequence of arrays, or of an array that holds several; None: one polygon."""
    try:
        if (isinstance(value, (list, tuple)) and {np.ndim(ring) for ring in value} == {2}) or np.ndim(value) == 3:
            return list(value)  # type: ignore[arg-type]
        if np.ndim(value) != 2:
            return None
    except ValueError:  # rows of different lengths
        return None
    flat = arrays.numbers(value, name, (None, 2), "an (M, 2) array of corners in mm")
    # A polygon that is joined to its cut-outs by slits ends where it began.
    rings = max(split(flat), split(flat[:-1]) if np.array_equal(flat[:1], flat[-1:]) else [], key=len)
    return list(rings) if len(rings) > 1 else None


def _check_apart(rings: Sequence[Floats], names: Sequence[str]) -> None:
    """Refuse rings that cross or touch, cut-outs outside the first ring, and cut-outs within cut-outs."""
    ends = [np.roll(ring, -1, axis=0) for ring in rings]
    for (i, one), (j, other) in combinations(enumerate(rings), 2):
        near = np.array([*_nearest(one, other), *_nearest(other, one)])
        found = arrays.crossing(np.concatenate([one, other]), np.concatenate([ends[i], ends[j]]))
        if found is not None or near[0] < _APART_MM or near[3] < _APART_MM:
            x, y = found[2] if found is not None else near[1:3] if near[0] <= near[3] else near[4:]
            raise InputError(
                f"{names[j]}: expected rings that lie apart, but it meets {'the outside' if i == 0 else names[i]} "
                f"near ({x:.4g}, {y:.4g}) mm; a notch belongs to the ring that it cuts"
            )
        within = bool(_core.pocket.inside_polygon(one, other[:1])[0])
        x, y = other[0]
        if i == 0 and not within:
            raise InputError(
                f"{names[j]}: expected a ring inside the first, which is the ply's outside, but it lies at "
                f"({x:.4g}, {y:.4g}) mm: give the outside first, and one ply at a time"
            )
        if i > 0 and (within or _core.pocket.inside_polygon(other, one[:1])[0]):
            raise InputError(
                f"{names[j]}: expected cut-outs beside each other, but one of it and {names[i]} lies within the other, "
                f"at ({x:.4g}, {y:.4g}) mm: what lies within a cut-out is another ply"
            )


def _nearest(ring: Floats, corners: Floats) -> tuple[float, float, float]:
    """Return the least distance of corners from a ring, and the corner that has it."""
    away = _core.pocket.distance_to_outline(ring, corners)
    k = int(np.argmin(away))
    return float(away[k]), float(corners[k, 0]), float(corners[k, 1])
