"""The surface on which one pocket's net is laid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from numpy.typing import NDArray

from debulk import _core
from debulk.arguments import typed
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.pocket.foot import Feet
from debulk.pocket.segmentation import Segmentation
from debulk.surface import Reference

_PATCH = _core.pocket.PatchOptions()  # each default is written only once, in cpp/debulk/pocket


@dataclass(frozen=True, eq=False)
class Patch:
    """The surface on which one pocket's net is laid."""

    id: int
    mode: str
    """`id`, `mode`: id of the pocket, and ``"foot"`` or ``"paper"``."""
    outline_mm: Floats
    area_mm2: float
    """`outline_mm`, `area_mm2`: (M, 2) the perimeter (the foot contour, or the contour at the cut in mode paper) and
    the XY area inside it."""
    closed: bool
    """Whether the perimeter is nowhere cut by unknown heights or the grid's border."""
    touches_ply_edge: bool
    """Whether the pocket or, in mode foot, its foot touches the ply's edge."""
    parted: bool
    """As in `Foot`; always False in mode paper."""
    surface: Grid
    reference: Grid
    """`surface`, `reference`: (ny, nx) float64 heights in the mold frame, mm, of the net surface and of the reference
    F, finite everywhere. The window reaches `margin_mm` past the perimeter, even past the scan. Read-only."""
    within: Grid
    """(ny, nx) uint8: 1 in the pocket's own region. Read-only."""


@typed
def patch(
    segmentation: Segmentation,
    feet: Feet,
    pocket_id: int,
    reference: Reference,
    *,
    mode: Literal["foot", "paper"] = "foot",
    margin_mm: float = _PATCH.margin_mm,
) -> Patch:
    """Cut out one pocket's patch: the ply's net surface inside the perimeter, the reference F outside.

    Parameters
    ----------
    segmentation, feet
        Results of `segment` and `feet`.
    pocket_id
        Id of the pocket, from 1.
    reference
        The surface F below the ply.
    mode
        ``"foot"``: max(ply - thickness, F) out to the foot contour, smoothed. ``"paper"``: the ply inside the outline
        at the cut (smoothed, too), F outside, joined by a step of up to the cut height. In mode foot, the height left
        at the perimeter (the mold tolerance; more at a saddle) fades out over a short distance; past the ply's edge the
        surface goes on and fades over `margin_mm`.
    margin_mm
        Margin of the window round the perimeter: at least the offset of the net's boundary.

    Raises
    ------
    InputError
        There is no such pocket, the feet are of another segmentation, or a value is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> from debulk.pocket import feet, segment
    >>> y, x = np.mgrid[-60.0:61.0, -60.0:61.0]
    >>> bell = 0.3 + 8 * np.cos(np.pi / 2 * np.minimum(np.hypot(x, y) / 40, 1)) ** 2
    >>> found = segment(Grid(bell.astype("f4"), np.array([-60.0, -60.0]), 1.0))
    >>> flat = Reference(np.zeros((13, 13)), (-60.0, -60.0), 10.0)
    >>> one = patch(found, feet(found), 1, flat)
    >>> one.closed, round(float(one.surface.values.max()), 1), bool((one.reference.values == 0).all())
    (True, 8.0, True)
    """
    options = _core.pocket.PatchOptions()
    options.mode = mode
    options.margin_mm = margin_mm
    core = _core.pocket.make_patch(segmentation._core, feet._core, pocket_id, reference, options)

    def grid(values: NDArray[Any]) -> Grid:
        return Grid(values, core.origin, core.spacing)

    return Patch(
        id=pocket_id,
        mode=mode,
        outline_mm=core.outline,
        area_mm2=core.area,
        closed=core.closed,
        touches_ply_edge=core.touches_ply_edge,
        parted=core.parted,
        surface=grid(core.surface),
        reference=grid(core.reference),
        within=grid(core.within),
    )
