"""The inspection: from a scan to a verdict, step by step."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud, pocket, surface
from debulk.grid import Grid
from debulk.inspection import front
from debulk.inspection.evaluation import Evaluation, criteria, evaluate
from debulk.inspection.inputs import angles, camera_parameters, image_mask, outline, pose
from debulk.inspection.prepared import Prepared
from debulk.inspection.regions import Found, RegionFront, in_order
from debulk.report import Report
from debulk.results.report import LeftOut
from debulk.verdict import Judgement, Verdict, judge_layup

if TYPE_CHECKING:
    from debulk.comparison import Comparison
    from debulk.recipe import Recipe

__all__ = ["Cancelled", "Inspector"]

InputError = _core.InputError
Progress = Callable[[str, float], None]
Result = TypeVar("Result")
_WHOLE = "none: the whole scan was processed, which takes longer"
log = logging.getLogger("debulk")
log.addHandler(logging.NullHandler())


class Cancelled(RuntimeError):
    """The inspection was cancelled from another thread; there is no report."""


class Inspector:
    """Inspects scans of one ply against the reference below it. Prepared once, then used cycle after cycle.

    Parameters
    ----------
    recipe
        All settings. None: ``Recipe()``.
    reference
        (H, W, 3) organised or (N, 3) cloud of the surface below the ply, mm, NaN = nothing seen; of a layup of several
        plies, the scan after the ply before.
    ply_outline
        (M, 2) outline of the ply, mold XY, mm, closed from last to first. None: unknown; then no edge of a pocket is
        free, and the report says so.
    fibre_angles_deg
        The two fibre directions, degrees counter-clockwise from mold +x, projected along z: two numbers, or a
        `debulk.Grid` with values (ny, nx, 2).
    mold_from_scanner
        (4, 4) rigid motion from the scanner's frame, in which scan and reference are, to the mold's: x_mold = T x.
        None: they are in the mold's frame already.
    camera
        (f, cx, cy) in pixels, of an organised cloud in the scanner's frame. None: fitted to the reference. With it the
        height map takes the fast way; without a pinhole camera (a residual above 0.1 px, an unorganised cloud, a scan
        of another shape than the reference) the general one, with the same decisions.
    mask
        (H, W) bool, True where the image shows a clamp or a tool: these points of an organised scan are not used.

    Raises
    ------
    InputError
        Names what was wrong, what was expected and what came.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    >>> report = inspector.inspect(layup.scan)
    >>> report.verdict
    <Verdict.CREASE: 'crease'>
    """

    def __init__(
        self,
        recipe: Recipe | None,
        reference: ArrayLike | Prepared,
        ply_outline: ArrayLike | None = None,
        fibre_angles_deg: ArrayLike | Grid = (0.0, 90.0),
        mold_from_scanner: ArrayLike | None = None,
        camera: tuple[float, float, float] | None = None,
        mask: ArrayLike | None = None,
    ) -> None:
        if recipe is None:
            from debulk.recipe import Recipe

            recipe = Recipe()
        self.recipe = recipe
        self.ply_outline = outline(ply_outline)
        self.fibre_angles_deg = angles(fibre_angles_deg)
        self.mold_from_scanner = pose(mold_from_scanner)
        self.camera = camera_parameters(camera)
        self.mask = image_mask(mask)
        self._lock = threading.Lock()
        self._running: set[_core.Stop] = set()

        self._front_lock = threading.Lock()  # they keep their buffers: one scan at a time
        self.prepared = reference if isinstance(reference, Prepared) else self._prepare(reference)
        self.grid_spacing_mm = self.prepared.grid_spacing_mm
        self.reference = self.prepared.reference
        # Made now, not in the first cycle; beside regions the front end of whole scans waits until a scan needs it.
        self._regions, self._why_whole = self._region_front()
        self._front = None if self._regions else self._front_end()

    def _prepare(self, reference: ArrayLike) -> Prepared:
        clean, threads = self.recipe.clean, self.recipe.run.threads
        seen = self._checked(reference, "reference")
        points = self._clean(self._in_mold_frame(seen), _core.Stop())
        spacing = clean.grid_spacing_mm
        if not spacing:  # of few binary digits: then grid positions are exact, in the whole map and in a part of it
            spacing = max(round(1024 * cloud.median_pitch(points, threads=threads)) / 1024, 0.5)
        heights = surface.grid_heights(points, spacing_mm=spacing, threads=threads)
        camera = front.fit_camera(seen) if self.camera is None and seen.ndim == 3 else self.camera
        image = None if camera is None or seen.ndim != 3 else (*seen.shape[:2], *map(float, camera))
        return Prepared(surface.fit_reference(heights, threads=threads), heights, spacing, image)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the prepared inspector with its recipe, for `load`: a .npz of plain arrays, a few seconds' work saved.

        Raises
        ------
        InputError
            If the ending is another, or the file cannot be written.
        """
        from debulk.inspection import prepared as inspector_file

        path = Path(path)
        if path.suffix.lower() != ".npz":
            raise InputError(f"{path}: expected a file ending in .npz")
        inspector_file.write(self, path)

    @classmethod
    def load(cls, path: str | PathLike[str], recipe: Recipe | None = None) -> Inspector:
        """Read an inspector that `save` wrote; it inspects as that one did, to the last bit.

        Parameters
        ----------
        path
            The .npz file.
        recipe
            Other settings than the saved ones; its section clean must be the same, for the reference went through it.

        Raises
        ------
        InputError
            If the file is not such a file, or was cut off, or the recipe's section clean is another.
        """
        from debulk.inspection import prepared as inspector_file
        from debulk.recipe import Recipe

        path = Path(path)
        given = inspector_file.read(path)
        try:
            given["recipe"] = saved = Recipe(**given["recipe"])
            if recipe is not None and recipe.clean != saved.clean:
                raise InputError(f"recipe: expected the section clean of the saved one, {saved.clean}")
            return cls(**(given if recipe is None else {**given, "recipe": recipe}))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def inspect(self, scan: ArrayLike, deadline_s: float | None = None, progress: Progress | None = None) -> Report:
        """Inspect one scan.

        Parameters
        ----------
        scan
            (H, W, 3) organised or (N, 3) cloud, float32 or float64, mm, in the reference's frame, NaN = nothing seen.
        deadline_s
            Seconds from now. Pockets that are not evaluated by then are UNDECIDED; the search for outliers and the
            solver end early, the other stages (a few tenths of a second at 20 million points) do not.
        progress
            Called with the name of the stage and the share of the work that is done, from the calling thread.

        Returns
        -------
        Report
            With the verdict, each pocket, timings, and what was left out.

        Raises
        ------
        InputError
            Names what was wrong with the scan.
        Cancelled
            After `cancel`.
        """
        cycle = _Cycle(deadline_s, progress)
        try:
            with self._cancellable(cycle.stop):
                return self._inspect(scan, cycle)
        except _core.Stopped:
            if cycle.stop.cancelled:
                raise Cancelled("the inspection was cancelled") from None
            return self._too_late(cycle)

    def _inspect(self, scan: ArrayLike, cycle: _Cycle) -> Report:
        """Walk through the steps."""
        with cycle.stage("height map", 0.0):
            found, parts_ms = _watched(cycle.stop, lambda: self._find(scan, cycle.stop))
        cycle.split("height map", parts_ms)
        with cycle.stage("debulk", 0.45):
            evaluations = self._evaluate(found, cycle)
        with cycle.stage("report", 1.0):
            return self._report(found, evaluations, cycle)

    def _find(self, scan: ArrayLike, stop: _core.Stop) -> tuple[Found, dict[str, float]]:
        """Pockets, through regions of interest or in the whole scan; and times in ms."""
        why_whole = self._why_whole
        if self._regions is not None:
            points = cloud.as_cloud(scan, "scan")
            if self.mask is None or self.mask.shape == points.shape[:2]:
                with self._front_lock:
                    found = self._regions.inspect(points, self.mask, stop)
                    if found is not None:
                        return found, self._regions.times_ms
                    why_whole = self._regions.reason
        with self._front_lock:
            height_map, parts_ms = self._height_map(scan, stop)
            began = time.perf_counter()
            segmentation, feet = self._segment(height_map, stop)
            parts_ms["pockets"] = 1e3 * (time.perf_counter() - began)
            overview = Grid(height_map.values.copy(), height_map.origin_mm, height_map.spacing_mm)
        known = np.count_nonzero(np.isfinite(segmentation.heights.values)) * overview.spacing_mm**2
        left_out = () if not why_whole else (LeftOut(what="regions of interest", why=why_whole, bound=_WHOLE),)
        return Found([(segmentation, feet)], float(known), overview, left_out), parts_ms

    def compare(self, report: Report, debulked_scan: ArrayLike) -> Comparison:
        """Hold a report against a scan of the same ply after debulking. See `debulk.compare`.

        Parameters
        ----------
        report
            Of the inspection before debulking.
        debulked_scan
            As the scan of `inspect`.

        Raises
        ------
        InputError
            Names what was wrong.
        Cancelled
            After `cancel`.
        """
        from debulk.inspection.comparing import compared

        stop = _core.Stop()
        try:
            with self._cancellable(stop):
                points = self._clean(self._in_mold_frame(self._checked(debulked_scan, "debulked_scan")), stop)
                heights = surface.height_map(  # what was not seen is not measured: no hole is filled in
                    points, self.reference, self.grid_spacing_mm, hole_diameter_mm=0.0, threads=self.recipe.run.threads
                )
        except _core.Stopped:
            raise Cancelled("the comparison was cancelled") from None
        return compared(report, heights, self.recipe)

    def cancel(self) -> None:
        """Stop the inspections that run, from any thread: they raise `Cancelled`, within an iteration of the solver."""
        with self._lock:
            for stop in self._running:
                stop.cancel()

    @contextmanager
    def _cancellable(self, stop: _core.Stop) -> Iterator[None]:
        with self._lock:
            self._running.add(stop)
        try:
            yield
        finally:
            with self._lock:
                self._running.discard(stop)

    def _checked(self, points: ArrayLike, name: str) -> NDArray[np.float32]:
        """Points as float32, without what the mask hides."""
        checked = cloud.checked(points, name)
        if self.mask is None:
            return checked
        if checked.shape[:2] != self.mask.shape:
            raise InputError(
                f"mask: expected the shape of the {name}'s image, {checked.shape[:2]}, but got {self.mask.shape}"
            )
        return np.where(self.mask[..., None], np.float32(np.nan), checked)

    def _in_mold_frame(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        if self.mold_from_scanner is None:
            return points
        return cloud.transform(points, self.mold_from_scanner, threads=self.recipe.run.threads)

    def _clean(self, points: NDArray[np.float32], stop: _core.Stop) -> NDArray[np.float32]:
        clean = self.recipe.clean
        keep = cloud.remove_outliers(
            points,
            clean.neighbours,
            clean.std_ratio,
            least_ratio=clean.least_ratio,
            threads=self.recipe.run.threads,
            stop=stop,
        )
        return np.where(keep[..., None], points, np.float32(np.nan))

    def _height_map(self, scan: ArrayLike, stop: _core.Stop) -> tuple[surface.HeightMap, dict[str, float]]:
        """Outliers removed, heights above the reference, holes filled in, spikes, median; and times in ms.

        The map is in the front end's memory: for who holds its lock, until the next scan.
        """
        points = self._checked(scan, "scan")
        if self._front is None:
            self._front = self._front_end()
        return self._front.inspect(points, stop, copy=False), self._front.times_ms

    def _front_end(self) -> front.FrontEnd:
        clean, image = self.recipe.clean, self.prepared.image
        return front.FrontEnd(
            self.reference,
            (2, 2) if image is None else image[:2],
            None if image is None else image[2:],
            self.mold_from_scanner,
            spacing_mm=self.grid_spacing_mm,
            box_mm=self._ply_box(),
            neighbours=clean.neighbours,
            std_ratio=clean.std_ratio,
            least_ratio=clean.least_ratio,
            hole_diameter_mm=clean.max_hole_mm,
            spike_mm=clean.spike_mm,
            median_cells=clean.median_cells,
            threads=self.recipe.run.threads,
        )

    def _ply_box(self) -> NDArray[np.float64] | None:
        """Lowest and highest XY of the ply and of what the filters see beside it; None: all of the reference."""
        if self.ply_outline is None:
            return None
        margin = max(30.0, 2 * self.recipe.clean.max_hole_mm)
        low, high = self.ply_outline.min(axis=0) - margin, self.ply_outline.max(axis=0) + margin
        known = _core.surface_extent(self.reference)
        beside = (low >= known.max(axis=0)).any() or (high <= known.min(axis=0)).any()
        return None if beside else np.stack([low, high])

    def _region_front(self) -> tuple[RegionFront | None, str]:
        """None: scans are processed whole, and why if regions were asked for."""
        if not self.recipe.segmentation.regions:
            return None, ""
        image = self.prepared.image
        if image is None:
            return None, "the reference is not an image of a pinhole camera"
        regions = RegionFront(
            self.reference, image, self.mold_from_scanner, self.grid_spacing_mm, self.ply_outline, self.recipe
        )
        return (regions, "") if regions.usable else (None, regions.reason)

    def _segment(self, height_map: surface.HeightMap, stop: _core.Stop) -> tuple[pocket.Segmentation, pocket.Feet]:
        wanted, patch = self.recipe.segmentation, self.recipe.patch
        segmentation = pocket.segment(
            height_map,
            wanted.cut_height_mm,
            wanted.area_tol_mm2,
            wanted.peak_tol_mm,
            self.ply_outline,
            smooth_mm=patch.smooth_mm,
            threads=self.recipe.run.threads,
            stop=stop,
        )
        feet = pocket.feet(
            segmentation,
            thickness_mm=self.recipe.material.thickness_mm,
            mold_tol_mm=patch.mold_tol_mm,
            smooth_mm=patch.smooth_mm,
            threads=self.recipe.run.threads,
            stop=stop,
        )
        return segmentation, feet

    def _evaluate(self, found: Found, cycle: _Cycle) -> list[Evaluation]:
        order = in_order(found)

        def one(number: int) -> Evaluation:
            part, index = order[number]
            segmentation, feet = found.parts[part]
            return evaluate(
                segmentation,
                feet,
                index,
                self.reference,
                self.ply_outline,
                self.fibre_angles_deg,
                self.recipe,
                cycle.stop,
                number + 1,
                pool,
            )

        count = len(order)
        threads = self.recipe.run.threads or _core.default_threads()
        evaluations = []
        # The core's calls release the GIL; whatever ends the wait (Ctrl-C, an error of progress) ends the solvers.
        with ThreadPoolExecutor(threads, "debulk") as pool, _stopping(cycle.stop):
            for done, evaluation in enumerate(pool.map(one, range(count)), start=1):
                evaluations.append(evaluation)
                cycle.report("debulk", 0.45 + 0.55 * done / count)
        if cycle.stop.cancelled:
            raise Cancelled("the inspection was cancelled")
        return evaluations

    def _report(
        self,
        found: Found,
        evaluations: list[Evaluation],
        cycle: _Cycle,
    ) -> Report:
        coverage = self._coverage(found)
        pockets = tuple(evaluation.report for evaluation in evaluations)
        judged = judge_layup([(p.id, Judgement(p.verdict, p.reason)) for p in pockets], coverage, criteria(self.recipe))
        left_out = self._left_out(found) + tuple(entry for e in evaluations for entry in e.left_out)
        log.info("%s: %s", judged.verdict.value, judged.reason)
        return Report(
            verdict=judged.verdict,
            reason=judged.reason,
            pockets=pockets,
            timings_ms=cycle.timings_ms(),
            left_out=_merged(left_out),
            coverage=coverage,
            height_map=found.overview,
            ply_outline_mm=self.ply_outline,
            recipe=self.recipe.model_dump(),
        )

    def _too_late(self, cycle: _Cycle) -> Report:
        return Report(
            verdict=Verdict.UNDECIDED,
            reason=f"the deadline passed during the stage {cycle.current}, before any pocket was known",
            pockets=(),
            timings_ms=cycle.timings_ms(),
            ply_outline_mm=self.ply_outline,
            recipe=self.recipe.model_dump(),
        )

    def _coverage(self, found: Found) -> float:
        """Share of the ply (no outline: of the reference) whose height is known, measured or filled in by the rule."""
        expected: float
        if self.ply_outline is None:
            expected = np.count_nonzero(np.isfinite(self.prepared.seen.values)) * self.grid_spacing_mm**2
        else:
            expected = abs(pocket.polygon_area(self.ply_outline))
        return float(min(1.0, found.known_mm2 / expected))

    def _left_out(self, found: Found) -> tuple[LeftOut, ...]:
        wanted = self.recipe.segmentation
        dropped = [d for segmentation, _ in found.parts for d in segmentation.dropped]
        entries = [
            LeftOut(
                what=f"bump of {d.area_mm2 / 100:.2f} cm² at ({d.centroid_mm[0]:.0f}, {d.centroid_mm[1]:.0f}) mm",
                why=f"no pocket: below the tolerance of {d.reason.replace('_', ' ')}",
                bound=f"stands {d.peak_mm:.2f} mm above the reference; limits {wanted.area_tol_mm2 / 100:g} cm² at the "
                f"cut and {wanted.cut_height_mm + wanted.peak_tol_mm:g} mm",
            )
            for d in sorted(dropped, key=lambda d: -d.area_mm2)
        ]
        if self.ply_outline is None:
            entries.append(
                LeftOut(
                    what="free edges and friction",
                    why="the ply's outline is not known",
                    bound="a pocket at the ply's edge is judged as if held there: ridges come out higher, not lower",
                )
            )
        return (*entries, *found.left_out)


class _Cycle:
    """One inspection's clock: when to stop, how long each stage took, whom to tell."""

    def __init__(self, deadline_s: float | None, progress: Progress | None) -> None:
        self.stop = _core.Stop()
        if deadline_s is not None:
            if not deadline_s > 0:
                raise InputError(f"deadline_s: expected a positive number of seconds, but got {deadline_s!r}")
            self.stop.set_deadline(deadline_s)
        self.current = ""
        self._progress = progress
        self._stages: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str, done: float) -> Iterator[None]:
        if self.stop.cancelled:
            raise Cancelled("the inspection was cancelled")
        self.current = name
        self.report(name, done)
        began = time.perf_counter()
        yield
        self._stages[name] = 1e3 * (time.perf_counter() - began)

    def split(self, name: str, parts_ms: dict[str, float]) -> None:
        """Name the parts of a stage; what they leave of its time stays its own."""
        rest = self._stages.pop(name) - sum(parts_ms.values())
        self._stages |= {**parts_ms, name: max(0.0, rest)}

    def report(self, name: str, done: float) -> None:
        if self._progress is not None:
            self._progress(name, done)

    def timings_ms(self) -> dict[str, float]:
        return dict(self._stages)


def _watched(stop: _core.Stop, work: Callable[[], Result]) -> Result:
    """Do the work in another thread, so that Ctrl-C reaches this one while the work is in the core."""
    with ThreadPoolExecutor(1, "debulk") as pool, _stopping(stop):
        return pool.submit(work).result()


@contextmanager
def _stopping(stop: _core.Stop) -> Iterator[None]:
    """Raise the stop when the body ends by what no computation throws: the threads that it waits for end soon then."""
    try:
        yield
    except (InputError, _core.Stopped):
        raise
    except BaseException:
        stop.cancel()
        raise


def _merged(entries: tuple[LeftOut, ...]) -> tuple[LeftOut, ...]:
    """Entries that say the same of several pockets, once."""
    seen: dict[tuple[str, str, str], LeftOut] = {}
    for entry in entries:
        seen.setdefault((entry.what, entry.why, entry.bound), entry)
    return tuple(seen.values())
