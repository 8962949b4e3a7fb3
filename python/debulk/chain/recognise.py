"""Whether a scan comes from the chain that was qualified."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from debulk.arrays import Cloud
from debulk.chain.figures import FIGURES, Quantity
from debulk.chain.signature import Signature, signature_of
from debulk.chain.windows import windows_of
from debulk.inspection.checks.seen import Recognised
from debulk.results.chain import ChainFigure, ChainReport
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.chain.record import Chain
    from debulk.inspection.evidence.cloud_image import CloudImage
    from debulk.inspection.evidence.sample import Sample
    from debulk.inspection.rawscan.filled import FilledSearch

_NEEDED = ("pitch_mm", "noise_mm", "near")  # without these, a scan's chain is not known


class Recogniser:
    """Compares scan after scan of an inspector with the chain that was qualified.

    The inspector's search for filled and smoothed parts knows where ply and edge are.
    """

    def __init__(self, search: FilledSearch, chain: Chain) -> None:
        self._search, self._chain = search, chain

    def look(self, scan: Cloud, sample: Sample, image: CloudImage | None) -> Recognised:
        """Compare a scan, (H, W, 3) or (N, 3), scanner's frame, before any filter, with a sample and an image of it.

        Of a list that was laid out the edge's spread would be that of its pixels, which are no scanner's.
        """
        with np.errstate(all="ignore"):  # points far off, which are outliers
            windows = windows_of(scan, self._search.on_ply, sample.pitch_mm)
            seen = image.points if image is not None and scan.ndim == 3 else None
            edge_mm = math.nan if seen is None else self._search.smoothed.edge_mm(seen)
            found = signature_of(windows, sample.pitch_mm, image=scan.ndim == 3, edge_mm=edge_mm)
        return recognised(found, self._chain)


def recognised(signature: Signature, chain: Chain) -> Recognised:
    """Compare a signature with a chain: a figure outside its limits is INVALID, one that is not known is named."""
    figures, lacking = [], []
    for quantity in FIGURES:
        limits, value = chain.figure(quantity.name), getattr(signature, quantity.name)
        if limits is None:
            continue
        if not math.isfinite(value):
            lacking.append(quantity)
            continue
        low, high = limits.low, limits.high
        below, above = low is not None and value < low, high is not None and value > high
        differs = quantity.below if below else quantity.above if above else ""
        figures.append(
            ChainFigure(
                name=quantity.name,
                says=quantity.says,
                unit=quantity.unit,
                measured=value,
                low=low,
                high=high,
                differs=differs,
            )
        )
    report = ChainReport(name=chain.name, made_utc=chain.made_utc, sha256=chain.sha256, figures=tuple(figures))
    return Recognised(report, tuple(_findings(report, lacking)), tuple(_left_out(lacking)))


def _findings(report: ChainReport, lacking: list[Quantity]) -> list[Finding]:
    different = [one for one in report.figures if one.differs]
    if different:
        how = ", ".join(f"{one.differs} ({one})" for one in different)
        reason = (
            f"the scan does not come from the chain that was qualified ({report.name}, {report.made_utc[:10]}): it is "
            f"{how}; set scanner, filters and export as they were, or qualify the new chain (debulk qualify)"
        )
        first = different[0]
        return [Finding("chain", Verdict.INVALID, reason, first.measured, first.limit, first.unit)]
    needed = [one.says for one in lacking if one.name in _NEEDED]
    if needed:
        reason = (
            f"whether the scan comes from the qualified chain ({report.name}) is not known: too few windows of the ply "
            f"show the {', '.join(needed)}"
        )
        return [Finding("chain", Verdict.UNDECIDED, reason)]
    return []


def _left_out(lacking: list[Quantity]) -> list[LeftOut]:
    return [
        LeftOut(
            what=f"whether the scan's {one.says} is that of its chain",
            why="the scan is no image, or the outline is not given, or too little of the ply was seen",
            bound="none: a change of the scanner's software that shows by this alone is not noticed",
        )
        for one in lacking
        if one.name not in _NEEDED
    ]
