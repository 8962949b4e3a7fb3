"""The fibre lines of a ply, laid once, and the runs that a scan shows on them (docs/model.md, section 9)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from debulk import _core, fibre
from debulk.fibre import FibreRuns
from debulk.grid import Grid
from debulk.inspection.ply.friction_length import friction_length
from debulk.pocket import Feet, Segmentation
from debulk.recipe import options
from debulk.surface import Reference

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["PlyFibres", "ScanRuns"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ScanRuns:
    """The runs of all fibre lines over a scan.

    Attributes
    ----------
    runs
        One row for each run.
    largest
        Largest excess of a run over each place, mm.
    """

    runs: FibreRuns
    largest: Grid
    _lines: _core.fibre.FibreLines
    _field: _core.fibre.ExcessField
    _known: WeakKeyDictionary[Feet, NDArray[np.int32]] = field(default_factory=WeakKeyDictionary)

    def crossing(self, feet: Feet, index: int) -> NDArray[np.intp]:
        """Return the numbers of the runs that cross the foot of one pocket."""
        pairs = self._known.get(feet)  # of all feet of the piece: its other pockets ask for them, too
        if pairs is None:
            self._known[feet] = pairs = _core.fibre.crossings(self._lines, self._field, feet._core)
        return np.asarray(pairs[pairs[:, 1] == feet.feet[index].label, 0], dtype=np.intp)


class PlyFibres:
    """The lines along both fibre directions of a ply; made once, read in every scan.

    Parameters
    ----------
    reference, ply_outline, fibre_angles_deg, recipe
        As in `debulk.inspection.ply.ply_on_mold.PlyOnMold`.
    """

    def __init__(
        self, reference: Reference, ply_outline: Floats | None, fibre_angles_deg: Floats | Grid, recipe: Recipe
    ) -> None:
        corners = np.asarray(_core.surface.extent(reference))
        box = np.stack([corners.min(axis=0), corners.max(axis=0)])
        self._reference, self._recipe = reference, recipe
        self._draw_mm = friction_length(recipe)
        wanted = options.fibre_lines(recipe, self._draw_mm)
        self._lines = fibre.lines_over(fibre_angles_deg, ply_outline, box, wanted, _core.Stop())

    def over(
        self, parts: Sequence[tuple[Segmentation, Feet]], stop: _core.Stop, *, whole: bool, threads: int
    ) -> ScanRuns:
        """Read the lines over pieces of a scan; raises `Stopped`.

        Parameters
        ----------
        parts
            The segmented pieces, with their feet.
        stop
            Ends the reading.
        whole
            Whether they are the whole scan: then nothing is known beyond them. Otherwise the ply lies flat there.
        threads
            0: as many as the process may use.
        """
        wanted = options.fibre_lines(self._recipe, self._draw_mm)
        wanted.threads = threads
        wanted.mold_tol_mm = max([wanted.mold_tol_mm, *(feet.mold_tol_mm for _, feet in parts)])
        windows = [segmentation._core for segmentation, _ in parts]
        field = _core.fibre.measure_excess(self._lines, windows, self._reference, whole, wanted, stop)
        made = fibre.from_core(field)
        return ScanRuns(made.runs, made.largest, self._lines, field)
