"""Parts of a scan that the scanner's own software filled in, clipped or smoothed, and that were thus not measured."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.inspection.evidence.sample import sample_of
from debulk.inspection.evidence.smooth_patches import SIDE, Squares, quiet_squares, some_on_ply, squares_of, touching
from debulk.inspection.holes import unseen
from debulk.inspection.rawscan.smoothed import Smoothed, SmoothedSearch
from debulk.results.area import in_cm2
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.inspection.evidence.edge_check import Outline
    from debulk.inspection.evidence.ply_zones import PlyZones
    from debulk.inspection.evidence.sample import Sample
    from debulk.inspection.reference.prepared import Prepared
    from debulk.recipe import Recipe

__all__ = ["Filled", "FilledSearch", "Patch"]

Floats = NDArray[np.float64]
_LARGEST_MM2 = 200.0  # a patch of this area is reported, even if the recipe's smallest pocket is larger
_LEAST_SQUARES = 4  # touching squares without noise that make a patch: one alone may be quiet by chance
_SEEN_PIXELS = 20  # a patch this wide is found on nearly any surface: a smaller one holds too few whole squares
_NOTED = 1.5  # widths of the smallest wanted patch: that narrower ones can be missed is not worth a line in each report
_LOST = 0.3  # of a square's side: squares nearer to a patch's rim than this contain noise from outside it


@dataclass(frozen=True)
class Patch:
    """A part of the scan that carries no noise.

    Attributes
    ----------
    centre_mm
        Mold XY.
    area_mm2
        Approximate area.
    height_mm
        Largest height above the reference.
    """

    centre_mm: tuple[float, float]
    area_mm2: float
    height_mm: float


@dataclass(frozen=True)
class Filled:
    """What a scan shows of the software that processed it.

    Attributes
    ----------
    patches
        The patches that carry no measuring noise.
    unknown
        Why some or all patches could not be found; empty if they could.
    smoothed
        Signs that the whole scan was smoothed.
    """

    patches: tuple[Patch, ...] = ()
    unknown: str = ""
    smoothed: Smoothed = field(default_factory=Smoothed)

    def findings(self, recipe: Recipe) -> list[Finding]:
        """Judge each patch as a hole of its size: INVALID if it stands up, else UNDECIDED, as it may hide a pocket."""
        out = []
        for patch in self.patches:
            x, y = patch.centre_mm
            rim_mm = unseen.standing_mm(recipe)
            reason = (
                f"some {in_cm2(patch.area_mm2)} at ({x:.0f}, {y:.0f}) mm, up to {patch.height_mm:.1f} mm high, "
                "carry no measuring noise, unlike the rest of the scan: filled in or clipped by the scanner's "
                "software? Switch its hole filling and clipping off, or give the raw cloud"
            )
            at_best = Verdict.INVALID if patch.height_mm >= rim_mm else Verdict.UNDECIDED
            out.append(Finding("filled", at_best, reason, patch.height_mm, rim_mm, "mm", patch.centre_mm))
        return out

    def left_out(self) -> tuple[LeftOut, ...]:
        """Say what could not be looked for."""
        if not self.unknown:
            return self.smoothed.left_out()
        bound = "none: such a patch is judged as if it had been measured; switch the scanner's hole filling off"
        what = "patches that the scanner's own software may have filled in or clipped, or smoothed with all of the scan"
        return (LeftOut(what=what, why=self.unknown, bound=bound), *self.smoothed.left_out())


class FilledSearch:
    """Looks for filled-in, clipped or smoothed parts in scan after scan.

    Parameters
    ----------
    prepared
        The prepared reference.
    mold_from_scanner
        (4, 4); None if both frames are the same.
    zones
        Where the ply is.
    outline
        The outline of the ply; None if it is not known.
    recipe
        Of which the sections ``clean``, ``material``, ``segmentation`` and ``run`` are used.
    """

    def __init__(
        self,
        prepared: Prepared,
        mold_from_scanner: Floats | None,
        zones: PlyZones,
        outline: Outline | None,
        recipe: Recipe,
    ) -> None:
        self._prepared, self._pose, self._zones, self._threads = prepared, mold_from_scanner, zones, recipe.run.threads
        self._up = np.array([0.0, 0.0, 1.0]) if mold_from_scanner is None else mold_from_scanner[2, :3]
        self._smoothed = SmoothedSearch(prepared, mold_from_scanner, outline, recipe)
        self._least_mm2 = min(recipe.segmentation.area_tol_mm2, _LARGEST_MM2)

    def find(
        self, scan: NDArray[np.float32], sample: Sample, mask: NDArray[np.bool_] | None, stop: _core.Stop
    ) -> Filled:
        """Search a scan, given a sample of its points; pixels at which the (H, W) mask is True are not used."""
        if scan.ndim != 3:
            return Filled(unknown="the scan is no image: which of its points are neighbours is not known")
        wide_mm = 2 * float(np.sqrt(self._least_mm2 / np.pi))
        squares = squares_of(scan.shape, sample.pitch_mm, wide_mm)
        if squares is None:
            return Filled(unknown=f"the scan's image has not {SIDE} rows and columns")
        with np.errstate(invalid="ignore", over="ignore"):  # points that are not finite or far off count as not seen
            some = some_on_ply(scan, squares, self.on_ply)
            found = quiet_squares(scan, squares, some, self.on_ply, self._up, stop, self._threads)
            smoothed = self._smoothed.find(scan, squares, some, sample.pitch_mm, mask)
        quiet = found.squares
        if mask is not None and mask.shape == scan.shape[:2]:
            quiet &= ~mask[np.ix_(squares.rows + SIDE // 2, squares.columns + SIDE // 2)]
        pieces = [piece for piece in touching(quiet) if len(piece) >= _LEAST_SQUARES]
        patches = [self._patch(scan, squares, piece, sample.pitch_mm) for piece in pieces]
        unknown, seen_mm = found.unknown, _SEEN_PIXELS * sample.pitch_mm
        if not unknown and seen_mm > _NOTED * wide_mm:
            unknown = f"on pixels {sample.pitch_mm:.2g} mm apart patches less than {seen_mm:.0f} mm wide can be missed"
        large = tuple(patch for patch in patches if patch.area_mm2 >= self._least_mm2)
        return Filled(large, unknown, smoothed)

    def edge_mm(self, scan: NDArray[np.float32], mask: NDArray[np.bool_] | None) -> float:
        """Return by how much a scan spreads the ply's edge; see `EdgeSpread.least_mm`."""
        return self._smoothed.edge_mm(scan, mask)

    def on_ply(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return which of (N, 3) points of a scan, all finite, lie on the ply, well inside its outline."""
        return self._zones.inside(self._of(points))

    def _patch(self, scan: NDArray[np.float32], squares: Squares, piece: NDArray[np.int64], pitch_mm: float) -> Patch:
        row, column = squares.rows[piece[:, 0]] + SIDE // 2, squares.columns[piece[:, 1]] + SIDE // 2
        of = self._of(scan[row, column])
        radius = np.sqrt(len(piece) / np.pi) * squares.step + _LOST * SIDE
        x, y = of.points_mm[:, :2].mean(axis=0)
        return Patch((float(x), float(y)), float(np.pi * (radius * pitch_mm) ** 2), float(of.height_mm.max()))

    def _of(self, points: NDArray[np.float32]) -> Sample:
        return sample_of(points, self._prepared, self._pose, self._threads)
