"""Regions of interest: from a scan to its pockets without processing the whole scan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.grid import Grid
from debulk.results.report import LeftOut
from debulk.surface import Reference

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Found", "RegionFront", "in_order"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Found:
    """The pockets of a scan, in one piece or in several.

    Attributes
    ----------
    parts
        What was segmented, with the feet. No pocket is in two parts.
    known_mm2
        XY area of the ply (outline unknown: of the reference) whose height is known, measured or filled in by the rule.
    overview
        Heights above the reference for a picture.
    left_out
        What this way of looking leaves out.
    """

    parts: list[tuple[pocket.Segmentation, pocket.Feet]]
    known_mm2: float
    overview: Grid
    left_out: tuple[LeftOut, ...] = ()


def in_order(found: Found) -> list[tuple[int, int]]:
    """(part, index in it) of all pockets, largest area first, as in one piece."""
    places = [(part, index) for part, (s, _) in enumerate(found.parts) for index in range(len(s.pockets))]
    areas = [round(1e6 * found.parts[part][0].pockets[index].area_mm2) for part, index in places]
    return [places[k] for k in sorted(range(len(places)), key=lambda k: -areas[k])]


class RegionFront:
    """Finds the pockets of scan after scan through regions of interest.

    A coarse pass over some rows and columns of pixels finds what stands up; windows round that are processed exactly
    as the whole scan would be: outliers, heights, holes, spikes, median, segmentation, feet. It takes the scans of a
    pinhole camera; others are for `debulk.inspection.front.FrontEnd`. One object serves one thread at a time. Memory is
    kept from scan to scan: `inspect` writes where an earlier `Found` was that nobody holds any more, and never changes
    one that is held. Reports hold none.

    Parameters
    ----------
    reference
        The smooth reference surface, mold frame.
    image
        (height, width, f, cx, cy) of the camera in pixels.
    mold_from_scanner
        (4, 4), x_mold = T x_scanner. None: scans are in the mold's frame.
    spacing_mm
        Of the height map.
    ply_outline
        (M, 2), mold XY, mm, or None.
    recipe
        The sections clean, segmentation, patch, material and run.
    mesh
        (rows, columns): the coarse pass reads every so-manyth, for studies; a sparse mesh can miss pockets. None: as
        sparse as the area tolerance allows without missing any.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(1280, 960))
    >>> pose, outline = layup.mold_from_scanner, layup.ply_outline
    >>> inspector = debulk.Inspector(None, layup.reference, outline, mold_from_scanner=pose)
    >>> prepared = inspector.prepared
    >>> front = RegionFront(prepared.reference, prepared.image, pose, 1.0, outline, inspector.recipe)
    >>> found = front.inspect(layup.scan, None, debulk._core.Stop())
    >>> sum(len(segmentation.pockets) for segmentation, feet in found.parts)
    14
    """

    def __init__(
        self,
        reference: Reference,
        image: tuple[int, int, float, float, float],
        mold_from_scanner: Floats | None,
        spacing_mm: float,
        ply_outline: Floats | None,
        recipe: Recipe,
        mesh: tuple[int, int] | None = None,
    ) -> None:
        clean, wanted, patch = recipe.clean, recipe.segmentation, recipe.patch
        self._recipe = recipe
        self._core: Any = _core.RegionFront(
            reference,
            image[:2],
            image[2:],
            np.eye(4) if mold_from_scanner is None else mold_from_scanner,
            neighbours=clean.neighbours,
            std_ratio=clean.std_ratio,
            least_ratio=clean.least_ratio,
            spacing_mm=spacing_mm,
            hole_diameter_mm=clean.max_hole_mm,
            spike_mm=clean.spike_mm,
            median_cells=clean.median_cells,
            cut_height_mm=wanted.cut_height_mm,
            area_tol_mm2=wanted.area_tol_mm2,
            peak_tol_mm=wanted.peak_tol_mm,
            ply_outline=ply_outline,
            thickness_mm=recipe.material.thickness_mm,
            mold_tol_mm=patch.mold_tol_mm,
            smooth_mm=patch.smooth_mm,
            largest_share=0.8,
            mesh=mesh,
            threads=recipe.run.threads,
        )

    def inspect(self, scan: NDArray[np.float32], mask: NDArray[np.bool_] | None, stop: _core.Stop) -> Found | None:
        """Find the pockets of a scan.

        Parameters
        ----------
        scan
            (H, W, 3) C-contiguous float32, scanner frame, mm, NaN = nothing seen. It is not copied.
        mask
            (H, W), True where a pixel is not to be used.
        stop
            Raised from another thread, or past its deadline, ends it with `Stopped` within a few milliseconds.

        Returns
        -------
        Found | None
            None: the scan is to be processed whole; `reason` says why.
        """
        if not self._core.run(scan, None if mask is None else mask.view(np.uint8), stop):
            return None
        share, windows = self._core.image_share, len(self._core.windows)
        overview = self._core.overview()
        parts = []
        for segmentation, feet in self._core.regions():
            found = pocket.from_core(segmentation)
            parts.append((found, pocket.feet_from_core(found, feet, self._recipe.material.thickness_mm)))
        return Found(parts, self._core.known_mm2, Grid(*overview), self._left_out(share, windows))

    @property
    def usable(self) -> bool:
        """Whether scans can be taken at all; if not, `reason` says why."""
        return bool(self._core.usable)

    @property
    def reason(self) -> str:
        """Why the last scan, or any, is to be processed whole; empty if not."""
        return str(self._core.reason)

    @property
    def windows(self) -> int:
        """How many windows the last scan had."""
        return len(self._core.windows)

    @property
    def mesh(self) -> tuple[int, int, float, float]:
        """Steps of the rows and columns that the coarse pass reads; a pixel's longest side, mm; an eye's area, mm²."""
        rows, columns, pixel_mm, eye_mm2 = self._core.mesh
        return rows, columns, pixel_mm, eye_mm2

    @property
    def shares(self) -> tuple[float, float]:
        """Of the pixels: what the last scan's coarse pass and sample read, and what lay in its windows."""
        return self._core.read_share, self._core.image_share

    @property
    def times_ms(self) -> dict[str, float]:
        """How long the last scan took, stage by stage; "clean" with gridding, "fill" with spikes and median."""
        sample, coarse, windows, filtering, segment, feet = self._core.times
        return {
            "sample": sample,
            "coarse": coarse,
            "clean": windows,
            "fill": filtering,
            "pockets": segment + feet,
        }

    def _left_out(self, share: float, windows: int) -> tuple[LeftOut, ...]:
        rows, columns, pixel_mm, eye_mm2 = self.mesh
        threshold, error, points = self._core.threshold
        wanted = self._recipe.segmentation
        return (
            LeftOut(
                what=f"{100 * max(0.0, 1 - share):.0f} % of the scan, outside {windows} regions of interest",
                why=f"a coarse pass over every {_ordinal(rows)} row and every {_ordinal(columns)} column of pixels saw "
                f"nothing there that stands {self._core.flag_mm:g} mm high or more",
                bound=f"a pocket in it would be less than 2 pixels ({2 * pixel_mm:.2g} mm) wide wherever it crosses "
                f"such a row or column, or lie between them: {(rows - 1) * pixel_mm:.2g} by "
                f"{(columns - 1) * pixel_mm:.2g} mm at most, below {eye_mm2 / 100:.2g} cm² "
                f"(limit {wanted.area_tol_mm2 / 100:g} cm²)",
            ),
            *(
                [
                    LeftOut(
                        what="most of the scan in the threshold of the outlier filter",
                        why=f"it is told from a sample of {points} points",
                        bound=f"{threshold:.3f} mm, 3 standard errors are {3 * error:.2g} mm",
                    )
                ]
                if error > 0
                else []
            ),
        )


def _ordinal(number: int) -> str:
    if number == 1:
        return ""
    return {2: "2nd"}.get(number, f"{number}th")
