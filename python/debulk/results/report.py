"""The report of an inspection as plain data: what was found, how sure it is, and what was left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.grid import Grid
from debulk.results import codec
from debulk.results.bridge_section import BridgeSection
from debulk.results.edge_friction import EdgeFriction
from debulk.results.half_seen import HalfSeen
from debulk.results.level import Level
from debulk.results.record import (
    Flags,
    Kinds,
    Numbers,
    Pairs,
    PointsXY,
    PointsXYZ,
    Quadruples,
    Record,
    Values,
    Versioned,
)
from debulk.results.ridge import RidgeGeometry
from debulk.results.trace import Trace
from debulk.verdict import Verdict

__all__ = [
    "BridgeSection",
    "ExcessReport",
    "LeftOut",
    "PocketNet",
    "PocketReport",
    "ReportData",
    "RidgeGeometry",
    "SolveReport",
    "UnseenHole",
    "Wrinkle",
]

FORMAT = "debulk report"


def _check_numbers(name: str, values: NDArray[np.int32], lowest: int, count: int) -> None:
    if values.size and not (lowest <= values.min() and values.max() < count):
        raise InputError(f"{name}: expected numbers of nodes below {count}, got {values.min()} to {values.max()}")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PocketNet(Record):
    """The pin-jointed net of a pocket, as laid on the scanned ply.

    Attributes
    ----------
    nodes_mm
        (N, 3), mold frame.
    neighbours
        (N, 4): e, w along the first fibre, n, s along the second; -1 = none.
    kinds
        (N,): 0 inner, 1 fixed boundary, 2 free boundary.
    edges
        (M, 2) numbers of the nodes at the ends of each fibre segment.
    inside
        (N,): within the pocket's outline, the set of the RMS.
    """

    nodes_mm: PointsXYZ
    neighbours: Quadruples
    kinds: Kinds
    edges: Pairs
    inside: Flags

    def __repr__(self) -> str:
        return f"PocketNet({len(self.nodes_mm)} nodes, {len(self.edges)} edges)"

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.nodes_mm)
        for name, lowest in (("neighbours", -1), ("edges", 0)):
            _check_numbers(name, getattr(self, name), lowest, count)
        for name in ("neighbours", "kinds", "inside"):
            if len(getattr(self, name)) != count:
                raise InputError(f"{name}: expected one per node, {count}, got {len(getattr(self, name))}")


@dataclass(frozen=True, kw_only=True)
class SolveReport:
    """How the minimum was found, and its certificate, which is computed apart from the solver.

    Attributes
    ----------
    method, status
        The solver, and how it ended.
    certified
        True if the returned point is a minimum by the certificate's own figures.
    iterations, evaluations, starts
        Work done; starting points tried.
    length_error
        Largest strain of a fibre segment.
    penetration_mm
        Deepest node below the mold.
    kkt_error
        Largest residual force over a node's vacuum load.
    curvature
        Smallest curvature of the energy within the active constraints, in the unit of `kkt_error` over the net's
        spacing; 0 where none is negative, and negative at a saddle. None: not computed.
    energy_gain_mj
        By how much the energy fell from the net as laid, positive when it fell. None: not computed.
    compliant
        True if the fibres had to be given a compliance.
    doubt
        Why it is not certified; empty if it is.
    """

    method: str
    status: str
    certified: bool
    iterations: int
    evaluations: int
    length_error: float
    penetration_mm: float
    kkt_error: float
    curvature: float | None = None
    energy_gain_mj: float | None = None
    compliant: bool = False
    starts: int = 1
    doubt: str = ""


@dataclass(frozen=True, kw_only=True)
class ExcessReport:
    """The ridge that the excess length of a pocket's fibres makes, from the laid net alone (docs/verdicts.md).

    Attributes
    ----------
    length_mm
        Largest excess of a fibre that is held at both ends, extrapolated to a net without spacing, less the noise's.
    at_spacing_mm, at_half_mm
        The same of the net, and of a net at half its spacing, as they were laid.
    noise_bias_mm
        False length that the scan's noise adds, taken off.
    height_mm, range_mm
        Of the ridge by the paper's formula, 0 where none stands; its least and most within the uncertainty.
    elastic_mm
        Of the elastic fold that the same length makes by the section model and the recipe's modulus, where the formula
        says that none stands, too; together they bound what a ply may do.
    noise_mm
        Standard deviation of the height from scan to scan.
    spacing_error_mm
        By how much the extrapolation has changed the height; where the two nets differ by as much as the finer one has,
        that difference.
    uncertainty_mm
        Two of those deviations with the spacing's error, or the recipe's margin, whichever is more.
    missed_mm
        By how much the ridge may be higher for what the filters take away, what lies beyond the foot, and what stands
        between the net's fibres: `range_mm` reaches so much higher than the uncertainty.
    bridge_bound_mm
        No bridge can stand higher than this; 0 where no fibre is too short for its mold.
    verdict
        By this ridge alone.
    """

    length_mm: float
    at_spacing_mm: float
    at_half_mm: float
    noise_bias_mm: float
    height_mm: float
    range_mm: tuple[float, float]
    elastic_mm: float
    noise_mm: float
    spacing_error_mm: float
    uncertainty_mm: float
    bridge_bound_mm: float
    missed_mm: float = 0.0
    verdict: Verdict | None = None


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PocketReport(Record):
    """One pocket. What a pocket that cannot be judged does not have is None.

    Attributes
    ----------
    id
        1 for the largest.
    verdict, reason
        The outcome, and why in one sentence.
    decided_by
        The criterion whose figures the verdict comes from, "excess" or "paper"; empty where none decided.
    paper_verdict
        By RMS, ridges and bridges of the minima, whichever criterion decided; None without a minimum.
    excess
        The ridge by the excess length; None at the ply's edge, where it bounds nothing, and where no closed net could
        be laid at half the spacing.
    outline_mm, foot_outline_mm
        (M, 2) contour at the cut height, and where the ply meets the mold; mold XY, closed from last to first.
    touches_ply_edge
        True if the pocket runs out at the ply's edge.
    area_mm2, peak_mm, volume_mm3
        XY area inside the outline, largest height above the reference, integral of the height inside; of the ply
        smoothed as for the net.
    measured_share
        Share of the area that the scanner saw; the rest was filled.
    promoted
        Why it is judged though it is below a tolerance of the segmentation; empty: it is not below any.
    half_seen
        What borders on it that was not seen, and what becomes of it however the ply lies there; all figures of the net
        and its minimum are those with the holes filled in. None: nothing does.
    edge_friction
        Of a pocket at the ply's edge that closes as it slips there: what becomes of it so, and with its rim held. None
        of any other, and with ``verdict.criterion = "paper"``.
    spacing_mm, node_count
        Of the net.
    rms_mm, rms_range_mm
        RMS of the post-processed gaps inside the outline; its lowest and highest value over all starts, at both ends of
        the friction at the ply's edge.
    ridge_height_mm, ridge_length_mm
        Of the worst ridge.
    excess_length_mm
        Largest excess over the mold of a fibre of the laid net that is held at both ends; 0 where none has any. What
        slips in at the ply's edge is not in it.
    ridge_range_mm
        Lowest and highest ridge height over the same.
    ridges
        Where ridges run and how they look, the decisive one first; empty where none stands, or where a minimum would be
        needed and is none. Where `excess` is known it is one ridge, that of the excess, whatever the net at the minimum
        shows; else they are the net's, with its rim held where that decides.
    ridge_nodes
        (M,) nodes of the section across the worst ridge, from one foot to the other; None without a ridge.
    bridge_height_mm
        Largest height at which the ply, too short to reach the mold, bridges a hollow.
    bridge_section
        Of a pocket that nothing but such a bridge would make CREASE: how high it stands by sections of its fibres. None
        of any other, where ply outline or mold are not known, and with ``verdict.criterion = "paper"``.
    drawn_in_mm, drawn_in_tension_n_per_mm, drawn_in_hold_n_per_mm
        Largest height of a bridge of the model that is not counted, since the ply is drawn in there: the pull of its
        fibre, and what the friction between it and the ply's edge can hold. None without one.
    net
        The net before debulking.
    initial_gap_mm
        (N,) height of the net's nodes above the mold before debulking.
    debulked_mm, debulked_gap_mm
        (N, 3) nodes at the minimum, (N,) their heights above the mold.
    post_processed_gap_mm
        (N,) gaps with the coarse net's ridges replaced by the real ply's.
    energy_mj, energy_terms_mj
        At the minimum; bending, shear, friction, gravity, vacuum.
    solve
        The solver's course and the certificate.
    runtime_ms, runtime_split_ms
        Time spent on this pocket, and its parts.
    """

    id: int
    verdict: Verdict
    reason: str
    decided_by: str = ""
    paper_verdict: Verdict | None = None
    excess: ExcessReport | None = None
    outline_mm: PointsXY
    foot_outline_mm: PointsXY | None = None
    touches_ply_edge: bool = False
    area_mm2: float
    peak_mm: float
    volume_mm3: float
    measured_share: float = 1.0
    promoted: str = ""
    half_seen: HalfSeen | None = None
    edge_friction: EdgeFriction | None = None
    spacing_mm: float | None = None
    node_count: int | None = None
    rms_mm: float | None = None
    rms_range_mm: tuple[float, float] | None = None
    ridge_height_mm: float | None = None
    ridge_length_mm: float | None = None
    ridge_range_mm: tuple[float, float] | None = None
    ridges: tuple[RidgeGeometry, ...] = ()
    ridge_nodes: Numbers | None = None
    bridge_height_mm: float | None = None
    bridge_section: BridgeSection | None = None
    drawn_in_mm: float | None = None
    drawn_in_tension_n_per_mm: float | None = None
    drawn_in_hold_n_per_mm: float | None = None
    excess_length_mm: float | None = None
    net: PocketNet | None = None
    initial_gap_mm: Values | None = None
    debulked_mm: PointsXYZ | None = None
    debulked_gap_mm: Values | None = None
    post_processed_gap_mm: Values | None = None
    energy_mj: float | None = None
    energy_terms_mj: dict[str, float] | None = None
    solve: SolveReport | None = None
    runtime_ms: float = 0.0
    runtime_split_ms: dict[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"PocketReport({self.id}, {self.verdict.name}: {self.reason})"

    def _repr_html_(self) -> str:
        from debulk.results.notebook import pocket_html

        return pocket_html(self)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.net is not None:
            for name in ("initial_gap_mm", "debulked_mm", "debulked_gap_mm", "post_processed_gap_mm"):
                values = getattr(self, name)
                if values is not None and len(values) != len(self.net.nodes_mm):
                    raise InputError(f"{name}: expected one per node, {len(self.net.nodes_mm)}, got {len(values)}")
            if self.ridge_nodes is not None:
                _check_numbers("ridge_nodes", self.ridge_nodes, 0, len(self.net.nodes_mm))

    @property
    def elastic_mm(self) -> float | None:
        """Height of the elastic fold, also where the formula says that no ridge stands; None: not known."""
        if self.excess is not None:
            return self.excess.elastic_mm
        return self.ridges[0].elastic_mm if self.ridges else None

    @property
    def centroid_mm(self) -> tuple[float, float] | None:
        """Mold XY of the middle of the outline's area; None without an outline that has an area."""
        if not len(self.outline_mm):
            return None
        middle = self.outline_mm.mean(axis=0)
        x, y = (self.outline_mm - middle).T
        twice = x * np.roll(y, -1) - np.roll(x, -1) * y
        area = 0.5 * float(twice.sum())
        if area == 0.0:
            return None
        cx, cy = (float(np.sum((c + np.roll(c, -1)) * twice)) / (6 * area) for c in (x, y))
        return float(middle[0]) + cx, float(middle[1]) + cy


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """Something that the inspection did not take into account: what, why, and a bound on what it could change.

    `place_mm` is the mold XY of a bump that is no pocket.
    """

    what: str
    why: str
    bound: str = ""
    place_mm: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class UnseenHole:
    """A part of the ply above the tolerance on area that was not seen.

    Attributes
    ----------
    centre_mm, extent_mm
        Of its area, mold XY; its widths along x and y.
    area_mm2
        XY area.
    thickness_mm
        Twice the greatest distance of a point in it from what was seen of the ply.
    rim_height_mm
        How high the ply stands above the reference beside it, over 6 to 16 mm of its rim.
    of
        What is missing there: ``"scan"`` or ``"reference"``; ``"mask"`` where the mask hides it.
    at_ply_edge
        It reaches the ply's edge.
    at_best
        The best that the layup's verdict can be because of it; None: it leaves the verdict as it is.
    """

    centre_mm: tuple[float, float]
    extent_mm: tuple[float, float]
    area_mm2: float
    thickness_mm: float
    rim_height_mm: float
    of: str
    at_ply_edge: bool = False
    at_best: Verdict | None = None


@dataclass(frozen=True, kw_only=True)
class Wrinkle:
    """A narrow fold that stood in the ply when it was scanned, which the filters of the height map take for noise.

    Attributes
    ----------
    start_mm, end_mm
        Mold XY of its first and its last point that was looked at; between them it is this long at least.
    length_mm, height_mm, width_mm
        Along it; above the reference; at half its height.
    excess_length_mm, ridge_height_mm
        Of the ply across it, if its sides are straight; the height that remains of it on the mold at least.
    """

    start_mm: tuple[float, float]
    end_mm: tuple[float, float]
    length_mm: float
    height_mm: float
    width_mm: float
    excess_length_mm: float
    ridge_height_mm: float


@dataclass(frozen=True, eq=False, kw_only=True)
class ReportData(Versioned):
    """The outcome of one inspection.

    Attributes
    ----------
    verdict, reason
        Of the layup: the worst pocket's, and why in one sentence.
    pockets
        Largest first; after them, largest first too, the bumps below the tolerances that could crease.
    timings_ms
        Stage by stage, in order.
    left_out
        What the verdict does not take into account.
    coverage
        Share of the ply (outline unknown: of the reference) that scan and reference show, measured or filled in by the
        rule for small holes; None: it was not looked at.
    unseen
        The other parts of it, above the tolerance on area; largest first.
    wrinkles
        Narrow folds that stand in the ply already, longest first.
    level
        How the ply lies between the pockets; None where there is too little of it to tell.
    height_map
        Height of the ply above the reference, mm, NaN = nothing seen, or off the ply. For a picture: coarse where no
        pocket was looked for.
    ply_outline_mm
        (M, 2), mold XY; None = unknown.
    recipe
        The settings, section by section; ``debulk.Recipe(**report.recipe)`` gives them back.
    source
        What was inspected: names of files, seed of a virtual layup, and the like.
    warnings
        What the reader should know before trusting the rest.
    trace
        Time, fingerprints, pose and all else that the inspection was made of; None: not of a real inspection.
    version
        Of debulk.
    """

    verdict: Verdict
    reason: str
    pockets: tuple[PocketReport, ...]
    timings_ms: dict[str, float] = field(default_factory=dict)
    left_out: tuple[LeftOut, ...] = ()
    coverage: float | None = None
    unseen: tuple[UnseenHole, ...] = ()
    wrinkles: tuple[Wrinkle, ...] = ()
    level: Level | None = None
    height_map: Grid | None = None
    ply_outline_mm: PointsXY | None = None
    recipe: dict[str, Any] = field(default_factory=dict)
    source: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    trace: Trace | None = None
    version: str = ""

    @property
    def passed(self) -> bool:
        """True only for CEASE."""
        return self.verdict is Verdict.CEASE

    @property
    def creasing(self) -> tuple[PocketReport, ...]:
        """The pockets that crease, in the report's order."""
        return tuple(pocket for pocket in self.pockets if pocket.verdict is Verdict.CREASE)

    def pocket(self, number: int) -> PocketReport:
        """Return the pocket of this number, as on the page and in the table.

        Raises
        ------
        InputError
            If there is none.
        """
        for pocket in self.pockets:
            if pocket.id == number:
                return pocket
        numbers = ", ".join(str(pocket.id) for pocket in self.pockets) or "none"
        raise InputError(f"number: expected the number of a pocket of this report ({numbers}), but got {number!r}")

    def to_dict(self) -> Mapping[str, Any]:
        """Return the report as JSON's own types, as `debulk.Report.save` writes it."""
        return codec.encode(self, FORMAT)
