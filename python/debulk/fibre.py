"""One measure over the whole ply: by how much each fibre is too long for the mold below it (docs/model.md, section 9).

Fibres do not stretch. Where both ends of a fibre are held, the length by which it exceeds the mold is the same after
debulking as before, and becomes a ridge. Lines along both fibre directions, two millimetres apart, read that excess
from the height map itself. Stretches of a line off the mold that so little flat ply separates that one fold can draw
all of it are one run.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays, rings
from debulk._core import InputError
from debulk.arguments import typed
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.surface import Reference

__all__ = ["FREE", "HELD", "UNKNOWN", "FibreExcess", "FibreRuns", "measure"]


HELD, FREE, UNKNOWN = 0, 1, 2
"""In `FibreRuns.ends`: the ply that goes on holds the end; the ply's edge is nearer; unseen cells are nearer."""


@dataclass(frozen=True, eq=False)
class FibreRuns:
    """The runs of all lines, one row of every array for each run."""

    family: NDArray[np.uint8]
    """(N,) 0: along the first fibre; 1: along the second."""
    line: NDArray[np.int32]
    """(N,) number of its line."""
    spans: NDArray[np.int32]
    """(N,) number of its stretches off the mold."""
    from_mm: Floats
    to_mm: Floats
    top_mm: Floats
    """`from_mm`, `to_mm`, `top_mm`: (N, 2) its first and its last point off the mold, and the point that stands
    highest; mold XY."""
    gap_mm: Floats
    """(N,) largest height of the ply's lower side above the mold."""
    length_mm: Floats
    flat_mm: Floats
    """`length_mm`, `flat_mm`: (N,) from its first to its last point, and how much of that lies flat on the mold."""
    low_mm: Floats
    excess_mm: Floats
    high_mm: Floats
    """`low_mm`, `excess_mm`, `high_mm`: (N,) by how much the ply is longer than the mold; negative: too short. The
    noise's share is taken out. The low value is surely there as far as the filters go, the middle one is the best
    estimate of what was there before them, the high one is what may have been there."""
    uncertainty_mm: Floats
    """(N,) two standard deviations of these, by the noise of the scan and of the reading."""
    turn_mm: Floats
    """(N,) change of the excess per radian by which the fibres run otherwise than said."""
    ends: NDArray[np.uint8]
    """(N, 2) what holds it at `from_mm` and at `to_mm`: `HELD`, `FREE` or `UNKNOWN`."""
    beyond_mm: Floats
    """(N, 2) ply along the line beyond each end, as far as it is known."""

    def __len__(self) -> int:
        return len(self.family)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp] | slice) -> FibreRuns:
        return FibreRuns(**{one.name: getattr(self, one.name)[chosen] for one in fields(FibreRuns)})

    @property
    def held(self) -> NDArray[np.bool_]:
        """(N,) whether both ends are held."""
        return np.asarray((self.ends == HELD).all(axis=1))


@dataclass(frozen=True, eq=False)
class FibreExcess:
    """The excess of the fibres over a ply."""

    runs: FibreRuns
    """All runs, line by line."""
    largest: Grid
    """Largest excess of a run over each place, mm; 0 where the ply lies on the mold. A grid as fine as the lines."""
    family: Grid
    """Fibre direction of that run, 0 or 1, on the same grid."""
    noise_mm: float
    """Standard deviation of the heights after the finer of the two filters, from the flat ply of the same scan."""
    noise_per_mm: float
    """False excess per mm of line that this noise makes; it is taken out of the runs."""


@typed
def measure(
    height_map: Grid,
    reference: Reference,
    fibre_angles_deg: ArrayLike | Grid = (0.0, 90.0),
    ply_outline: ArrayLike | None = None,
    *,
    thickness_mm: float = 0.3,
    mold_tol_mm: float = 0.2,
    apart_mm: float = 2.0,
    draw_mm: float = 21.0,
    hold_mm: float = 20.0,
    threads: int = 0,
) -> FibreExcess:
    """Measure the excess of every fibre line over a height map.

    Parameters
    ----------
    height_map
        Heights of the ply's upper side above the reference, (ny, nx), mm, NaN where nothing is known.
    reference
        The surface below the ply.
    fibre_angles_deg
        Two angles in degrees, counter-clockwise from mold +x, or a Grid of them, (ny, nx, 2), NaN where nothing is
        known. Lines follow a grid of angles, and end where it is not known.
    ply_outline
        As for an `Inspector`, mold XY, mm. None: the ends of the lines are unknown.
    thickness_mm
        Thickness of the ply along the mold's normal.
    mold_tol_mm
        The ply lies on the mold where its lower side is nearer to it than this.
    apart_mm
        Distance of neighbouring lines, at least a tenth of the heights' spacing: nearer lines show nothing new.
    draw_mm
        Length of flat ply over which one fold can draw more ply in: H / (mu P), docs/model.md, section 6.
    hold_mm
        Length of ply beyond an end, along the line, whose friction holds this end.
    threads
        0: as many as the process may use. The result does not depend on it.

    Raises
    ------
    InputError
        If an argument is not as expected.

    Examples
    --------
    A bell 6 mm high and 60 mm wide on a flat mold:

    >>> x, y = np.meshgrid(np.arange(-90.0, 91.0), np.arange(-90.0, 91.0))
    >>> r = np.minimum(np.hypot(x, y), 30.0)
    >>> heights = Grid(0.3 + 6 * np.cos(np.pi * r / 60) ** 2, np.array([-90.0, -90.0]), 1.0)
    >>> mold = Reference(np.zeros((5, 5)), (-120.0, -120.0), 60.0)
    >>> excess = measure(heights, mold, (0, 90), [(-90, -90), (90, -90), (90, 90), (-90, 90)])
    >>> best = int(np.argmax(excess.runs.excess_mm))
    >>> round(float(excess.runs.excess_mm[best]), 1), bool(excess.runs.held[best])
    (1.5, True)
    """
    values = arrays.numbers(height_map.values, "height_map.values", (None, None), "an (ny, nx) array of mm", nan=True)
    least_mm = 0.1 * height_map.spacing_mm
    if not apart_mm >= least_mm:
        raise InputError(
            f"apart_mm: expected at least a tenth of the heights' spacing, {least_mm:.3g} mm, but got {apart_mm:.3g}"
        )
    if (datum := reference.datum(thickness_mm)) is not reference:
        low, _, high, _ = _core.surface.extent(reference)
        at = (height_map.origin_mm[k] + height_map.spacing_mm * np.arange(values.shape[1 - k]) for k in (0, 1))
        x, y = (np.clip(v, a, b) for v, a, b in zip(at, low, high, strict=True))
        xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        values = values - (datum.height(xy) - reference.height(xy)).reshape(values.shape)
    wanted = _core.fibre.FibreOptions()
    wanted.thickness_mm, wanted.mold_tol_mm, wanted.apart_mm = thickness_mm, mold_tol_mm, apart_mm
    wanted.draw_mm, wanted.hold_mm, wanted.threads = draw_mm, hold_mm, threads
    heights = _core.fibre.Heights(values, height_map.origin_mm, height_map.spacing_mm)
    size = height_map.spacing_mm * (np.array(values.shape[::-1]) - 1)
    box = np.stack([height_map.origin_mm, height_map.origin_mm + size])
    outline = None if ply_outline is None else rings.outline(ply_outline, "ply_outline")
    stop = _core.Stop()
    lines = lines_over(fibre_angles_deg, outline, box, wanted, stop)
    return from_core(_core.fibre.measure_excess(lines, heights, reference, True, wanted, stop))


def lines_over(
    fibre_angles_deg: ArrayLike | Grid,
    outline: Floats | None,
    box_mm: Floats,
    options: _core.fibre.FibreOptions,
    stop: _core.Stop,
) -> _core.fibre.FibreLines:
    """Lay the lines of both families over a ply; a stage of its own, because they can be made before the scan."""
    if not isinstance(fibre_angles_deg, Grid):
        angles = arrays.numbers(fibre_angles_deg, "fibre_angles_deg", (2,), "two angles in degrees, or a Grid of them")
        return _core.fibre.straight_lines(np.radians(angles), outline, box_mm, options)
    values = np.asarray(fibre_angles_deg.values, dtype=np.float64)
    if values.ndim != 3 or values.shape[2] != 2:
        raise InputError(f"fibre_angles_deg.values: expected an (ny, nx, 2) array, but got shape {values.shape}")
    grid = fibre_angles_deg
    return _core.fibre.field_lines(np.radians(values), grid.origin_mm, grid.spacing_mm, outline, box_mm, options, stop)


def from_core(compiled: _core.fibre.ExcessField) -> FibreExcess:
    """Wrap a compiled result."""
    return FibreExcess(
        FibreRuns(**compiled.columns),
        Grid(*compiled.largest),
        Grid(*compiled.family),
        compiled.noise_mm,
        compiled.noise_per_mm,
    )
