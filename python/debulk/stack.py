"""The plies of one part, each inspected above a scan of the ply before it, after that was debulked and passed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from numpy.typing import ArrayLike

from debulk._core import InputError
from debulk.arguments import typed
from debulk.comparison import Comparison
from debulk.files.replacing import check_ending, write_text
from debulk.grid import Grid
from debulk.inspection.inspector import Inspector, Progress
from debulk.inspection.ply import inputs
from debulk.inspection.ply.fibre_angles import Angles, checked_angles
from debulk.inspection.reference.prepared import Cleaned
from debulk.inspection.running.ahead import Ahead
from debulk.inspection.running.cycle import Cycle
from debulk.report import Report

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Stack", "StackPly"]


@dataclass(frozen=True)
class StackPly:
    """One ply of a stack."""

    number: int
    """From 1."""
    report: Report | None = None
    """The last inspection of it before debulking; None: it was not inspected yet."""
    comparison: Comparison | None = None
    """The last comparison after debulking; None: there was none yet."""

    @property
    def passed(self) -> bool:
        """Whether it was compared after debulking, all pockets are measured to have ceased, and no ridge stands."""
        return not self.open_reason

    @property
    def open_reason(self) -> str:
        """Why no other ply may be laid on it; empty: one may."""
        if self.report is None:
            return f"ply {self.number} was not inspected"
        if self.comparison is None:
            return f"ply {self.number} was not scanned after debulking"
        named = ", ".join(self.comparison.not_passed)
        return f"ply {self.number} did not pass after debulking: {named}" if named else ""


class Stack:
    """Keeps the plies of one part in order: each one's reference is the scan of the one before, after it was debulked.

    A ply's heights are measured from its reference. If the reference shows the ply before in another state, pockets of
    that ply stay unseen; so the next ply is prepared only after the one before was compared and passed.

    All methods are called from one thread, except `cancel`. As a context manager a stack cancels what runs at the end.

    Parameters
    ----------
    recipe
        All settings. None means ``Recipe()``.
    mold
        The reference of the first ply, as for an `Inspector`.
    part
        The part's name, which goes into the reports' context.
    options
        What all plies share: ``mold_from_scanner``, ``camera``, ``mask``, ``history``, ``chain``; as for an
        `Inspector`.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> stack = Stack(None, layup.reference, part="A-17", mold_from_scanner=layup.mold_from_scanner)
    >>> inspector = stack.lay(layup.ply_outline)
    >>> stack.inspect(layup.scan).verdict
    <Verdict.CREASE: 'crease'>
    >>> stack.lay(layup.ply_outline)
    Traceback (most recent call last):
    ...
    debulk._core.InputError: the next ply cannot be laid: ply 1 was not scanned after debulking
    """

    @typed
    def __init__(self, recipe: Recipe | None, mold: ArrayLike, *, part: str = "", **options: Any) -> None:
        self.recipe, self.part = recipe, part
        self.plies: list[StackPly] = []
        self._below: ArrayLike | Cleaned = mold
        self._options = options
        self._inspector: Inspector | None = None
        self._ahead: Ahead[Inspector] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.cancel()

    def __repr__(self) -> str:
        name = f"of {self.part}, " if self.part else ""
        return f"Stack({name}{len(self.plies)} plies)"

    def lay(
        self,
        ply_outline: ArrayLike | None = None,
        fibre_angles_deg: Angles = (0.0, 90.0),
        progress: Progress | None = None,
        *,
        nominal_angles_deg: Angles | None = None,
    ) -> Inspector:
        """Prepare the inspection of the next ply above the ply before, and return its inspector.

        Raises
        ------
        InputError
            If the ply before was not inspected, not scanned after debulking, or did not pass; or an argument is wrong.
        """
        self._refuse_next()
        return self._laid(self._made(ply_outline, fibre_angles_deg, nominal_angles_deg, progress))

    @typed
    def lay_ahead(
        self,
        ply_outline: ArrayLike | None = None,
        fibre_angles_deg: Angles = (0.0, 90.0),
        *,
        nominal_angles_deg: Angles | None = None,
    ) -> None:
        """Do what `lay` does while the ply is draped: begin the preparation in a thread of its own, and return at once.

        The next `inspect` is of this ply, and waits for what is left of the preparation. The inspector is the same to
        the last bit. What the preparation raises is raised there, by every `inspect` until the ply is laid again, so
        that none meets the ply before. The first ply's ``mold`` must not change until the inspector is there. Neither
        the calling thread's end nor the interpreter's waits for the preparation.

        Raises
        ------
        InputError
            As for `lay`, but not what is wrong with the cloud below.
        """
        self._refuse_next()
        outline, angles = inputs.outline(ply_outline), checked_angles(fibre_angles_deg)  # copies, which nobody changes
        nominal = None if nominal_angles_deg is None else checked_angles(nominal_angles_deg, "nominal_angles_deg")
        self._ahead = Ahead(lambda progress: self._made(outline, angles, nominal, progress))

    def cancel(self) -> None:
        """End the preparation of the ply that was laid ahead, or else the inspection; no thread is left.

        May be called from any thread. `inspect` raises `Cancelled` then, after `lay_ahead` until a ply is laid again.
        """
        if self._ahead is not None:
            self._ahead.cancel()
        elif self._inspector is not None:
            self._inspector.cancel()

    def _refuse_next(self) -> None:
        if why := self._ahead_reason() or (self.plies[-1].open_reason if self.plies else ""):
            raise InputError(f"the next ply cannot be laid: {why}")

    def _ahead_reason(self) -> str:
        laid = self._ahead is not None and not self._ahead.failed
        return f"ply {len(self.plies) + 1} was laid ahead, and not inspected yet" if laid else ""

    def _made(self, outline: Any, angles: Any, nominal: Any, progress: Progress | None) -> Inspector:
        given = {"nominal_angles_deg": nominal, "progress": progress, **self._options}
        return Inspector(self.recipe, self._below, outline, angles, **given)

    def _laid(self, inspector: Inspector) -> Inspector:
        self._inspector, self._ahead = inspector, None
        self.plies.append(StackPly(len(self.plies) + 1))
        return inspector

    def inspect(
        self,
        scan: ArrayLike,
        deadline_s: float | None = None,
        progress: Progress | None = None,
        context: Mapping[str, Any] | None = None,
        *,
        fibre_angles_deg: Grid | None = None,
    ) -> Report:
        """Inspect a scan of the ply that was laid last, as `Inspector.inspect`; it may be scanned again and again.

        The report's context gets the part, the number of the ply, and what its reference is.

        After `lay_ahead` it waits for the inspector. The deadline counts from the call on, so this time is part of it;
        meanwhile ``progress`` is called with the step of the preparation and a share of 0.

        Raises
        ------
        TimeoutError
            If the deadline passes before the inspector of a ply that was laid ahead is there. Its preparation goes on.
        """
        if (ahead := self._ahead) is not None:
            began = time.monotonic()
            self._laid(ahead.result(Cycle(deadline_s, progress)))
            if deadline_s is not None:
                deadline_s = max(deadline_s - (time.monotonic() - began), 1e-3)
        ply = self._last()
        assert self._inspector is not None
        before = "the bare mold" if ply.number == 1 else f"ply {ply.number - 1} after debulking, which passed"
        own = {"part": self.part} if self.part else {}
        kept = {**own, "ply": ply.number, "reference": before, **(context or {})}
        report = self._inspector.inspect(scan, deadline_s, progress, kept, fibre_angles_deg=fibre_angles_deg)
        self.plies[-1] = StackPly(ply.number, report)  # a comparison of another state of the ply says nothing of this
        return report

    def debulked(self, scan: ArrayLike) -> Comparison:
        """Compare the last report with a scan after debulking; if the ply passes, that is the next ply's reference.

        Raises
        ------
        InputError
            If the ply was not inspected, or `Inspector.compare` refuses the scan.
        """
        if why := self._ahead_reason():
            raise InputError(f"debulked: {why}")
        ply = self._last()
        if ply.report is None or self._inspector is None:
            raise InputError(f"debulked: expected an inspection of ply {ply.number} first")
        comparison, cleaned = self._inspector.compared(ply.report, scan)
        self.plies[-1] = done = StackPly(ply.number, ply.report, comparison)
        if done.passed:
            self._below = cleaned
        return comparison

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the page of the stack, .html: the worst plies first, then ply by ply, and what became of each.

        Raises
        ------
        InputError
            If the name ends otherwise, no ply was inspected, or the file cannot be written.
        """
        from debulk.page.stack import Layup, page

        path = Path(path)
        check_ending(path, ".html")
        layups = [
            Layup(ply.report, f"ply {ply.number}", comparison=ply.comparison)
            for ply in self.plies
            if ply.report is not None
        ]
        if not layups:
            raise InputError("no ply of this stack was inspected yet")
        write_text(path, page(layups))

    def _last(self) -> StackPly:
        if not self.plies:
            raise InputError("expected a ply to be laid first: Stack.lay()")
        return self.plies[-1]
