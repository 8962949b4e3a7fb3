"""Parts of a scan that the scanner's own software filled in, clipped or smoothed, and that were thus not measured."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.inspection.clouds.thinning import complete
from debulk.inspection.evidence.cloud_image import CloudImage, in_lines, laid_out
from debulk.inspection.evidence.outline import Outline
from debulk.inspection.evidence.ply_zones import PlyZones
from debulk.inspection.evidence.sample import Sample, sample_of
from debulk.inspection.evidence.smooth_patches import (
    SIDE,
    Squares,
    quiet_squares,
    some_on_ply,
    squares_of,
    touching,
)
from debulk.inspection.ply.setup import Setup
from debulk.inspection.rawscan.smoothed import Smoothed, SmoothedSearch
from debulk.inspection.rawscan.vouched import Made, asked_in, not_vouched
from debulk.recipe import options
from debulk.results.area import in_cm2
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict


@dataclass(frozen=True)
class Limits:
    """Of patches that carry no noise; `tests/python/inspection/test_filled.py` fills, clips and rounds scans."""

    least_squares: int = 4  # touching squares without noise that make a patch: one alone may be quiet by chance
    seen_pixels: int = 12  # a patch this wide is found on nearly any surface
    noted_widths: float = 1.5  # of the smallest wanted patch: that narrower ones can be missed is not noted
    lost_share: float = 0.3  # of a square's side: squares nearer to a patch's rim contain noise from outside it
    beside_mm: float = 20.0  # round the ply: its edge shows how sharp the scan is


LIMITS = Limits()


@dataclass(frozen=True)
class Patch:
    """A part of the scan that carries no noise."""

    centre_mm: tuple[float, float]
    """Mold XY."""
    area_mm2: float
    """Approximate area."""
    height_mm: float
    """Largest height above the reference."""


@dataclass(frozen=True)
class Filled:
    """What a scan shows of the software that processed it."""

    patches: tuple[Patch, ...] = ()
    """The patches that carry no measuring noise."""
    made: tuple[Made, ...] = ()
    """The parts for which the scan's noise does not vouch; they are looked for if there are no such patches."""
    unknown: str = ""
    """Why some or all patches could not be found; empty if they could."""
    smoothed: Smoothed = field(default_factory=Smoothed)
    """Signs that the whole scan was smoothed."""

    def findings(self) -> list[Finding]:
        """Judge each patch as a hole of its size, in which a pocket could lie."""
        out = []
        for patch in self.patches:
            x, y = patch.centre_mm
            reason = (
                f"some {in_cm2(patch.area_mm2)} at ({x:.0f}, {y:.0f}) mm, up to {patch.height_mm:.1f} mm high, "
                "carry no measuring noise, unlike the rest of the scan: filled in or clipped by the scanner's "
                "software? Switch its hole filling and clipping off, or give the raw cloud"
            )
            out.append(
                Finding("filled", Verdict.UNDECIDED, reason, patch.area_mm2, unit="mm²", place_mm=patch.centre_mm)
            )
        return out

    def left_out(self) -> tuple[LeftOut, ...]:
        """Say what could not be looked for."""
        if not self.unknown:
            return self.smoothed.left_out()
        bound = "none: such a patch is judged as if it had been measured; switch the scanner's hole filling off"
        what = "patches that the scanner's own software may have filled in or clipped, or smoothed with all of the scan"
        return (LeftOut(what=what, why=self.unknown, bound=bound), *self.smoothed.left_out())


class FilledSearch:
    """Looks for filled-in, clipped or smoothed parts in scan after scan."""

    def __init__(self, setup: Setup, zones: PlyZones, outline: Outline | None) -> None:
        self._setup, self._zones, self._threads = setup, zones, setup.recipe.run.threads
        self._up = setup.pose[2, :3]
        self._smoothed = SmoothedSearch(setup, outline)
        self._least_mm2 = options.looked_for_mm2(setup.recipe)

    def image_of(self, scan: NDArray[np.float32], sample: Sample) -> CloudImage | None:
        """Return a scan as an image, given a sample of its points; None: too few of a list lie on the ply."""
        if scan.ndim == 3:
            return CloudImage(scan, scan, sample.pitch_mm)
        if (lined := in_lines(scan, sample.pitch_mm)) is not None:
            return lined
        box_mm = self._zones.box_mm + LIMITS.beside_mm * np.array([[-1.0], [1.0]])
        prepared, pose = self._setup.prepared, self._setup.mold_from_scanner
        return laid_out(scan, pose, prepared.reference, box_mm, sample.pitch_mm, self._threads)

    def find(self, image: CloudImage | None, mask: NDArray[np.bool_] | None, stop: _core.Stop) -> Filled:
        """Search a scan's image; pixels at which the (H, W) mask of its own image is True are not used."""
        if image is None:
            return Filled(unknown="too few points lie on the ply to lay them out as an image")
        wide_mm = 2 * float(np.sqrt(self._least_mm2 / np.pi))
        on_ply, mask = (self._laid_on_ply, None) if image.laid else (self.on_ply, mask)
        squares = squares_of(image.points.shape, image.pitch_mm, wide_mm)
        if squares is None:
            return Filled(unknown=f"the scan's image has not {SIDE} rows and columns")
        with np.errstate(invalid="ignore", over="ignore"):  # points that are not finite or far off count as not seen
            some = some_on_ply(image.heights, squares, on_ply)
            smoothed = self._smoothed.find(image, squares, some, mask)
            patches, unknown = ([], "") if image.laid else self._by_squares(image, squares, some, mask, stop)
            made, why = ((), "") if patches or smoothed.shared_mm else self._not_vouched(image, mask)
        seen_mm, unknown = LIMITS.seen_pixels * image.pitch_mm, unknown or (why if image.laid else "")
        if not unknown and seen_mm > LIMITS.noted_widths * wide_mm:
            unknown = f"on pixels {image.pitch_mm:.2g} mm apart patches less than {seen_mm:.0f} mm wide can be missed"
        return Filled(tuple(patches), made, unknown, smoothed)

    def at(self, edge: Outline, found: Filled, image: CloudImage, mask: NDArray[np.bool_] | None) -> Filled:
        """Return what was found, with the blur of an edge of the ply that was seen; see `SmoothedSearch.at`."""
        smoothed = self._smoothed.at(edge, found.smoothed, image, None if image.laid else mask)
        # In a scan that was smoothed everywhere, points repeat and lack noise here and there by chance.
        return replace(found, made=() if smoothed.findings() else found.made, smoothed=smoothed)

    def edge_mm(self, scan: NDArray[np.float32], mask: NDArray[np.bool_] | None) -> float:
        """Return by how much a scan spreads the ply's edge; see `EdgeSpread.least_mm`."""
        return self._smoothed.edge_mm(scan, mask)

    def on_ply(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return which of (N, 3) points of a scan, all finite, lie on the ply, well inside its outline."""
        return self._zones.inside(self._of(points))

    def _laid_on_ply(self, heights: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return which of (N, 3) places of an image of heights lie on the ply; their z is above the reference."""
        at = heights.astype(np.float64)
        return self._zones.inside(Sample(at, at[:, 2], 1, np.zeros(len(at), np.bool_)))

    def _by_squares(
        self,
        image: CloudImage,
        squares: Squares,
        some: NDArray[np.int64],
        mask: NDArray[np.bool_] | None,
        stop: _core.Stop,
    ) -> tuple[list[Patch], str]:
        """Return the patches of a scan's own image, and why they could not be found; empty: they could."""
        found = quiet_squares(image.heights, squares, some, self.on_ply, self._up, stop, self._threads)
        quiet = found.squares
        if mask is not None and mask.shape == image.points.shape[:2]:
            quiet &= ~mask[np.ix_(squares.rows + SIDE // 2, squares.columns + SIDE // 2)]
        pieces = [piece for piece in touching(quiet) if len(piece) >= LIMITS.least_squares]
        patches = [self._patch(image, squares, piece) for piece in pieces]
        return [patch for patch in patches if patch.area_mm2 >= self._least_mm2], found.unknown

    def _patch(self, image: CloudImage, squares: Squares, piece: NDArray[np.int64]) -> Patch:
        row, column = squares.rows[piece[:, 0]] + SIDE // 2, squares.columns[piece[:, 1]] + SIDE // 2
        of = self._of(image.points[row, column])
        radius = np.sqrt(len(piece) / np.pi) * squares.step + LIMITS.lost_share * SIDE
        x, y = of.points_mm[:, :2].mean(axis=0)
        return Patch((float(x), float(y)), float(np.pi * (radius * image.pitch_mm) ** 2), float(of.height_mm.max()))

    def _not_vouched(self, image: CloudImage, mask: NDArray[np.bool_] | None) -> tuple[tuple[Made, ...], str]:
        asked = asked_in(image, mask)
        places, shape = asked.points.reshape(-1, 3), asked.points.shape[:2]
        seen = np.flatnonzero(complete(np.isfinite(places)))
        on_ply, xy_mm = np.zeros(len(places), np.bool_), places[:, :2].copy()
        if image.laid:
            on_ply[seen] = self._laid_on_ply(places[seen])
        else:
            of = self._of(places[seen])
            on_ply[seen], xy_mm[seen] = self._zones.inside(of), of.points_mm[:, :2]
        return not_vouched(asked, xy_mm.reshape(*shape, 2), on_ply.reshape(shape), image.step_mm)

    def _of(self, points: NDArray[np.float32]) -> Sample:
        return sample_of(points, self._setup.prepared, self._setup.mold_from_scanner, self._threads)
