"""The report of an inspection as plain data: what was found, how certain it is, and what was left out."""

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
from debulk.results.chain import ChainReport
from debulk.results.deciding import DecidingRidge, deciding_ridge
from debulk.results.edge_friction import EdgeFriction
from debulk.results.finding import Finding
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
from debulk.results.runs import ExcessRuns
from debulk.results.trace import Trace
from debulk.verdict import Verdict

FORMAT = "debulk report"
MAPS = ("height_map", "excess_map", "shear_map")  # of a report; a history leaves them out


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
        (N, 4): numbers of the neighbours e, w along the first fibre, n, s along the second; -1 means none.
    kinds
        (N,): 0 inner, 1 fixed boundary, 2 free boundary.
    edges
        (M, 2) numbers of the nodes at the ends of each fibre segment.
    inside
        (N,): within the pocket's outline; these nodes enter the RMS.
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
    """How the minimum was found, and its certificate, which is computed independently of the solver.

    Attributes
    ----------
    method, status
        The solver, and how it ended.
    certified
        True if the returned point is a minimum by the certificate's own figures.
    iterations, evaluations, starts
        Work done; number of starting points tried.
    length_error
        Largest strain of a fibre segment.
    penetration_mm
        Deepest node below the mold.
    kkt_error
        Largest residual force over a node's vacuum load.
    curvature
        Smallest curvature of the energy within the active constraints, in the unit of `kkt_error` over the net's
        spacing; 0 if none is negative, and negative at a saddle. None: not computed.
    energy_gain_mj
        Decrease of the energy from that of the net as laid, positive if it fell. None: not computed.
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
    """The ridge that the excess length of a pocket's fibres makes, read from lines along them (docs/verdicts.md).

    Attributes
    ----------
    length_mm
        Best estimate of the largest excess of a fibre that crosses the pocket's foot, with the noise's share taken out
        and without what a fold may draw from other places; of those with no free end, if there are any.
    height_mm, range_mm
        Height of the ridge by the paper's formula, 0 if there is none; what surely stands, and what may stand: with
        the noise, with what the filters may have taken away, and with all that one fold may draw from other places.
    alone_mm
        As the upper end of `range_mm`, without what a fold may draw from other places.
    elastic_mm
        Height of the elastic fold that the same length makes by the section model and the recipe's modulus, also where
        the formula gives no ridge. Together the two bound what a ply may do.
    noise_mm
        Standard deviation of the height by the scan's noise, and of the reading.
    uncertainty_mm
        Two of these.
    missed_mm
        By how much more than this the upper end of `range_mm` lies above `height_mm`.
    bridge_bound_mm
        mm, no fibre bridges a larger gap: the largest gap below the ply as it stands on fibres that may be too short,
        and, where that leaves a bridge that counts, below a string that is pulled taut over the mold along a fibre.
    fibre, direction_deg, from_mm, to_mm
        That fibre: of the first (0) or second (1) direction, the angle along which the ply is too long there, and where
        it leaves the mold and comes back to it, mold XY. None if no fibre leaves the mold.
    verdict
        Verdict by this ridge alone.
    """

    length_mm: float
    height_mm: float
    range_mm: tuple[float, float]
    alone_mm: float
    elastic_mm: float
    noise_mm: float
    uncertainty_mm: float
    bridge_bound_mm: float | None
    missed_mm: float = 0.0
    fibre: int | None = None
    direction_deg: float | None = None
    from_mm: tuple[float, float] | None = None
    to_mm: tuple[float, float] | None = None
    verdict: Verdict | None = None


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PocketReport(Record):
    """One pocket. Fields that a pocket without a judgement does not have are None.

    Attributes
    ----------
    id
        Number of the pocket; 1 is the largest.
    verdict, reason
        The outcome, and why in one sentence.
    remedy
        What to do, where the reason asks for something of its own; empty: what a pocket of this verdict asks for.
    decided_by
        The criterion whose figures give the verdict, "excess" or "paper"; empty if neither decided.
    paper_verdict
        Verdict by RMS, ridges and bridges of the minima, whichever criterion decided; None without a minimum.
    excess
        The ridge by the excess length; None at the ply's edge if it would exceed the limit if held: how much slides in
        there, the minima tell.
    outline_mm, foot_outline_mm
        (M, 2) contours at the cut height, and where the ply meets the mold; mold XY, closed from last to first.
    touches_ply_edge
        True if the pocket is open at the ply's edge.
    area_mm2, peak_mm, volume_mm3
        XY area inside the outline, largest height above the reference and integral of the height inside, for the ply
        smoothed as for the net.
    measured_share
        Share of the area that the scanner saw; the rest was filled in.
    promoted
        Why the pocket is judged although it is below a tolerance of the segmentation; empty if it is not below any.
    half_seen
        Unseen areas that border on the pocket, and its outcome for each way in which the ply may lie there. All figures
        of the net and its minimum are those with the holes filled in. None: there is no such area.
    edge_friction
        For a pocket at the ply's edge that closes if it slips there: its outcome with slip, and with its rim held. None
        for any other pocket, and with ``verdict.criterion = "paper"``.
    spacing_mm, node_count
        Spacing and number of nodes of the net.
    rms_mm, rms_range_mm
        RMS of the post-processed gaps inside the outline; its lowest and highest value over all starts, at both ends of
        the range of friction at the ply's edge.
    ridge_height_mm, ridge_length_mm
        Height and length of the worst ridge.
    excess_length_mm
        Largest excess over the mold of a fibre of the laid net that is held at both ends; 0 if none has any. Ply that
        slips in at the ply's edge is not included.
    ridge_range_mm
        Lowest and highest ridge height over the same starts and range of friction.
    crease_probability
        Probability that its ridge exceeds the limit (docs/probability.md); None: nothing is known of its ridge.
    ridges
        Where the ridge runs that the excess makes, and what it looks like; empty if none stands, or if `excess` is not
        known, as at the ply's edge, where a ridge may stand anywhere in the pocket. Reports of before 0.9 may have
        ridges of the net there, the highest first.
    ridge_nodes
        (M,) nodes of the section across the worst ridge, from one foot to the other; None without a ridge.
    bridge_height_mm
        Largest height at which the ply, too short to reach the mold, bridges a hollow.
    bridge_section
        For a pocket that only such a bridge would make CREASE: how high the bridge is by sections along its fibres.
        None for any other pocket, if the ply outline or the mold is not known, and with ``verdict.criterion =
        "paper"``.
    drawn_in_mm, drawn_in_tension_n_per_mm, drawn_in_hold_n_per_mm
        Largest height of a bridge of the model that does not count because the ply is drawn in there; the pull of its
        fibre, and the force that friction between it and the ply's edge can hold. None if there is none.
    net
        The net before debulking.
    initial_gap_mm
        (N,) height of the net's nodes above the mold before debulking.
    debulked_mm, debulked_gap_mm
        (N, 3) nodes at the minimum, (N,) their heights above the mold.
    post_processed_gap_mm
        (N,) gaps with the coarse net's ridges replaced by the real ply's.
    energy_mj, energy_terms_mj
        Energy at the minimum, and its parts: bending, shear, friction, gravity, vacuum.
    solve
        Course of the solver, and the certificate.
    runtime_ms, runtime_split_ms
        Time spent on this pocket, and its parts.
    """

    id: int
    verdict: Verdict
    reason: str
    remedy: str = ""
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
    crease_probability: float | None = None
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

    def as_decided(self) -> PocketReport:
        """Return the record of what decided: of a pocket that is not settled yet, without net and minimum."""
        return self

    @property
    def unsolved(self) -> bool:
        """Whether the fibre lines decided without a minimum; a pocket that can be settled still is, see there."""
        return self.excess is not None and self.as_decided().solve is None

    @property
    def deciding_ridge(self) -> DecidingRidge | None:
        """The ridge that decides: the highest one that any case of this pocket may have; None: none is known."""
        return deciding_ridge(self.as_decided())

    @property
    def elastic_mm(self) -> float | None:
        """Height of the elastic fold, even if the formula gives no ridge; None: not known."""
        if self.excess is not None:
            return self.excess.elastic_mm
        return self.ridges[0].elastic_mm if self.ridges else None

    @property
    def foot_or_outline_mm(self) -> PointsXY:
        """(M, 2) its foot, or its outline where the foot is not known, mold XY."""
        return self.outline_mm if self.foot_outline_mm is None else self.foot_outline_mm

    @property
    def centroid_mm(self) -> tuple[float, float] | None:
        """Mold XY of the centroid of the outline's area; None without an outline that has an area."""
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
    """Something that the inspection did not take into account: what, why, and a bound on its possible effect.

    `place_mm` is its mold XY, if it has a place.
    """

    what: str
    why: str
    bound: str = ""
    place_mm: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class UnseenHole:
    """An unseen part of the ply above the tolerance on area.

    Attributes
    ----------
    centre_mm, extent_mm
        Middle of its area, mold XY; and its widths along x and y.
    area_mm2
        Area in XY.
    thickness_mm
        Twice the greatest distance of a point in it from the nearest part of the ply that was seen.
    rim_height_mm
        Height above the reference that the ply beside the hole reaches along 6 to 16 mm of the hole's rim.
    of
        What is missing there: ``"scan"`` or ``"reference"``; ``"mask"`` where the mask hides it; ``"view"`` where both
        are missing, beyond the scanner's picture, or beyond all points of a list.
    at_ply_edge
        Whether it reaches the ply's edge.
    at_best
        The best verdict that the layup can have because of it; None: it does not affect the verdict.
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
    """A narrow fold that stood in the ply when it was scanned, which the height map's filters would remove as noise.

    Attributes
    ----------
    start_mm, end_mm
        Mold XY of the first and the last point of it that was examined; the wrinkle is at least as long as this.
    length_mm, height_mm, width_mm
        Length along it; height above the reference; width at half its height.
    excess_length_mm, ridge_height_mm
        Excess length of the fibre that crosses it most steeply, and the ridge that this makes.
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
        Verdict of the layup, and the reason in one sentence: both follow from `findings` alone.
    pockets
        Pockets, largest first, followed by the places below the tolerances that could crease, highest first.
    timings_ms
        Times of the stages, in order.
    findings
        What the checks found, in the order in which they speak; see `debulk.results.compose`.
    left_out
        What the verdict does not take into account.
    coverage
        Share of the ply (of the reference if the outline is unknown) that scan and reference show, measured or filled
        in by the rule for small holes; None: it was not determined.
    unseen
        The unseen parts above the tolerance on area; largest first.
    wrinkles
        Narrow folds that already stand in the ply, longest first.
    level
        How the ply lies between the pockets; None if too little of it is there to tell.
    height_map
        Height of the ply above the reference, mm; NaN where nothing was seen, or off the ply. It is meant for pictures
        and is coarse where no pocket was looked for.
    excess_map
        Largest excess of a fibre over each place, mm, 0 where none leaves the mold; on a grid of its own.
    shear_map
        Shear of the ply, degrees, where its two fibre directions are known from place to place, from a drape or a
        sensor: by how much they cross otherwise than at a right angle; NaN elsewhere, and off the ply. None: two
        angles were given for all of it.
    runs
        The fibre lines that are too long, from which `debulk.Report.rework` follows; None: they were not read.
    ply_outline_mm
        (M, 2), mold XY; of a ply with cut-outs its rings one after another, the outside first, each of which ends with
        its first corner again. None means unknown.
    recipe
        Settings, section by section; ``debulk.Recipe(**report.recipe)`` restores them.
    source
        What was inspected: names of files, seed of a virtual layup, and the like.
    warnings
        What the reader should know before trusting the rest.
    crease_probability
        Probability that any pocket's ridge exceeds the limit; None if it is not known of one.
    trace
        Time, fingerprints, pose and everything else that entered the inspection; None: not from a real inspection.
    chain
        How the scan compares with its qualified chain; None: no chain was given, or the scan was refused before.
    version
        Version of debulk.
    """

    verdict: Verdict
    reason: str
    pockets: tuple[PocketReport, ...]
    timings_ms: dict[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    coverage: float | None = None
    unseen: tuple[UnseenHole, ...] = ()
    wrinkles: tuple[Wrinkle, ...] = ()
    level: Level | None = None
    height_map: Grid | None = None
    excess_map: Grid | None = None
    shear_map: Grid | None = None
    runs: ExcessRuns | None = None
    ply_outline_mm: PointsXY | None = None
    recipe: dict[str, Any] = field(default_factory=dict)
    source: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    crease_probability: float | None = None
    trace: Trace | None = None
    chain: ChainReport | None = None
    version: str = ""

    @property
    def passed(self) -> bool:
        """Whether the verdict is CEASE."""
        return self.verdict is Verdict.CEASE

    @property
    def limit_mm(self) -> float | None:
        """Limit of a ridge's height in the recipe; None: it is not known."""
        limit: float | None = self.recipe.get("verdict", {}).get("max_ridge_mm")
        return limit

    @property
    def creasing(self) -> tuple[PocketReport, ...]:
        """The pockets that crease, in the report's order."""
        return tuple(pocket for pocket in self.pockets if pocket.verdict is Verdict.CREASE)

    def pocket(self, number: int) -> PocketReport:
        """Return the pocket of this number, as on the page and in the table.

        Raises
        ------
        InputError
            If there is no such pocket.
        """
        for pocket in self.pockets:
            if pocket.id == number:
                return pocket
        numbers = ", ".join(str(pocket.id) for pocket in self.pockets) or "none"
        raise InputError(f"number: expected the number of a pocket of this report ({numbers}), but got {number!r}")

    def to_dict(self) -> Mapping[str, Any]:
        """Return the report as JSON types, as `debulk.Report.save` writes it."""
        return codec.encode(self, FORMAT)
