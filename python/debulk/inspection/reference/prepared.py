"""The preparation of an inspector's reference cloud, which is done once."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud, pocket, surface
from debulk._core import InputError
from debulk.arrays import Cloud, Floats
from debulk.forking import kept
from debulk.grid import Grid
from debulk.inspection.clouds import fingerprint
from debulk.inspection.clouds.camera import PinholeImage, fit_camera
from debulk.inspection.clouds.cleaning import clean, hide, owned
from debulk.inspection.clouds.far_place import NEAR, FarPlace
from debulk.inspection.clouds.products import product
from debulk.inspection.clouds.thinning import complete, pitch_of, thinned
from debulk.inspection.clouds.unseen_marks import refuse_marks
from debulk.inspection.reference import frame, resolution
from debulk.inspection.running.cycle import Cycle
from debulk.inspection.running.effort import check_map
from debulk.recipe import Recipe
from debulk.results.trace import ArrayTrace

log = logging.getLogger("debulk")
_CLIFF_MM = 3.0  # so far off the surface lies another one, beyond a cliff; the least that is found is 4.7 mm high
_LEAST_SPACING_MM = 0.5  # of the height map: a finer map shows no more of a pocket


@dataclass(frozen=True, eq=False)
class Prepared:
    """What an inspector keeps of its reference cloud."""

    reference: surface.Reference
    seen: Grid
    """`reference`, `seen`: the smooth surface, and the heights that it was fitted to: NaN where nothing was seen, and
    where the surface does not follow them."""
    image: PinholeImage | None = None
    """Image of the pinhole camera that took the cloud; None: no such camera took it."""
    sample: NDArray[np.float32] | None = None
    """(N, 3) some points of the cloud, as `debulk.inspection.clouds.thinning.thinned` takes them. A scan with these
    points is the reference itself. None: not kept."""
    cloud: ArrayTrace | None = None
    """Shape and fingerprint of the cloud; None: not kept."""
    place: FarPlace = NEAR
    """The shift of clouds that lie far from the origin of the scanner's frame."""
    hidden: Grid | None = None
    """The heights far off the surface, as beside a cliff, NaN elsewhere; None: there are none, or not kept."""
    thickness_mm: float = 0.0
    """Thickness of the ply whose heights are measured above the `datum`."""

    @property
    def grid_spacing_mm(self) -> float:
        """Spacing of the height maps, which is that of `seen`."""
        return float(self.seen.spacing_mm)

    @kept
    def datum(self) -> surface.Reference:
        """The surface above which all heights of scans are measured; see `debulk.surface.Reference.datum`."""
        return self.reference.datum(self.thickness_mm)

    @kept
    def seen_at(self) -> Grid:
        """Marks where `seen` has a height."""
        return replace(self.seen, values=np.isfinite(self.seen.values))

    def between(self, places_mm: Floats) -> NDArray[np.bool_]:
        """Return (N, 2) whether the reference was seen on both sides of (N, 2) places, mold XY: along x, and along y.

        Where it is so along neither, the surface is only continued; a steep flank leaves a gap from side to side.
        """
        known, cells = self.seen_at.values, self.seen.cells(places_mm)
        holds = self.seen.holds(cells)
        column, row = np.where(holds, cells[:, 0], 0), np.where(holds, cells[:, 1], 0)
        out = []
        for lines, line, at in ((known, row, column), (known.T, column, row)):
            first, last = lines.argmax(axis=1), lines.shape[1] - 1 - lines[:, ::-1].argmax(axis=1)
            out.append(holds & np.asarray(lines.any(axis=1))[line] & (first[line] < at) & (at <= last[line]))
        return np.stack(out, axis=1)

    def bare_mm(self, xy: Floats) -> Floats:
        """Return the heights (N,) of the bare mold above the datum at (N, 2) places, mold XY: 0 where it is level."""
        inside = np.clip(xy, *self.reference.box_mm)
        return np.asarray(self.reference.height(inside) - self.datum.height(inside))

    def missed_mm(self, xy: Floats) -> Floats:
        """Return by how much the reference's measured heights stand above the surface fitted to them, at (N, 2) places.

        A smooth surface fills grooves of a mold in and cuts its ribs and edges off, and what it misses so appears in
        every scan. (N,), mm; NaN where nothing was seen.
        """
        seen, (low, high) = self.seen, self.reference.box_mm
        at = seen.origin_mm + seen.spacing_mm * seen.cells(xy)
        out = seen.at(xy)
        inside = ((at >= low) & (at <= high)).all(axis=1)
        out[~inside] = np.nan
        out[inside] -= self.reference.height(at[inside])
        return out

    def seen_on_grid(self) -> tuple[NDArray[np.float32], Floats, float]:
        """Return `seen` in the form that the C++ core takes: values, origin, spacing."""
        return np.asarray(self.seen.values, dtype=np.float32), self.seen.origin_mm, float(self.seen.spacing_mm)


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A reference cloud without its outliers, before it is laid on a grid; with what is kept of it as it came."""

    points: Cloud
    """In the mold's frame."""
    image: PinholeImage | None
    sample: NDArray[np.float32]
    trace: ArrayTrace | None
    place: FarPlace
    """`image`, `sample`, `trace`, `place`: as `Prepared` has them."""


def prepare(
    reference: ArrayLike | Cleaned,
    mold_from_scanner: Floats | None,
    camera: Floats | None,
    mask: NDArray[np.bool_] | None,
    ply_outline: Floats | None,
    recipe: Recipe,
    preparation: Cycle,
) -> Prepared:
    """Clean the reference cloud, lay it on a grid, and fit the smooth surface and the camera.

    Beside a cliff the surface is that of the side on which the ply lies, if its outline is known. One copy of the cloud
    is made at most, and all work is done in that copy.
    """
    threads, stop, step = recipe.run.threads, preparation.stop, preparation.step
    if not isinstance(reference, Cleaned):
        reference = _cleaned(reference, mold_from_scanner, camera, mask, recipe, preparation)
    image, sample, trace, place = reference.image, reference.sample, reference.trace, reference.place
    if image is not None and mold_from_scanner is None:
        raise frame.pose_needed()
    try:
        heights = _gridded(reference.points, sample, place.pose(mold_from_scanner), recipe, preparation)
        del reference  # the memory of a cloud, which the fit does not need
        fitted = step("reference: fit", 0.65, lambda: _fitted(heights, ply_outline, threads, stop))
    except InputError as error:
        masked = "" if mask is None else f"; the mask hides {np.count_nonzero(mask)} of {mask.size} pixels"
        raise InputError(f"{error}{masked}") from None
    hidden = step("reference: check", 0.87, lambda: _hide_misfits(heights, fitted, threads, stop))
    return Prepared(fitted, heights, image, sample, trace, place, hidden)


def _gridded(
    points: Cloud,
    of_scanner: NDArray[np.float32],
    mold_from_scanner: Floats | None,
    recipe: Recipe,
    preparation: Cycle,
) -> Grid:
    """Return the cleaned cloud's heights on a grid, checked against a sample of what was given."""
    threads, stop = recipe.run.threads, preparation.stop
    spacing, pitch = _spacing_mm(points, recipe, stop)
    heights = preparation.step(
        "reference: grid",
        0.3,
        lambda: surface.grid_heights(points, spacing_mm=spacing, pitch_mm=pitch, threads=threads, stop=stop),
    )
    if points.ndim == 3:
        seen = of_scanner[complete(np.isfinite(of_scanner))].astype(np.float64)
        if mold_from_scanner is not None:
            seen = product(seen, mold_from_scanner[:3, :3].T) + mold_from_scanner[:3, 3]
        resolution.check_neighbours(seen[:, :2], heights)
    resolution.check_reference(_core.cloud.widest_pitch(points, pitch or spacing, stop), len(of_scanner), recipe)
    return heights


def _cleaned(
    reference: ArrayLike,
    mold_from_scanner: Floats | None,
    camera: Floats | None,
    mask: NDArray[np.bool_] | None,
    recipe: Recipe,
    preparation: Cycle,
) -> Cleaned:
    stop, step = preparation.stop, preparation.step
    place = FarPlace.of(reference, mold_from_scanner, camera)
    reference = place.near(reference, "reference", stop)
    with fingerprint.of_scan(reference, stop, recipe.run.scan_hash) as fingerprinted:
        points = step("reference: copy", 0.0, lambda: owned(reference, "reference", stop))
        points = hide(points, mask, "reference", stop)
        of_scanner = thinned(points).points
        refuse_marks(of_scanner[complete(np.isfinite(of_scanner))], "reference")
        pose = place.pose(mold_from_scanner)
        moved, image = step("reference: clean", 0.15, lambda: cleaned(points, pose, camera, recipe, stop))
    return Cleaned(moved, image, of_scanner, fingerprinted(), place)


def cleaned(
    points: Cloud, mold_from_scanner: Floats | None, camera: Floats | None, recipe: Recipe, stop: _core.Stop
) -> tuple[Cloud, PinholeImage | None]:
    """Return a cloud in the mold's frame without its outliers, as `clean` does, and the image of its camera.

    A camera of None is fitted.
    """
    image = None
    if points.ndim == 3:
        found = fit_camera(points) if camera is None else camera
        # A lattice over a flat mold fits a pinhole, too: one that would see the mold from below is none.
        if camera is None and mold_from_scanner is not None and mold_from_scanner[2, 2] > 0:
            found = None
        image = None if found is None else PinholeImage(*points.shape[:2], *map(float, found))
    return clean(points, mold_from_scanner, None if image is None else image.camera, recipe, stop), image


def _fitted(heights: Grid, ply_outline: Floats | None, threads: int, stop: _core.Stop) -> surface.Reference:
    """Fit the surface; if the fit refuses the heights, raise an error that describes the cloud instead."""
    under_ply = None if ply_outline is None else pocket.inside_outline(ply_outline, heights)
    try:
        return surface.fit_reference(heights, under_ply=under_ply, threads=threads, stop=stop)
    except InputError as error:
        known = int(np.isfinite(heights.values).sum())
        rows, columns = heights.values.shape
        raise _too_narrow(heights.spacing_mm * columns, heights.spacing_mm * rows, f" with {known} heights") from error


def _too_narrow(wide_mm: float, long_mm: float, came: str = "") -> InputError:
    return InputError(
        "reference: expected a cloud wide enough for a surface to be fitted to it, but got one of "
        f"{wide_mm:.3g} by {long_mm:.3g} mm{came}; give the whole cloud of what is below the ply"
    )


def _hide_misfits(heights: Grid, fitted: surface.Reference, threads: int, stop: _core.Stop) -> Grid | None:
    """Set the heights that the surface does not follow to NaN, in place: the mold is not known there.

    Return those far off the surface, if there are any.
    """
    off = surface.misfits(heights, fitted, threads=threads, stop=stop)
    row, column = np.nonzero(off)
    if not len(row):
        return None
    log.info(
        "the smooth reference does not follow %.3g cm2 of what was measured", len(row) * heights.spacing_mm**2 / 100
    )
    places_mm = heights.origin_mm + heights.spacing_mm * np.column_stack([column, row])
    off_mm = fitted.height(np.clip(places_mm, *fitted.box_mm)) - heights.values[row, column]
    hidden = np.full_like(heights.values, np.nan)
    hidden[row, column] = np.where(np.abs(off_mm) > _CLIFF_MM, heights.values[row, column], np.nan)
    heights.values[off] = np.nan
    return replace(heights, values=hidden) if np.isfinite(hidden).any() else None


def _spacing_mm(points: Cloud, recipe: Recipe, stop: _core.Stop) -> tuple[float, float]:
    """Return the height map's spacing for a cloud in the mold's frame, and the cloud's pitch, 0 if it is not known.

    Before, the cloud's frame, density and size are checked.
    """
    threads = recipe.run.threads
    sample, each = thinned(points)
    in_mold = sample[complete(np.isfinite(sample))].astype(np.float64)
    if not len(in_mold):
        raise InputError("reference: expected a cloud, but of 30 000 places in it none holds a point")
    apart_mm = pitch_of(in_mold[:, :2], each)
    frame.check_cloud_frame(in_mold, apart_mm)
    resolution.check_reference(apart_mm, len(in_mold), recipe)
    spacing, pitch_mm = recipe.clean.grid_spacing_mm, 0.0
    if not spacing:  # a multiple of 1/1024 mm, so that grid positions are exact, in the whole map and in a part of it
        pitch_mm = cloud.median_pitch(points, threads=threads, stop=stop)
        spacing = max(round(1024 * pitch_mm) / 1024, _LEAST_SPACING_MM)
    _, low, high = _core.cloud.bounds(points, threads)
    wide_mm, long_mm = high[0] - low[0], high[1] - low[1]
    if min(wide_mm, long_mm) < spacing:  # a single row of points, as from a line scanner
        raise _too_narrow(wide_mm, long_mm)
    check_map(np.array(low[:2]), np.array(high[:2]), spacing, recipe)
    return spacing, pitch_mm
