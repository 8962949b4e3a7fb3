"""From the coarse net at the minimum to the ridges that remain on the mold: heights, RMS and excess length."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.arguments import typed
from debulk.arrays import same_named

if TYPE_CHECKING:
    from debulk.surface import Reference

__all__ = [
    "PostProcessed",
    "RidgeSection",
    "excess_of_ridge",
    "largest_fibre_excess",
    "post_process",
    "ridge_height",
]


@typed
def ridge_height(ply_length_mm: float, mold_length_mm: float, thickness_mm: float) -> float:
    """Height of a ridge from the length of ply that it has to hold.

    The cross-section is two thicknesses wide with a semicircular top; the rest of the ply lies on the mold. The height
    is half the excess length plus 0.43 thicknesses, so it does not vanish with the excess (`post_process` clamps it).

    Parameters
    ----------
    ply_length_mm
        Length of the ply's section between its two feet, mm.
    mold_length_mm
        Length of the mold between the same feet, mm; at least two thicknesses.
    thickness_mm
        Nominal thickness of the ply, mm.

    Returns
    -------
    float
        Height above the mold, mm.

    Raises
    ------
    InputError
        If a length or the thickness is not positive, or the mold length leaves no room for the ridge.

    Notes
    -----
    Krogh, Jakobsen, Wilm, "Will it Crease or Cease?", section on post-processing the results.

    Examples
    --------
    Three nodes 9.3 mm apart, the middle one 3.2 mm above a flat mold:

    >>> round(ridge_height(2 * 9.3, 2 * (9.3**2 - 3.2**2) ** 0.5, 0.3), 3)
    0.697
    """
    return float(_core.ridge.ridge_height(ply_length_mm, mold_length_mm, thickness_mm))


@typed
def excess_of_ridge(height_mm: float, thickness_mm: float) -> float:
    """Return the excess length, mm, that a ridge of this height takes up: the inverse of `ridge_height`, not negative.

    Examples
    --------
    >>> round(excess_of_ridge(ridge_height(10.0, 9.5, 0.3), 0.3), 9)
    0.5
    """
    return max(0.0, 2 * height_mm - (4 - math.pi) * thickness_mm)


@dataclass(frozen=True)
class RidgeSection:
    """The cross-section of a ridge along one fibre."""

    peak: int
    """Number of the node at the top."""
    fibre: int
    """0: the section is cut along the first fibre (west to east); 1: along the second (south to north)."""
    nodes: tuple[int, ...]
    """Numbers of the section's nodes from one end to the other; the ends are feet, valleys or the net's border."""
    ply_length_mm: float
    mold_length_mm: float
    """`ply_length_mm`, `mold_length_mm`: lengths of the ply and of the mold below it, mm."""
    height_mm: float
    """Height of the ridge above the mold, mm."""
    length_mm: float
    """Length of the piece of the ridge line that this section represents, mm."""


@dataclass(frozen=True, eq=False)
class PostProcessed:
    """What the debulked ply looks like on the mold."""

    gap_mm: NDArray[np.float64]
    """(N,) height above the mold, mm: the consolidated thickness, or the ridge's height at the peak of a ridge."""
    is_ridge: NDArray[np.bool_]
    """(N,) bool: peaks of the ridges."""
    is_bridge: NDArray[np.bool_]
    """(N,) bool: nodes where the ply is too short to reach the mold; they keep the gap of the minimum."""
    is_drawn_in: NDArray[np.bool_]
    """(N,) bool: nodes where the model bridges, but pulls harder than the friction out to the ply's edge can hold. The
    ply is drawn in there and lies on the mold. No node is marked if the tensions or the edge are not known."""
    sections: tuple[RidgeSection, ...]
    """Sections of the ridges, from the largest gap of the minimum down."""
    ridge_height_mm: float
    """Height of the highest ridge, mm; 0 if there is none."""
    ridge_length_mm: float
    """Length of the longest connected ridge line, mm; 0 if there is none."""
    bridge_height_mm: float
    """Height of the highest bridging node, mm; 0 if there is none."""
    drawn_in_height_mm: float
    drawn_in_tension_n_per_mm: float
    drawn_in_hold_n_per_mm: float
    """`drawn_in_height_mm`, `drawn_in_tension_n_per_mm`, `drawn_in_hold_n_per_mm`: values of the highest node that is
    drawn in, according to the model: its height, the pull of its fibre, and what friction holds; 0 if there is none."""
    rms_mm: float
    """Root mean square of `gap_mm` over the nodes inside the perimeter that are not drawn in, mm."""
    excess_length_mm: float
    """`largest_fibre_excess` of the net, mm."""


@typed
def post_process(
    nodes_mm: ArrayLike,
    neighbours: ArrayLike,
    inside: ArrayLike,
    reference: Reference,
    *,
    thickness_mm: float,
    bulk_factor: float,
    touch_mm: float | None = None,
) -> PostProcessed:
    """Turn the net at the minimum of its energy into the ridges that will be visible.

    Nodes are taken from the largest gap down. A node that is the top of one of its fibres and belongs to no earlier
    ridge gets a section along one of its fibres, the one of larger excess per length, down to the foot, the valley or
    the net's border. The excess length of the section determines the ridge's height, and the nodes beside the peak move
    to the mold. Every node that is not part of a ridge ends one consolidated thickness above the mold, except where the
    ply is too short and bridges a hollow.

    Parameters
    ----------
    nodes_mm
        (N, 3) nodes at the minimum, mold frame, mm.
    neighbours
        (N, 4) numbers of the neighbours east, west (first fibre), north, south (second fibre); -1 means none.
    inside
        (N,) bool: nodes inside the pocket's perimeter, over which the RMS is taken.
    reference
        The mold.
    thickness_mm
        Nominal thickness of the ply, mm.
    bulk_factor
        Ratio of nominal to consolidated thickness, at least 1.
    touch_mm
        Nodes up to this height above the mold touch it, mm. None: a thirtieth of the thickness.

    Returns
    -------
    PostProcessed
        Gaps per node, ridges, RMS and excess length.

    Raises
    ------
    InputError
        If shapes are wrong, coordinates are not finite, neighbours do not name one another, or no node is inside.

    Notes
    -----
    Krogh, Jakobsen, Wilm, "Will it Crease or Cease?", section on post-processing the results. Which node belongs to
    which section, bridging, and the length of a ridge are our interpretation.

    Examples
    --------
    >>> import debulk.surface
    >>> mold = debulk.surface.Reference(np.zeros((4, 4)), (-20.0, -20.0), 20.0)
    >>> half = (8.4**2 - 4.66**2) ** 0.5
    >>> nodes = [[-half, 0, 0], [0, 0, 4.66], [half, 0, 0]]
    >>> fibre = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> out = post_process(nodes, fibre, [False, True, False], mold, thickness_mm=0.3, bulk_factor=1.2)
    >>> round(out.ridge_height_mm, 2), out.gap_mm.round(2).tolist()
    (1.54, [0.25, 1.54, 0.25])
    """
    options = _core.ridge.RidgeOptions()
    options.thickness_mm = thickness_mm
    options.bulk_factor = bulk_factor
    if touch_mm is not None:
        options.touch_mm = touch_mm
    return from_core(_core.ridge.post_process(nodes_mm, neighbours, inside, reference, options))


def from_core(out: _core.ridge.PostProcessed) -> PostProcessed:
    """Wrap a compiled result."""
    marks = "is_ridge", "is_bridge", "is_drawn_in"
    return PostProcessed(
        **same_named(PostProcessed, out, "sections", *marks),
        **{name: getattr(out, name).astype(np.bool_) for name in marks},
        sections=tuple(
            RidgeSection(**same_named(RidgeSection, s, "nodes"), nodes=tuple(s.nodes)) for s in out.sections
        ),
    )


def largest_fibre_excess(nodes_mm: ArrayLike, neighbours: ArrayLike, reference: Reference) -> float:
    """Largest excess of a fibre of the net: its length minus that of the mold between its ends.

    For the initial net it bounds the ridges of fibres held at both ends (`debulk.verdict.excess_bounds`).

    Parameters
    ----------
    nodes_mm
        (N, 3) nodes, mold frame, mm.
    neighbours
        (N, 4) numbers of the neighbours east, west, north, south; -1 means none.
    reference
        The mold.

    Returns
    -------
    float
        Excess length, mm; 0 when no fibre is longer than its mold.

    Raises
    ------
    InputError
        If shapes are wrong, coordinates are not finite, or neighbours do not name one another.

    Examples
    --------
    >>> import debulk.surface
    >>> mold = debulk.surface.Reference(np.zeros((4, 4)), (-20.0, -20.0), 20.0)
    >>> nodes, fibre = [[-4, 0, 0], [0, 0, 3], [4, 0, 0]], [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> round(largest_fibre_excess(nodes, fibre, mold), 9)
    2.0
    """
    return float(_core.ridge.largest_fibre_excess(nodes_mm, neighbours, reference))
