"""Parts of a scan that the scanner's own software filled in, clipped or smoothed, and that were thus not measured."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from debulk import _core
from debulk.arrays import Bools, Cloud
from debulk.inspection.evidence.cloud_image import CloudImage
from debulk.inspection.evidence.outline import Outline
from debulk.inspection.evidence.ply_image import shows
from debulk.inspection.evidence.ply_zones import PlyZones
from debulk.inspection.evidence.sample import over_reference
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.inspection.rawscan.rounded import made_in
from debulk.inspection.rawscan.shared_noise import MIDDLE
from debulk.inspection.rawscan.smoothed import Smoothed, SmoothedSearch
from debulk.inspection.rawscan.vouched import LIMITS, UP, Axes, Made, asked_in
from debulk.inspection.running.cycle import heed, or_late
from debulk.recipe import options
from debulk.results.finding import Finding
from debulk.results.report import LeftOut

_SEARCH = "the search for what the scanner's software made"


@dataclass(frozen=True)
class Filled:
    """What a scan shows of the software that processed it."""

    made: tuple[Made, ...] = ()
    """The parts for which the scan's noise does not vouch."""
    unknown: str = ""
    """Why some or all such parts could not be found; empty if they could."""
    smoothed: Smoothed = field(default_factory=Smoothed)
    """Signs that the whole scan was smoothed."""
    late: tuple[Finding, ...] = ()
    """A finding, if a deadline cut the search off."""

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
        up = tuple(setup.pose[2, :3].tolist())  # along it heights may have been clipped, not along the scanner's z
        self._axes: Axes = tuple(dict.fromkeys((UP, up)))
        self.smoothed = SmoothedSearch(setup, outline)
        self._least_mm2 = options.looked_for_mm2(setup.recipe)

    def find(self, image: CloudImage | None, stop: _core.Stop | None = None) -> Filled:
        """Search a scan's image. A deadline of the stop ends the search with a finding."""
        return or_late(
            lambda: self._find(image, stop or _core.Stop()),
            stop,
            f"the end of {_SEARCH}",
            lambda late: Filled(unknown="the deadline passed", late=(late,)),
        )

    def _find(self, image: CloudImage | None, stop: _core.Stop) -> Filled:
        if image is None:
            return Filled(unknown="too few points lie on the ply to lay them out as an image")
        if min(image.points.shape[:2]) < 2 * MIDDLE or not np.isfinite(image.pitch_mm):
            return Filled(unknown=f"the scan's image has not {2 * MIDDLE} rows and columns")
        wide_mm, laid = 2 * float(np.sqrt(self._least_mm2 / np.pi)), image.laid
        with np.errstate(invalid="ignore", over="ignore"):  # points that are not finite or far off count as not seen
            heed(stop, _SEARCH)
            smoothed = self.smoothed.find(image, lambda points: self._lie(points, laid=laid)[1], wide_mm)
            heed(stop, _SEARCH)
            made, unknown = ((), "") if smoothed.shared_mm else self._not_vouched(image, stop)
        seen_mm = LIMITS.seen_pixels * image.pitch_mm
        if not unknown and seen_mm > wide_mm:
            unknown = f"on pixels {image.pitch_mm:.2g} mm apart patches less than {seen_mm:.0f} mm wide can be missed"
        return Filled(made, unknown, smoothed)

    def at(self, edge: Outline, found: Filled, image: CloudImage) -> Filled:
        """Return what was found, with the blur of an edge of the ply that was seen; see `SmoothedSearch.at`."""
        smoothed = self.smoothed.at(edge, found.smoothed, image)
        # In a scan that was smoothed everywhere, points repeat and lack noise here and there by chance.
        return replace(found, made=() if smoothed.findings() else found.made, smoothed=smoothed)

    def on_ply(self, points: Cloud) -> Bools:
        """Return which of (N, 3) points of a scan, all finite, lie on the ply, well inside its outline."""
        return self._lie(points)[1]

    def _not_vouched(self, image: CloudImage, stop: _core.Stop) -> tuple[tuple[Made, ...], str]:
        axes = (UP,) if image.laid else self._axes
        if not image.laid:  # beside the ply another surface has another noise
            part = image.points[shows(image.points, self._setup, self._zones.box_mm)]
            image = CloudImage(part, part, image.pitch_mm)
        asked = asked_in(image, axes, self._threads, stop)
        places, shape = asked.points.reshape(-1, 3), asked.points.shape[:2]
        moved, on_ply = self._lie(places, laid=image.laid)
        heed(stop, _SEARCH)
        xy_mm = moved.reshape(*shape, 3)[..., :2]
        return made_in(image, asked, xy_mm, on_ply.reshape(shape), axes, self._threads, stop)

    def _lie(self, points: Cloud, *, laid: bool = False) -> tuple[Cloud, Bools]:
        """Return (N, 3) points of a scan in the mold's frame, and which were seen well inside the ply's outline.

        The points of a list that was laid out are in mold XY already, and their z is above the reference.
        """
        if not laid:
            return over_reference(points, self._setup, self._zones.on)
        on: Bools = np.isfinite(points[:, 2])
        on[on] = self._zones.hold(points[on, :2].astype(np.float64))
        return points, on
