"""The inspection: from a scan to a verdict, step by step."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, rings
from debulk._core import InputError
from debulk.arguments import of_type, typed
from debulk.comparison import Comparison
from debulk.files.replacing import check_ending
from debulk.forking import Guard
from debulk.grid import Grid
from debulk.history.kept import history_of
from debulk.inspection import inspector_file, reporting
from debulk.inspection.checks.seen import Recognised, Seen
from debulk.inspection.clouds import fingerprint
from debulk.inspection.clouds.cleaning import as_points, hide, owned
from debulk.inspection.clouds.thinning import thinned
from debulk.inspection.comparing import check_place, compared, measured, of_another_scan, pressed
from debulk.inspection.evaluate.all_pockets import audit, evaluate_all, not_judged
from debulk.inspection.evidence.cloud_image import CloudImage
from debulk.inspection.evidence.ply_image import ply_image
from debulk.inspection.evidence.sample import Sample
from debulk.inspection.find.found import Found, FoundPocket
from debulk.inspection.find.whole_scan import WholeScanFinder
from debulk.inspection.lines import places
from debulk.inspection.place import mold_edge
from debulk.inspection.place.placing import Placed, Placing
from debulk.inspection.ply import inputs
from debulk.inspection.ply.angle_field import nominal_on
from debulk.inspection.ply.fibre_angles import Angles, checked_angles, laid
from debulk.inspection.ply.humps import Hump, humps_of, named
from debulk.inspection.ply.ply_on_mold import PlyOnMold, Setup
from debulk.inspection.rawscan.filled import Filled, FilledSearch
from debulk.inspection.rawscan.lost_places import lost
from debulk.inspection.rawscan.narrow import NarrowSearch, Standing
from debulk.inspection.reference.prepared import Cleaned, Prepared, cleaned, prepare
from debulk.inspection.reference.resolution import is_coarser
from debulk.inspection.running.cycle import Cancelled, Cycle, Progress, in_parallel, watched
from debulk.inspection.running.effort import check_solves
from debulk.inspection.tracing import Given, checked_context, tracing
from debulk.recipe import Recipe
from debulk.report import Report
from debulk.results.approval import approvals
from debulk.results.trace import Trace, now_utc
from debulk.stopping import Running

if TYPE_CHECKING:
    from debulk.chain.record import Chain
    from debulk.history import History

__all__ = ["Cancelled", "Inspector", "Progress"]

log = logging.getLogger("debulk")
log.addHandler(logging.NullHandler())
_Raw = tuple[CloudImage | None, Filled, Standing, Recognised | None]
_FOUND = 0.45  # share of the work that is done once the pockets are found, as reported to the progress function


@dataclass(frozen=True, eq=False)
class _Lying:
    """A ply as its fibre angles say that it lies, and what else depends on them."""

    ply: PlyOnMold
    humps: tuple[Hump, ...]
    trace: Callable[..., Trace]
    """Makes the record of one inspection of it."""


class Inspector:
    """Inspects scans of one ply against the reference below it; it is prepared once and used cycle after cycle.

    Parameters
    ----------
    recipe
        All settings. None means ``Recipe()``.
    reference
        (H, W, 3) organised or (N, 3) cloud of the surface below the ply, mm, NaN = nothing seen, in any form that
        `debulk.cloud.from_memory` takes. In a layup of several plies this is the scan taken after the previous ply. If
        it lies farther than 32.8 m from the origin of the scanner's frame, whole metres are subtracted from it and from
        every scan before they are rounded to float32; the pose adds them again, and the reports say so.
    ply_outline
        (M, 2) outline of the ply, mold XY, mm, closed from last to first. Of a ply with cut-outs a list of such arrays,
        the outside first, or one array with these rings one after another, each of which ends with its first corner
        again. None means that it is unknown; then no edge of a pocket is free, and the report says so.
    fibre_angles_deg
        The two fibre directions, degrees counter-clockwise from mold +x, projected along z: two numbers, a
        `debulk.Grid` with values (ny, nx, 2), NaN where nothing is known, or a `debulk.net.Drape`, which is read on a
        grid of its own spacing. With a `debulk.net.Draping` the ply is draped over the reference from that seed.
        A pocket takes the angles of the grid point nearest to its centre; it is INVALID where they are not known.
    mold_from_scanner
        (4, 4) rigid motion from the scanner's frame, in which scan and reference are given, to the mold's frame:
        x_mold = T x. None means that they are in the mold's frame already. An image of a scanner is refused without a
        pose: give ``np.eye(4)`` if its points are in the mold's frame.
    camera
        (f, cx, cy) in pixels, of an organised cloud in the scanner's frame. None means that it is fitted to the
        reference. With a camera the height map is computed by the fast method. Without one (a fit residual above
        0.1 px, an unorganised cloud, a scan of another shape than the reference) it is computed by the general
        method, with the same decisions.
    mask
        (H, W) bool, True where the image shows a clamp or a tool: these points of an organised scan are not used.
    progress
        Called with the name of the stage and the share of the work that is done, from the calling thread, some twenty
        times a second. To cancel the preparation, raise an exception in this function, for example `Cancelled`: all
        threads of the preparation are then ended, and the exception is passed on.
    history
        A `debulk.history.History`, or the name of its file: every report and comparison is stored in it before it is
        returned. One that cannot be stored is returned all the same, with a warning. None means no history.
    approved
        File of approved recipes (`debulk approve` writes it): with any other recipe no layup is CEASE, and the report
        says so. None means that no approval is asked for.
    chain
        The chain of scanner, filters and export that was qualified (`debulk.qualify`). Every scan's signature is
        compared with it: a scan that is smoother, coarser, noisier, rounded or filled otherwise is INVALID. None: the
        reports say under ``left_out`` that the chain is not known.

    Raises
    ------
    InputError
        Names what was wrong, what was expected and what was given.

    Notes
    -----
    All arrays are copied: what their owner does to them later changes neither the inspector nor its reports. A
    reference that owns its memory and is read-only is not, and `inspect` borrows its scan while it runs.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    >>> report = inspector.inspect(layup.scan)
    >>> report.verdict
    <Verdict.CREASE: 'crease'>
    """

    @typed
    def __init__(
        self,
        recipe: Recipe | None,
        reference: ArrayLike | Cleaned | Prepared,
        ply_outline: ArrayLike | None = None,
        fibre_angles_deg: Angles = (0.0, 90.0),
        mold_from_scanner: ArrayLike | None = None,
        camera: tuple[float, float, float] | None = None,
        mask: ArrayLike | None = None,
        progress: Progress | None = None,
        history: History | str | PathLike[str] | None = None,
        *,
        nominal_angles_deg: Angles | None = None,
        chain: Chain | None = None,
        approved: str | PathLike[str] | None = None,
    ) -> None:
        self.recipe = recipe = recipe or Recipe()
        self.ply_outline = inputs.outline(ply_outline)
        angles = checked_angles(fibre_angles_deg)
        nominal = None if nominal_angles_deg is None else checked_angles(nominal_angles_deg, "nominal_angles_deg")
        self.mold_from_scanner = inputs.pose(mold_from_scanner)
        self.camera = inputs.camera_parameters(camera)
        self.mask = inputs.image_mask(mask)
        self.history = history_of(history)
        self._approved = None if approved is None else approvals(approved)

        inputs.check_sheet(recipe)
        check_solves(recipe)
        preparation = Cycle(progress=progress)
        if not isinstance(reference, Prepared):
            placed = self.mold_from_scanner, self.camera, self.mask, self.ply_outline
            reference = prepare(reference, *placed, recipe, preparation)
        self.prepared = reference = replace(reference, thickness_mm=recipe.material.thickness_mm)
        self.grid_spacing_mm = reference.grid_spacing_mm
        self.reference = reference.reference
        self.fibre_angles_deg = laid(angles, self.reference, self.ply_outline)
        self.nominal_angles_deg = None
        if nominal is not None:
            nominal = laid(nominal, self.reference, self.ply_outline, "nominal_angles_deg")
            self.nominal_angles_deg = nominal_on(nominal, self.fibre_angles_deg)
        self._given = Given(
            recipe=recipe,
            reference=reference,
            ply_outline=self.ply_outline,
            fibre_angles_deg=self.fibre_angles_deg,
            nominal_angles_deg=self.nominal_angles_deg,
            mold_from_scanner=self.mold_from_scanner,
            camera=self.camera,
            mask=self.mask,
        )
        self.ply = PlyOnMold.of(
            self.reference, self.ply_outline, self.fibre_angles_deg, self.nominal_angles_deg, recipe
        )
        self._below: mold_edge.BelowEdge | None = None
        if self.ply_outline is None:
            reference, self._below = mold_edge.parted(reference, recipe)
        self._pose = reference.place.pose(self.mold_from_scanner)
        self.setup = Setup(reference, self.ply, self._pose, self.mask)
        humps = in_parallel(
            preparation.stop, lambda: humps_of(reference.seen, self.ply, preparation.stop), recipe.run.threads
        )
        with humps as found:  # these steps leave cores idle
            self._placing = preparation.step("checks", 0.9, lambda: Placing(self.setup))
            self._narrow = NarrowSearch(self.setup)
            self._filled = FilledSearch(self.setup, self._placing.zones, self._placing.outline)
            self.chain = chain
            self._recogniser = None if chain is None else chain.recogniser(self._filled)
            preparation.step("fibres", 0.93, self.ply.prepare)
            self._finder = preparation.step("front end", 0.94, lambda: WholeScanFinder(self.setup))
            self._lying = _Lying(self.ply, preparation.step("humps", 0.98, found), tracing(self._given))
        self._finding = Guard()  # the finder reuses its buffers, so it takes one scan at a time
        self._running = Running()

    def __repr__(self) -> str:
        edge = "unknown outline" if self.ply_outline is None else f"outline of {rings.said(self.ply_outline)}"
        return f"Inspector({edge}, heights every {self.grid_spacing_mm:.4g} mm, {self.recipe!r})"

    def __getstate__(self) -> NoReturn:
        raise TypeError(
            "an Inspector cannot be pickled or copied: save() it to a file, and load() that in each process"
        )

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the prepared inspector with its recipe to a .npz of plain arrays; `load` saves a few seconds' work.

        Raises
        ------
        InputError
            If the path does not end in .npz, or the file cannot be written.
        """
        path = Path(path)
        check_ending(path, ".npz")
        inspector_file.write(self._given, path)

    @classmethod
    @typed
    def load(
        cls,
        path: str | PathLike[str],
        recipe: Recipe | None = None,
        history: History | str | PathLike[str] | None = None,
        *,
        chain: Chain | None = None,
        approved: str | PathLike[str] | None = None,
    ) -> Inspector:
        """Read an inspector that `save` wrote; its reports equal those of the saved one, if it gets its chain, too.

        Parameters
        ----------
        path
            The .npz file.
        recipe
            Settings to use instead of the saved ones. Its section ``clean`` must equal the saved one, because the
            reference was cleaned with it.
        history, approved
            As for a new inspector; the file has none.
        chain
            The qualified chain, which the file does not hold: it may have been qualified anew.

        Raises
        ------
        InputError
            If the file is not such a file, or was cut off, or the recipe's section ``clean`` differs.
        """
        path = Path(path)
        given = inspector_file.read(path)
        try:
            given["recipe"] = saved = Recipe(**given["recipe"])
            if recipe is not None and recipe.clean != saved.clean:
                raise InputError(f"recipe: expected the section clean of the saved one, {saved.clean}")
            more = {"recipe": recipe or saved, "history": history, "chain": chain, "approved": approved}
            return cls(**{**given, **more})
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @typed
    def inspect(
        self,
        scan: ArrayLike,
        deadline_s: float | None = None,
        progress: Progress | None = None,
        context: Mapping[str, Any] | None = None,
        *,
        fibre_angles_deg: Grid | None = None,
    ) -> Report:
        """Inspect one scan.

        Parameters
        ----------
        scan
            (H, W, 3) organised or (N, 3) cloud, float32 or float64, mm, in the reference's frame, NaN = nothing seen,
            in any form that `debulk.cloud.from_memory` takes. It is borrowed: a C-contiguous float32 array is read in
            place, so do not change it until the call returns. If a scanner writes the next scan into it meanwhile,
            nothing crashes and nothing outside it is read, but the report describes a mixture of both scans.
        deadline_s
            Seconds from now; None means no deadline. When it passes, all stages end early, and what was cut off is
            UNDECIDED: pockets that were not evaluated, and pockets for which not all starts that the rule asks for
            were tried.
        progress
            Called with the name of the stage and the share of the work that is done, from the calling thread.
        context
            Data to keep with the report, such as ``{"part": "A-17", "ply": 3}``: text, numbers, lists, dictionaries.
        fibre_angles_deg
            What a sensor measured on this ply: a `debulk.Grid` with values (ny, nx, 2), degrees, NaN where nothing is
            known. The lines run along it. The inspector's nominal angles, or else its own, are then how the ply was
            meant to lie: they fill its gaps, and a ply that lies turned is INVALID. None: the inspector's own.

        Returns
        -------
        Report
            The verdict, each pocket, the timings, what was left out, and the trace of all inputs. The scan's
            fingerprint in the trace (``run.hash_scan`` of the recipe) is computed in parallel to the inspection. It is
            missing if the deadline passes before it is complete.

        Raises
        ------
        InputError
            Names what was wrong with the scan or the angles.
        Cancelled
            If `cancel` was called meanwhile.
        """
        kept, began = checked_context(context), now_utc()
        cycle = Cycle(deadline_s, progress)
        lying = self._lying if fibre_angles_deg is None else self._measured(fibre_angles_deg)
        with (
            self._running.holding(cycle.stop),
            fingerprint.of_scan(near := self._near(scan, cycle.stop), cycle.stop, self.recipe.run.scan_hash) as scanned,
        ):
            try:
                report = self._inspect(near, lying, cycle)
            except _core.Stopped:
                if cycle.stop.cancelled:
                    raise Cancelled("the inspection was cancelled") from None
                report = reporting.too_late(lying.ply, cycle.current, cycle.timings_ms())
            seconds = None if deadline_s is None else float(deadline_s)
            warnings = (*self.prepared.place.warnings(scan), *report.warnings)
            later = report.later
            trace = lying.trace(time_utc=began, scan=scanned(), context=kept, deadline_s=seconds)
            report = replace(report, trace=trace, warnings=warnings)
        report = report.settled_by(later)
        return report if self.history is None else self.history.keep(report)

    def _measured(self, angles: Grid) -> _Lying:
        """Return the ply as angles say that were measured on it."""
        if not isinstance(angles, Grid) or not isinstance(measured := checked_angles(angles), Grid):
            raise InputError(f"fibre_angles_deg: expected a Grid of what was measured, but got {of_type(angles)}")
        meant = self.fibre_angles_deg if self.nominal_angles_deg is None else self.nominal_angles_deg
        nominal = nominal_on(meant, measured)
        ply = PlyOnMold.of(self.reference, self.ply_outline, measured, nominal, self.recipe)
        given = replace(self._given, fibre_angles_deg=measured, nominal_angles_deg=nominal)
        return _Lying(ply, humps_of(self.prepared.seen, ply), tracing(given))

    def _near(self, scan: Any, stop: _core.Stop) -> Any:
        """Return the scan as an array near the origin; as it came if the stop is raised, which the next step heeds."""
        try:
            return self.prepared.place.near(scan, "scan", stop)
        except _core.Stopped:
            return scan

    def _inspect(self, scan: ArrayLike, lying: _Lying, cycle: Cycle) -> Report:
        """Run the steps of an inspection, one after the other."""
        with cycle.stage("level", 0.0):  # do scan and reference belong together?
            points = as_points(scan, "scan", cycle.stop)
            sample = self._placing.look(points, cycle.stop)
            placed = self._placing.gross(sample)
            if placed is None and self._below is not None and (wrong := self._below.finding(sample)):
                placed = Placed(None, wrong)
        if placed is not None:
            return reporting.out_of_place(placed, sample.overview(), lying.ply, cycle.timings_ms())
        with in_parallel(
            cycle.stop, lambda: self._search_raw(points, sample, cycle.stop), self.recipe.run.threads
        ) as searched:
            return self._judge(points, sample, searched, lying, cycle)

    def _image(self, points: NDArray[np.float32], sample: Sample) -> CloudImage | None:
        return ply_image(points, sample.pitch_mm, self.setup, self._placing.zones.box_mm)

    def _search_raw(self, points: NDArray[np.float32], sample: Sample, stop: _core.Stop) -> _Raw:
        """Look in the raw image for filled-in patches, what filters would hide, and the chain's signature."""
        image = self._image(points, sample)
        filled, standing = self._filled.find(image, stop), self._narrow.find(image, stop)
        recognised = None if self._recogniser is None else self._recogniser.look(points, sample, image)
        return image, filled, standing, recognised

    def _judge(
        self,
        points: NDArray[np.float32],
        sample: Sample,
        searched: Callable[[], _Raw],
        lying: _Lying,
        cycle: Cycle,
    ) -> Report:
        """Run the steps that follow the check of the level."""
        ply = lying.ply
        with cycle.stage("height map", 0.0):  # clean, grid, find
            found = watched(cycle.stop, lambda: self._find(points, cycle.stop))
        cycle.split("height map", found.times_ms)
        heights, threads = found.overview, self.recipe.run.threads
        search = in_parallel(cycle.stop, lambda: self._placing.plateaus(heights, cycle.stop), threads)
        with search as raised, cycle.stage("fibres", _FOUND):  # by how much each is too long for the mold below
            found = watched(cycle.stop, lambda: self._with_runs(found, ply, cycle.stop, sample.widest_mm))
        with in_parallel(cycle.stop, lambda: _places(found, ply, cycle.stop), threads) as others:
            with cycle.stage("place", _FOUND):  # the level between the pockets, and the ply's edge
                placed, plateaus = self._placing.judge(sample, found), raised()
            with cycle.stage("debulk", _FOUND):  # for each pocket: lay the net, settle it, post-process, judge
                pockets, late = found.pockets, False
                if placed.finding:
                    done = not_judged(pockets, "the scan is not in its place")
                else:
                    done = evaluate_all(pockets, ply, cycle, _FOUND)
                    more, late = others()
                    pockets, done = pockets + more, done + evaluate_all(more, ply, cycle, 1.0)
                    if self.recipe.run.audit:
                        done = audit(pockets, done, ply, cycle)
        with cycle.stage("raw scan", 1.0):  # wait for the search that has run in parallel since the stage "level"
            image, filled, standing, recognised = searched()
            judged = reporting.judged_of(pockets, done, ply, standing, late=late)
            if image is not None and placed.edge is not None:
                filled = self._filled.at(placed.edge, filled, image)
        with cycle.stage("report", 1.0):
            largest = None if found.runs is None else found.runs.largest
            known = (recognised, named(lying.humps, largest, self.recipe, heights), self._approved)
            hidden = lost(standing, found, ply)
            seen = Seen(ply, placed, found, plateaus, judged, standing, hidden, filled, *known)
            report = reporting.report(seen, cycle.timings_ms())
        return reporting.unsettled(report, seen)

    def find(self, scan: ArrayLike, stop: _core.Stop | None = None) -> Found:
        """Find the pockets of a scan without evaluating them; these are the first steps of `inspect`.

        Parameters
        ----------
        scan
            As in `inspect`.
        stop
            Ends the search with `Stopped` when it is raised from another thread, or when its deadline passes.

        Returns
        -------
        Found
            The pockets, largest first, how much of the ply is known, and which parts were not examined.

        Raises
        ------
        InputError
            Names what was wrong with the scan.
        """
        found = self._find(self.prepared.place.near(scan, "scan", stop), stop)
        return self._with_runs(found, self.ply, stop or _core.Stop())

    def _with_runs(self, found: Found, ply: PlyOnMold, stop: _core.Stop, pitch_mm: float = 0.0) -> Found:
        """Return what was found, with the runs of the fibre lines over it, in a scan with points so far apart."""
        if found.part is None:
            return replace(found, pitch_mm=pitch_mm)
        runs = ply.fibres.over(*found.part, stop, whole=True, threads=self.recipe.run.threads)
        coarser = is_coarser(pitch_mm, self.grid_spacing_mm)
        beyond_mm = float(np.sqrt(pitch_mm**2 - self.grid_spacing_mm**2)) if coarser else 0.0
        if self.setup.outline is None:
            runs = runs.ending_at_bare(lambda xy: found.overview.at(xy) - self.prepared.bare_mm(xy), self.recipe)
        return replace(found, runs=runs.of_coarser(beyond_mm), pitch_mm=pitch_mm)

    def _find(self, scan: ArrayLike, stop: _core.Stop | None) -> Found:
        """Find the pockets of a scan without the shift of far clouds."""
        with self._finding.held():
            if self._finding.torn:
                self._finder, self._finding.torn = WholeScanFinder(self.setup), False
            found = self._finder.find(scan, stop or _core.Stop())
        return found if self._below is None else replace(found, left_out=(self._below.left_out(),))

    @typed
    def compare(self, report: Report, debulked_scan: ArrayLike) -> Comparison:
        """Compare a report with a scan of the same ply after debulking; see `debulk.compare`.

        Parameters
        ----------
        report
            The report of the inspection before debulking.
        debulked_scan
            The scan after debulking, in the form that `inspect` takes.

        Raises
        ------
        InputError
            Names what was wrong; also raised if the scan shows another ply, or this ply in another place or state, or
            is the scan that the report was made from.
        Cancelled
            If `cancel` was called meanwhile.
        """
        return self.compared(report, debulked_scan)[0]

    def compared(self, report: Report, debulked_scan: ArrayLike) -> tuple[Comparison, Cleaned]:
        """Do what `compare` does, and also return the cleaned cloud: in a stack it is the reference of the next ply."""
        stop, began, place = _core.Stop(), now_utc(), self.prepared.place
        try:
            with self._running.holding(stop):
                points = owned(place.near(debulked_scan, "debulked_scan", stop), "debulked_scan", stop)
                scanned = of_another_scan(report, points, self.recipe.run.scan_hash, stop)
                points = hide(points, self.mask, "debulked_scan", stop)
                setup = pressed(report, self.setup, self.prepared)
                placing = Placing(setup, setup.prepared.thickness_mm)
                sample = placing.look(points, stop)  # samples the copy before it is moved into the mold's frame
                few = thinned(points).points
                points, image = cleaned(points, self._pose, self.camera, self.recipe, stop)
                heights, apart_mm, blur_mm2 = measured(points, sample, setup, stop)
                check_place(report, placing, sample, heights)
        except _core.Stopped:
            raise Cancelled("the comparison was cancelled") from None
        trace = self._lying.trace(time_utc=began, scan=scanned)
        comparison = compared(report.settle(), heights, self.recipe, trace, apart_mm, blur_mm2, self.prepared)
        comparison = comparison if self.history is None else self.history.keep_comparison(comparison, report)
        return comparison, Cleaned(points, image, few, scanned, place.of_another(debulked_scan))

    def cancel(self) -> None:
        """Cancel all running calls, from any thread: they raise `Cancelled` within one iteration of the solver."""
        self._running.cancel()


def _places(found: Found, ply: PlyOnMold, stop: _core.Stop) -> tuple[tuple[FoundPocket, ...], bool]:
    """Return the places that are judged besides the pockets, and whether a deadline cut off the search for them."""
    more: list[FoundPocket] = []
    try:
        more.extend(places.judged(found, found.pockets, ply, stop))
    except _core.Stopped:
        return tuple(more), True
    return tuple(more), False
