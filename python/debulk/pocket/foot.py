"""Where a pocket's ply comes down to the mold."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NoReturn

from numpy.typing import NDArray

from debulk import _core
from debulk.arguments import typed
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.pocket.segmentation import Segmentation

_FEET = _core.pocket.FootOptions()  # each default is written only once, in cpp/debulk/pocket


@dataclass(frozen=True, eq=False)
class Foot:
    """Where a pocket's ply comes down to the mold. Pockets between which it does not come down share one foot."""

    id: int
    """Id of the pocket."""
    label: int
    """Label of its points in `Feet.labels`: the smallest id of the pockets that share it."""
    outline_mm: Floats
    """(M, 2) contour height - thickness = mold tolerance, mold XY, counter-clockwise, clipped by the ply."""
    area_mm2: float
    """XY area inside it."""
    closed: bool
    """Whether it is nowhere cut by unknown heights or the grid's border. (The ply's edge is allowed.)"""
    touches_ply_edge: bool
    """Whether it runs along the ply's outline."""
    parted: bool
    """Whether a part of it is the line between the pocket and a hill below half the cut, instead of lying on the
    mold."""


@dataclass(frozen=True, eq=False)
class Feet:
    """The feet of all pockets."""

    feet: list[Foot]
    """One foot per pocket, in the order of the pockets' ids."""
    labels: Grid
    """(ny, nx) int32: `Foot.label` of the foot to which a point belongs, 0 = none. Read-only."""
    heights: Grid
    """(ny, nx) float32: smoothed heights above the reference. Read-only."""
    noise_mm: float
    mold_tol_mm: float
    """`noise_mm`, `mold_tol_mm`: sigma of the heights before smoothing, and the mold tolerance used (at least three
    times that)."""
    thickness_mm: float
    smooth_mm: float
    """`thickness_mm`, `smooth_mm`: the arguments of `feet`."""
    _core: Any = field(repr=False)

    def __reduce__(self) -> NoReturn:
        raise TypeError("Feet cannot be pickled or copied: pickle the height map, and find segmentation and feet again")


@typed
def feet(
    segmentation: Segmentation,
    *,
    thickness_mm: float = _FEET.thickness_mm,
    mold_tol_mm: float = _FEET.mold_tol_mm,
    smooth_mm: float = _FEET.smooth_mm,
    noise_mm: float | None = None,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> Feet:
    """Find the foot contours of all pockets; pockets between which the ply does not come down share one.

    Parameters
    ----------
    segmentation
        Result of `segment`.
    thickness_mm
        Thickness of the ply: the scan sees its upper side.
    mold_tol_mm
        The ply lies on the mold where its lower side is this near to it; raised to three sigma of the noise.
    smooth_mm
        Window of the local quadratic smoothing that comes first; 0: no smoothing.
    noise_mm
        Sigma of the heights' noise; None: estimated by `height_noise`.

    Raises
    ------
    InputError
        A value is out of its range, or thickness and tolerance together are above the cut height.

    Examples
    --------
    >>> import numpy as np, debulk.pocket
    >>> y, x = np.mgrid[-60.0:61.0, -60.0:61.0]
    >>> bell = 0.3 + 8 * np.cos(np.pi / 2 * np.minimum(np.hypot(x, y) / 40, 1)) ** 2
    >>> found = debulk.pocket.segment(debulk.Grid(bell.astype("f4"), np.array([-60.0, -60.0]), 1.0))
    >>> foot = debulk.pocket.feet(found).feet[0]
    >>> foot.closed, round(float(np.sqrt(foot.area_mm2 / np.pi)))  # 40 · 2/π · acos(√(0.2 / 8)) = 35.95
    (True, 36)
    """
    options = _core.pocket.FootOptions()
    options.thickness_mm = thickness_mm
    options.mold_tol_mm = mold_tol_mm
    options.smooth_mm = smooth_mm
    options.noise_mm = noise_mm
    return feet_with(options, segmentation, threads, stop or _core.Stop())


def feet_with(options: _core.pocket.FootOptions, segmentation: Segmentation, threads: int, stop: _core.Stop) -> Feet:
    """Find the foot contours of all pockets, as `feet` does, with compiled options."""
    core = _core.pocket.find_feet(segmentation._core, options, threads, stop)
    return feet_from_core(segmentation, core, options)


def feet_from_core(segmentation: Segmentation, core: Any, options: _core.pocket.FootOptions) -> Feet:
    """Wrap the compiled feet of a segmentation that were found with these options."""
    found = [
        Foot(pocket.id, f.label, f.outline, f.area, f.closed, f.touches_ply_edge, f.parted)
        for pocket, f in zip(segmentation.pockets, core.feet, strict=True)
    ]
    grid = segmentation.labels
    labels, heights = _like(grid, core.labels), _like(grid, core.heights)
    given = options.thickness_mm, options.smooth_mm
    return Feet(found, labels, heights, core.noise, core.mold_tol, *given, core)


def _like(grid: Grid, values: NDArray[Any]) -> Grid:
    return Grid(values, grid.origin_mm, grid.spacing_mm)
