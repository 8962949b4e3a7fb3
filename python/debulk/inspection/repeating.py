"""Repeating an inspection from its report: clouds with the same fingerprint give the same figures to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from debulk._core import InputError
from debulk.arguments import typed
from debulk.inspection.clouds import fingerprint
from debulk.inspection.clouds.far_place import FarPlace
from debulk.inspection.inspector import Inspector, Progress
from debulk.inspection.ply import inputs
from debulk.recipe import Recipe
from debulk.report import Report
from debulk.results.report import MAPS
from debulk.results.trace import ArrayTrace

if TYPE_CHECKING:
    from debulk.chain.record import Chain

# Entries that differ between two runs on the same data: times, and where and when they ran.
_OF_A_RUN = {"timings_ms", "runtime_ms", "runtime_split_ms", "trace", "source", "version", "recipe"}


@dataclass(frozen=True, eq=False)
class Repetition:
    """The result of an inspection that was repeated."""

    report: Report
    """The new report."""
    differences: tuple[str, ...]
    """Names of the values that are not the same to the last bit, like ``"pockets[2].rms_mm"``; times are not
    compared, nor are maps that the report was kept without, as in a history."""
    unchecked: tuple[str, ...] = ()
    """Which of scan, reference and mask could be compared by their shape only, because the record has no
    fingerprint of them."""

    @property
    def same(self) -> bool:
        """Whether verdict, reasons and all figures are the same to the last bit."""
        return not self.differences


@typed
def repeat(
    report: Report,
    scan: ArrayLike,
    reference: ArrayLike,
    mask: ArrayLike | None = None,
    progress: Progress | None = None,
    *,
    chain: Chain | None = None,
    approved: str | PathLike[str] | None = None,
) -> Repetition:
    """Repeat an inspection with the recipe, the pose and everything else that its report has kept.

    Parameters
    ----------
    report
        A report from memory or from `Report.load`.
    scan, reference
        The clouds of that inspection, mm. They are refused if their fingerprint is not the one in the record.
    mask
        (H, W) bool, if that inspection had one.
    progress
        As in `Inspector.inspect`.
    chain
        The qualified chain, if that inspection had one. It is refused if its SHA-256 is not the one in the report.
    approved
        The file of approved recipes, if that inspection had one.

    Returns
    -------
    Repetition
        The new report, and the names of the values that differ. The repetition has no deadline: figures that a deadline
        cut off the first time differ.

    Raises
    ------
    InputError
        The report has no record, or a cloud or the mask is not the one of that inspection.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> report = debulk.inspect(layup.scan, layup.reference, mold_from_scanner=layup.mold_from_scanner)
    >>> repeat(report, layup.scan, layup.reference).same
    True
    """
    trace = report.trace
    if trace is None:
        raise InputError("report: expected one with the record of its inspection (trace), but it has none")
    _check_chain(chain, report)
    hidden = inputs.image_mask(mask)
    place = FarPlace.of(reference, trace.mold_from_scanner, trace.camera)
    near_scan, near_reference = place.near(scan, "scan"), place.near(reference, "reference")
    found = {
        "scan": (_of_kind(near_scan, "scan", trace.scan), trace.scan),
        "reference": (_of_kind(near_reference, "reference", trace.reference), trace.reference),
        "mask": (None if hidden is None else fingerprint.of_mask(hidden), trace.mask),
    }
    for name, (given, kept) in found.items():
        _check_same(name, given, kept)
    angles = trace.fibre_angles_deg if trace.fibre_angles_map is None else trace.fibre_angles_map
    if angles is None:
        raise InputError("report: its record (trace) has no fibre angles; was the file edited?")
    inspector = Inspector(
        Recipe(**report.recipe),
        reference,
        report.ply_outline_mm,
        angles,
        trace.mold_from_scanner,
        None if trace.camera is None else (trace.camera[0], trace.camera[1], trace.camera[2]),
        hidden,
        nominal_angles_deg=trace.nominal_angles_map,
        chain=chain,
        approved=approved,
    )
    again = inspector.inspect(scan, progress=progress, context=trace.context)
    if report.later is None and any(one.unsolved for one in report.pockets):  # a record of what decided, as a history's
        again = again.as_decided()
    unchecked = (name for name, (given, kept) in found.items() if given and (kept is None or not kept.fingerprint))
    before, after = report.to_dict(), dict(again.to_dict())
    after.update({name: None for name in MAPS if before[name] is None})
    return Repetition(again, tuple(_differences(before, after)), tuple(unchecked))


def _check_chain(chain: Chain | None, report: Report) -> None:
    given = None if chain is None else chain.sha256
    if report.chain is not None and given != report.chain.sha256:
        got = f"{given[:16]}..." if given else "none"
        raise InputError(
            f"chain: expected that of the inspection, SHA-256 {report.chain.sha256[:16]}..., but got {got}"
        )


def _check_same(name: str, given: ArrayTrace | None, kept: ArrayTrace | None) -> None:
    if name == "mask" and (given is None) != (kept is None):
        had, got = ("one", "none") if kept else ("none", "one")
        raise InputError(f"mask: expected {had}, as the inspection had, but got {got}")
    if given is None or kept is None:
        return
    if given.shape != kept.shape:
        raise InputError(f"{name}: expected the shape of the inspection's, {kept.shape}, but got {given.shape}")
    if kept.fingerprint and given.fingerprint != kept.fingerprint:
        (kind, wanted), (_, got) = kept.fingerprint, given.fingerprint or ("", "none")
        raise InputError(
            f"{name}: expected the inspection's, {kind} {wanted[:16]}..., but got {got[:16]}...: "
            "another file, or another unit"
        )


def _of_kind(points: Any, name: str, kept: ArrayTrace | None) -> ArrayTrace:
    """Return a cloud's fingerprint of the kind that a report has."""
    return fingerprint.of_cloud(points, name=name, kind=(kept and kept.kind) or "sha256")


def _differences(first: Any, again: Any, name: str = "") -> Iterator[str]:
    """Yield the name of every value that differs in two trees of JSON types, in which NaN and infinity are text."""
    if isinstance(first, dict) and isinstance(again, dict):
        for key in first | again:
            if key not in _OF_A_RUN:
                yield from _differences(first.get(key), again.get(key), f"{name}.{key}" if name else key)
    elif isinstance(first, list) and isinstance(again, list) and len(first) == len(again) and name == "pockets":
        for k, pair in enumerate(zip(first, again, strict=True)):
            yield from _differences(*pair, f"{name}[{k}]")
    elif repr(first) != repr(again):  # repr distinguishes 0.0 from -0.0, and one double from the next
        yield name
