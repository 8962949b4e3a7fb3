"""What the filters take for noise: standing wrinkles, and bumps on the mold or on top of a pocket, all of them narrow.

A fold 2 mm wide, or a foreign body under the ply 5 to 9 mm wide at its foot, covers a few rows of pixels. The filters
of single points and the median of the height map remove such points, as they remove flying pixels. One search of the
raw scan, before any filter, finds them all: what stands out of the scan's morphological opening is narrower than the
opening's window (the top-hat transform; Soille, Morphological Image Analysis, 2003, section 4.5). What the ply does
over longer ways, a pocket or the mold below, drops out. Whether the height map has lost such a place shows when the two
are compared (`lost_places`); what both show is judged by the fibre lines alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import _core, rings
from debulk.arrays import Bools, Cloud, Floats, Whole
from debulk.inspection.evidence import flying
from debulk.inspection.evidence.cloud_image import SAMPLE_MM, CloudImage
from debulk.inspection.evidence.pieces import grown, pieces_of
from debulk.inspection.place import ply_edge
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.inspection.running.cycle import heed, or_late
from debulk.results.finding import Finding
from debulk.results.number import HIGHEST_MM
from debulk.results.report import LeftOut
from debulk.verdict import Verdict
from debulk.words import xy_of


@dataclass(frozen=True)
class Limits:
    """Of places that the filters take for noise; `tests/python/inspection/test_narrow.py` has such places."""

    stands_out_mm: float = 0.4  # above the opening, at least
    one_of: int = 8  # samples, but the `fewest` at least, are the top of a place: their mean is its height
    flies: float = 1.5  # times the median of the top: what is higher is a flying pixel
    noise: float = 3.0  # least height above the opening, over the median of all: the opening lies below by the noise
    fewest: int = 4  # samples that stand out: fewer are flying pixels
    # At half the height: what is wider survives the filters. Pixels half as far apart resolve nothing so narrow.
    widest_mm: float = 8.0
    sunk_share: float = 0.07  # of the samples near by that lie deep below: in a highlight, half of them do
    near_samples: int = 3  # how far from a place "near by" is
    spoiled_share: float = 0.2  # of the ply's samples that stand out: more of them are no places but a spoiled scan


LIMITS = Limits()
_ROUND = 4 / math.pi  # a disc's diameter over its area over its diameter
_FEWEST_PIXELS = 8  # along each side of an image
_SEARCH = "the search for what the filters take for noise"
_SOME = 5  # of so many rows and columns, one is read for the noise


@dataclass(frozen=True, eq=False)
class Narrow:
    """One narrow place of the raw scan."""

    top_mm: tuple[float, float]
    """Mold XY of its highest sample."""
    ends_mm: tuple[tuple[float, float], tuple[float, float]]
    """Mold XY of the two ends of its longer axis."""
    height_mm: float
    """Above its surroundings."""
    width_mm: float
    length_mm: float
    """`width_mm`, `length_mm`: at half its height."""
    samples_mm: Floats
    """(N, 3) its samples, those first that stand out most: mold XY, and heights above the reference."""
    upper: int
    """How many of them stand out by more than half its height."""

    @property
    def is_wrinkle(self) -> bool:
        """Whether it is so long that it is a standing wrinkle, and no bump."""
        return self.length_mm >= flying.LIMITS.longest_mm


@dataclass(frozen=True)
class Standing:
    """What stands narrowly in a raw scan."""

    places: tuple[Narrow, ...] = ()
    """The places, highest first."""
    sample_mm: float = math.inf
    """Distance of the samples; inf: the scan was not searched."""
    sunk_mm: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    """(M, 2) mold XY of the samples that lie under the mold."""
    left_out: tuple[LeftOut, ...] = ()
    """What could not be looked for."""
    unknown: Finding | None = None
    """Why it is not known whether anything stands narrowly; None if it is known."""


class NarrowSearch:
    """Looks for narrow places in scan after scan."""

    def __init__(self, setup: Setup) -> None:
        self._motion, self._thickness_mm = setup.pose[:3].astype(np.float32), setup.recipe.material.thickness_mm
        self._ground, self._outside, self._first_mm, self._spacing_mm = _ground(setup)

    def find(self, image: CloudImage | None, stop: _core.Stop | None = None) -> Standing:
        """Find the narrow places of a scan's image, or of a list of points that was laid out as one.

        A deadline of the stop ends the search with a finding.
        """
        if image is None or min(image.points.shape[:2]) < _FEWEST_PIXELS:
            return _not_searched("too few points lie on the ply to know which of them are neighbours")
        # Along columns and along rows; that of an area, as of a list of points, is 5 % larger with gaps.
        points, known = image.points, image.pitch_mm
        pitches_mm = (known, known) if image.laid else (_pitch_mm(np.swapaxes(points, 0, 1)), _pitch_mm(points))
        if not (pitches_mm[0] > 0 and pitches_mm[1] > 0):  # `min` would pass a NaN that comes second
            return _not_searched("the pitch of the scan's pixels is not known")
        if max(pitches_mm) > LIMITS.widest_mm / 2:
            return _not_searched(f"the pixels are {max(pitches_mm):.2g} mm apart")
        return or_late(
            lambda: self._find(image.points, pitches_mm, stop or _core.Stop()),
            stop,
            "the scan was searched for what the filters take for noise",
            lambda late: _not_searched("the deadline passed", late),
        )

    def _find(self, scan: Cloud, pitches_mm: tuple[float, float], stop: _core.Stop) -> Standing:
        coarse_mm = max(pitches_mm)  # a line scanner's lines may lie farther apart than the points along each
        sample_mm = max(1, round(SAMPLE_MM / coarse_mm)) * coarse_mm
        down, right = (max(1, round(sample_mm / pitch_mm)) for pitch_mm in pitches_mm)
        with np.errstate(invalid="ignore", over="ignore"):  # points that are not finite or far off count as not seen
            some = np.ascontiguousarray(scan[::down, ::right])
            points = np.asarray(cv2.transform(some, self._motion), dtype=np.float32)
            heed(stop, _SEARCH)
            height = self._above(points)
            height.reshape(-1)[self._bare(points, height)] = np.nan
            if not np.isfinite(height).any():
                return Standing(sample_mm=sample_mm)
            heed(stop, _SEARCH)
            # What survives the filters is wider than the window: a bell is twice as wide at its foot as half way up.
            out = height - _opened(height, (2 * LIMITS.widest_mm + SAMPLE_MM) / sample_mm)
            heed(stop, _SEARCH)
            some = out[::_SOME, ::_SOME]
            some = some[np.isfinite(some)]
            noise_mm = float(np.median(some)) if some.size else 0.0
            least_mm = max(LIMITS.stands_out_mm, LIMITS.noise * noise_mm)
            # The ply itself, narrow between bare mold, stands no higher than its thickness.
            stands = (np.minimum(out, height - np.float32(self._thickness_mm)) > least_mm) & (out < HIGHEST_MM)
        if np.count_nonzero(stands) > LIMITS.spoiled_share * np.count_nonzero(np.isfinite(height)):
            why = (
                f"the scan is spoiled: more than {LIMITS.spoiled_share:.0%} of it stand out sharply from what is "
                "around, and nothing narrow that stands on the ply can be found or ruled out; scan again"
            )
            return _not_searched("the scan is spoiled", Finding("raw_scan", Verdict.INVALID, why))
        places = []
        for part, own in _groups(stands, flying.LIMITS.longest_mm / sample_mm):
            heed(stop, _SEARCH)
            place = _measured(points[part], height[part], out[part], own, sample_mm)
            if place is not None:
                places.append(place)
        places.sort(key=lambda place: (-place.height_mm, place.top_mm))
        with np.errstate(invalid="ignore"):
            sunk_mm = points[height < -least_mm][:, :2].astype(np.float64)
        return Standing(tuple(places), sample_mm, sunk_mm)

    def _above(self, points: Cloud) -> NDArray[np.float32]:
        """Return the heights (H, W) of points above the reference; NaN off the ply and where nothing was seen."""
        column, row = self._cells(points)
        off = ~(np.isfinite(column) & np.isfinite(row))
        column[off] = row[off] = -_FEWEST_PIXELS
        edge = cv2.BORDER_CONSTANT
        ground = cv2.remap(self._ground, column, row, cv2.INTER_LINEAR, borderMode=edge, borderValue=math.nan)
        return np.asarray(points[..., 2] - ground, dtype=np.float32)

    def _bare(self, points: Cloud, height: NDArray[np.float32]) -> Whole:
        """Return the indices, row by row, of the points outside the outline that are lower than a ply: bare mold."""
        low = np.flatnonzero(height < 0.5 * self._thickness_mm)
        column, row = (np.rint(at).astype(np.int64) for at in self._cells(points.reshape(-1, 3)[low]))
        return low[self._outside[row, column]]

    def _cells(self, points: Cloud) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the columns and rows of points on the reference's grid, between whole numbers."""
        x, y = ((points[..., k] - np.float32(self._first_mm[k])) / np.float32(self._spacing_mm) for k in (0, 1))
        return x, y


def _ground(setup: Setup) -> tuple[NDArray[np.float32], Bools, Floats, float]:
    """Return the reference's heights on the grid of `seen`, NaN where not known or far off the ply, and what is off it.

    An outline that is some millimetres short may leave the top of a place out, so that its surroundings count as well.
    """
    seen, datum = setup.prepared.seen, setup.prepared.datum
    coarse = np.asarray(datum.heights_mm, dtype=np.float32)
    column, row = (
        ((mm - first) / datum.spacing_mm).astype(np.float32)
        for mm, first in zip((seen.x_mm, seen.y_mm), datum.origin_mm, strict=True)
    )
    ny, nx = seen.values.shape  # of which the ply may be a small part
    every = [[0, 0], [nx - 1, 0], [nx - 1, ny - 1], [0, ny - 1]]
    edges = [np.array(every)] if setup.outline is None else [seen.cells(ring) for ring in rings.split(setup.outline)]
    outline = np.asarray(edges[0], dtype=np.int32)  # its cut-outs lie within it
    reach = round(ply_edge.LIMITS.blur_mm / float(seen.spacing_mm))
    low, high = np.clip([outline.min(axis=0) - reach, outline.max(axis=0) + reach + 1], 0, (nx, ny)).astype(np.int32)
    rows, columns = slice(low[1], high[1]), slice(low[0], high[0])
    at = np.meshgrid(column[columns], row[rows])
    between = cv2.remap(coarse, at[0], at[1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    inside = np.zeros(between.shape, np.uint8)
    cv2.fillPoly(inside, [np.asarray(edge, dtype=np.int32) - low for edge in edges], 1)
    near = cv2.dilate(inside, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1)))
    ground, outside = np.full((ny, nx), np.nan, np.float32), np.ones((ny, nx), np.bool_)
    outside[rows, columns] = inside == 0
    np.copyto(ground[rows, columns], between, where=(near > 0) & np.isfinite(seen.values[rows, columns]))
    return ground, outside, np.asarray(seen.origin_mm, dtype=np.float64), float(seen.spacing_mm)


def _opened(height: NDArray[np.float32], window: float) -> NDArray[np.float32]:
    """Return the opening of an image of heights; single samples that lie deep are closed first. NaN: not known."""
    side = max(3, 2 * round(window / 2) + 1)
    unknown = ~(np.abs(height) < 0.5 * flying.FAR_MM)
    out = height.copy()
    for step, wide in ((cv2.dilate, 3), (cv2.erode, 3 + side - 1), (cv2.dilate, side)):
        out[unknown] = -flying.FAR_MM if step is cv2.dilate else flying.FAR_MM  # what is not known takes no part
        step(out, cv2.getStructuringElement(cv2.MORPH_RECT, (wide, wide)), dst=out)
        unknown = np.abs(out) > 0.5 * flying.FAR_MM
    out[unknown] = np.nan
    return out


def _groups(stands: Bools, long: float) -> Iterator[tuple[tuple[slice, slice], Bools]]:
    """Yield the window of each group of samples that is solid or as long as a wrinkle, and which are its own."""
    # A crest may lie between samples, so that what lies between two that stand out joins them.
    joined = cv2.morphologyEx(stands.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    pieces = pieces_of(joined.view(np.bool_), 8)
    labels, count = pieces.labels, len(pieces.sizes)
    number = np.bincount(labels[stands], minlength=count)
    blocks = np.bincount(labels[:-1, :-1][_blocks(stands)], minlength=count)
    extent = np.hypot(*np.diff(pieces.boxes)[:, ::2].T)
    number[0] = 0  # the rest of the image
    for label in np.flatnonzero((number >= LIMITS.fewest) & ((blocks > 0) | (extent >= long))):
        part = pieces.window(int(label), LIMITS.near_samples)
        yield part, (labels[part] == label) & stands[part]


def _measured(
    points: Cloud, height: NDArray[np.float32], out: NDArray[np.float32], own: Bools, sample_mm: float
) -> Narrow | None:
    """Measure a group of samples in its window; None: it is no narrow place of a ply."""
    highest = np.flatnonzero(own)[np.argsort(-out[own], kind="stable")]
    top = out.flat[highest[: max(LIMITS.fewest, len(highest) // LIMITS.one_of)]]
    peak_mm = float(np.minimum(top, LIMITS.flies * np.median(top)).mean())
    upper = own & (out > 0.5 * peak_mm)
    count = int(np.count_nonzero(upper))
    at = np.argwhere(upper) * sample_mm
    y, x = (at - at.mean(axis=0)).T
    turn = 0.5 * math.atan2(2.0 * float((x * y).sum()), float((x * x - y * y).sum()))  # the longer principal axis
    along = math.cos(turn) * x + math.sin(turn) * y
    length_mm = float(np.ptp(along)) + sample_mm
    width_mm = count * sample_mm**2 / length_mm
    if length_mm < 3 * width_mm:
        width_mm = min(length_mm, _ROUND * width_mm)
    is_long = length_mm >= flying.LIMITS.longest_mm
    if count < LIMITS.fewest or width_mm > LIMITS.widest_mm or not (is_long or _blocks(upper).any()):
        return None
    # The crest lies between samples: what the mean over two by two of them is of the height of a bell, cos² by cos².
    phase = math.pi * sample_mm / width_mm
    shown = (0.5 + 0.5 * math.sin(phase) / phase) ** 2
    height_mm = peak_mm if is_long else peak_mm / shown
    if not is_long and height_mm > flying.LIMITS.steep * 2 * width_mm:
        return None
    beside = out[grown(own, LIMITS.near_samples)]
    if np.mean(beside < -0.25 * peak_mm) > LIMITS.sunk_share:
        return None
    if np.mean(~np.isfinite(beside)) > flying.LIMITS.unseen_share:
        return None
    places = points[upper][:, :2].astype(np.float64)
    first, last, summit = places[along.argmin()], places[along.argmax()], points.reshape(-1, 3)[highest[0]]
    return Narrow(
        top_mm=xy_of(summit),
        ends_mm=(xy_of(first), xy_of(last)),
        height_mm=height_mm,
        width_mm=width_mm,
        length_mm=length_mm,
        samples_mm=np.column_stack([points.reshape(-1, 3)[highest, :2], height.flat[highest]]).astype(np.float64),
        upper=count,
    )


def _blocks(stands: Bools) -> Bools:
    """Return where four neighbouring samples of an image, two by two, stand out: a line of flying pixels has none."""
    pairs = stands[:-1] & stands[1:]
    return pairs[:, :-1] & pairs[:, 1:]


def _pitch_mm(scan: Cloud) -> float:
    """Return the median distance of neighbours along rows in the middle of an image; NaN: nothing was seen there."""
    rows, columns = scan.shape[0] // 2, scan.shape[1] // 2
    middle = scan[rows - rows // 4 : rows + rows // 4 : max(1, rows // 32), columns // 2 : columns + columns // 2]
    with np.errstate(over="ignore", invalid="ignore"):
        x, y, z = np.moveaxis(np.diff(middle, axis=1), 2, 0)
        steps = np.sqrt(x * x + y * y + z * z)  # norm() takes three times as long along so short an axis
        steps = steps[np.isfinite(steps)]
    return float(np.median(steps)) if steps.size else math.nan


def _not_searched(why: str, unknown: Finding | None = None) -> Standing:
    entry = LeftOut(
        what="wrinkles that stand already, and bumps that the filters take for noise",
        why=why,
        bound="none: what is wider than the filters' windows is a bump or a pocket, and judged as such",
    )
    return Standing(left_out=(entry,), unknown=unknown)
