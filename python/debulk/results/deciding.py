"""The one ridge by which a pocket is judged, and the order of pockets that follows from it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

from debulk.results.number import span

if TYPE_CHECKING:
    from debulk.results.report import PocketReport


_BRIDGE, _BRIDGE_OF_NET = "bridge", "bridge of the net"


class DecidingRidge(NamedTuple):
    """The ridge that tables, pages, pictures and comparisons show for a pocket."""

    height_mm: float
    """Height, mm: the best estimate, or the upper end of the range if only that is known."""
    range_mm: tuple[float, float]
    """Lowest and highest height that it may have, mm."""
    by: str
    """What gives it: the excess length, the net, a bridge of the net, or an assumption about what is not known."""

    @property
    def is_bridge(self) -> bool:
        """Whether it is no ridge, but the height at which the ply, too short, bridges a hollow."""
        return self.by in (_BRIDGE, _BRIDGE_OF_NET)

    @property
    def most_mm(self) -> float:
        """Upper end of the range."""
        return self.range_mm[1]

    @property
    def spread(self) -> str:
        """The range in words; empty if it is a single figure when rounded."""
        ends = span(self.range_mm)
        return f"({ends})" if " " in ends else ""

    def margin_mm(self, limit_mm: float | None) -> float | None:
        """Return by how much the upper end is below a limit, negative above it; None without a limit."""
        return None if limit_mm is None else limit_mm - self.most_mm


def deciding_ridge(pocket: PocketReport) -> DecidingRidge | None:
    """Return the ridge that may be the highest of all cases under which the pocket was judged; None if none is known.

    A pocket beside a hole, or at the ply's edge, is judged under several assumptions, of which the report's own figures
    are only one. Its row must not show the harmless one of them.
    """
    every = list(_cases(pocket))
    return max(every, key=lambda ridge: (ridge.most_mm, ridge.range_mm[0])) if every else None


def _cases(pocket: PocketReport) -> Iterator[DecidingRidge]:
    yield from _own(pocket)
    if pocket.half_seen is not None:
        for way in pocket.half_seen.ways:
            if way.ridge_range_mm is not None:
                yield DecidingRidge(way.ridge_range_mm[1], way.ridge_range_mm, f"what was not seen {way.holes}")
    if pocket.edge_friction is not None:
        ends = (("its rim slipping", pocket.edge_friction.slipping), ("its rim held", pocket.edge_friction.held))
        for by, end in ends:
            if end.ridge_range_mm is not None:
                yield DecidingRidge(end.ridge_range_mm[1], end.ridge_range_mm, by)


def _own(pocket: PocketReport) -> Iterator[DecidingRidge]:
    """Yield the ridge of the criterion that decided; where none did, that of the net and the most of the excess."""
    net_mm, known = pocket.ridge_height_mm, pocket.excess
    if known is not None and (pocket.decided_by != "paper" or net_mm is None):
        height = known.height_mm if pocket.decided_by else known.range_mm[1]
        yield _or_bridge(pocket, height, known.range_mm, "excess length")
    if net_mm is not None and (pocket.decided_by != "excess" or known is None):
        yield _or_bridge(pocket, net_mm, pocket.ridge_range_mm or (net_mm, net_mm), "net")


def _or_bridge(pocket: PocketReport, height: float, span: tuple[float, float], by: str) -> DecidingRidge:
    """Return a ridge, or the bridge that counts if that may be higher than the ridge."""
    section, net_mm = pocket.bridge_section, pocket.bridge_height_mm or 0.0
    if section is not None and section.range_mm[1] > span[1]:
        return DecidingRidge(section.height_mm, section.range_mm, _BRIDGE)
    if section is None and pocket.decided_by == "paper" and net_mm > span[1]:
        return DecidingRidge(net_mm, (net_mm, net_mm), _BRIDGE_OF_NET)
    return DecidingRidge(height, span, by)


def worst_first(pockets: Iterable[PocketReport]) -> list[PocketReport]:
    """Sort pockets by verdict, the most severe first, and those with the same verdict by ridge, the highest first."""

    def place(pocket: PocketReport) -> tuple[int, float, int]:
        ridge = pocket.deciding_ridge
        return -pocket.verdict.severity, -(ridge.height_mm if ridge else 0.0), pocket.id

    return sorted(pockets, key=place)
