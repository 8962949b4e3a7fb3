"""Whether a scan was smoothed, which lowers narrow bumps: detected by shared noise and by a blurred edge of the ply.

A scan that shows neither noise nor an edge may have been, unless anything else in it is sharp.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from debulk.arrays import Bools, Cloud, Floats
from debulk.inspection.clouds.enough import FEW, PLACES
from debulk.inspection.evidence.cloud_image import CloudImage
from debulk.inspection.evidence.outline import Outline
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.inspection.rawscan.edge_spread import LIMITS, EdgeSpread
from debulk.inspection.rawscan.shared_noise import noise_is_shared, squares_on
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict

# Second differences at twice the distance: as large at an edge, twice at a kink, four times where all is smooth.
_SMOOTH_TIMES = 3.0


@dataclass(frozen=True)
class Smoothed:
    """The evidence that a scan was smoothed."""

    shared_mm: float = 0.0
    """Distance at which points share their noise; 0: they do not."""
    edge_mm: float = 0.0
    """Sigma of the Gaussian that would blur the ply's edge as much as the scan does; 0: no more than is allowed; NaN:
    not known."""
    blunt: bool = False
    """Whether the scan shows no noise and nothing that bends sharply."""

    def findings(self) -> list[Finding]:
        """Return UNDECIDED if the scan was smoothed, else nothing."""
        if self.shared_mm:
            found = (
                f"points of the scan {self.shared_mm:.2g} mm apart share their measuring noise: smoothed or "
                "interpolated"
            )
        elif self.edge_mm > 0:
            found = f"the scan spreads the ply's edge as a Gaussian of {self.edge_mm:.2g} mm does: blurred, or smoothed"
        elif self.blunt and np.isnan(self.edge_mm):
            found = "the scan shows no noise, and nothing in it is sharp, not even an edge: smoothed"
        else:
            return []
        measured_mm = self.shared_mm or (None if np.isnan(self.edge_mm) else self.edge_mm)
        reason = (
            f"{found} by the scanner's software, which lowers narrow bumps? Switch its smoothing off, give the raw "
            "cloud, or allow for it (clean.fine_mm)"
        )
        return [Finding("smoothed", Verdict.UNDECIDED, reason, measured_mm, unit="mm")]

    def left_out(self) -> tuple[LeftOut, ...]:
        """Return an entry for the report if the blur of the ply's edge is not known."""
        if not np.isnan(self.edge_mm):
            return ()
        return (
            LeftOut(
                what="how sharp the scan is, by the ply's edge",
                why="too little of the edge was seen to lie flat on the reference",
                bound="none: bumps that a filter lowered which leaves noise of its own are judged as low as they are",
            ),
        )


class SmoothedSearch:
    """Looks for signs of smoothing in scan after scan; without an outline at the edge that a scan shows, by `at`."""

    def __init__(self, setup: Setup, outline: Outline | None) -> None:
        self._setup = setup
        self._edge = None if outline is None else EdgeSpread(setup, outline)
        self._fine_mm = setup.recipe.clean.fine_mm

    def find(self, image: CloudImage, on_ply: Callable[[Cloud], Bools], wide_mm: float) -> Smoothed:
        """Look for smoothing in an image, on the ply where a place so wide shows it, and at the ply's edge.

        `on_ply` says which points lie on the ply.
        """
        step = max(1, round(self._fine_mm / image.pitch_mm))
        squares = squares_on(image.heights, image.pitch_mm, wide_mm, on_ply)
        if shared := noise_is_shared(image, squares, step):
            return Smoothed(shared_mm=step * image.pitch_mm)
        spread_mm = self.edge_mm(image.points)
        blunt = shared is None and bool(np.isnan(spread_mm)) and _blunt(image, step)
        return self._by_edge(spread_mm, image.pitch_mm, blunt=blunt)

    def at(self, edge: Outline, found: Smoothed, image: CloudImage) -> Smoothed:
        """Return what was found, and the spread of an edge that was seen where no outline was given, if not known."""
        if found.shared_mm or not np.isnan(found.edge_mm):
            return found
        spread_mm = EdgeSpread(self._setup, edge).least_mm(image.points)
        return self._by_edge(spread_mm, image.pitch_mm, blunt=found.blunt)

    def _by_edge(self, spread_mm: float, pitch_mm: float, *, blunt: bool) -> Smoothed:
        allowed_mm = LIMITS.allowed * max(self._fine_mm, pitch_mm)
        return Smoothed(edge_mm=0.0 if spread_mm <= allowed_mm else spread_mm, blunt=blunt)

    def edge_mm(self, image: Cloud) -> float:
        """Return by how much an image spreads the ply's edge; NaN: the edge is not known."""
        return float("nan") if self._edge is None else self._edge.least_mm(image)


def _blunt(image: CloudImage, step: int) -> bool:
    """Return whether nothing in an image bends sharply, by second differences of its heights, less what rounding does.

    Where it does, they are about as large at a distance of `step` pixels as at twice that near by.
    """
    largest = np.fmax.reduce(np.abs(image.heights[..., 2]), axis=None, initial=0.0)
    found, rounded = 0, max(image.step_mm, float(np.spacing(np.float32(largest))))
    for lines in (image.heights[..., 2], image.heights[..., 2].T):
        some = lines[:: max(1, len(lines) // PLACES)].astype(np.float64)
        if some.shape[1] <= 4 * step:
            continue
        near, far = _bends(some, step)[:, step:-step], _bends(some, 2 * step)
        around = cv2.dilate(np.nan_to_num(far, nan=np.inf), np.ones((1, 4 * step + 1)))
        found += int(np.count_nonzero(_SMOOTH_TIMES * (near - 2 * rounded) > around))
    return found < FEW  # an edge of the ply meets each line twice


def _bends(lines: Floats, apart: int) -> Floats:
    """Return the second differences along lines (N, W), without their signs."""
    return np.asarray(np.abs(lines[:, 2 * apart :] - 2 * lines[:, apart:-apart] + lines[:, : -2 * apart]))
