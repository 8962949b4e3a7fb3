"""Will a pocket crease or cease? Criteria, the verdicts of pockets and layups, and each reason in one sentence."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Literal

from debulk import _core
from debulk.arguments import check_fields, typed
from debulk.arrays import same_named

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Criteria", "Judgement", "RidgeBounds", "Verdict", "excess_bounds", "judge", "judge_layup", "natural_length"]


class Verdict(StrEnum):
    """What debulking will make of an air pocket or a layup, from the best verdict to the worst.

    Examples
    --------
    >>> Verdict.CEASE.value
    'cease'
    >>> print(Verdict.CEASE)
    CEASE
    >>> Verdict.worst([Verdict.CEASE, Verdict.CREASE, Verdict.UNDECIDED])
    <Verdict.CREASE: 'crease'>
    >>> sorted([Verdict.INVALID, Verdict.CREASE, Verdict.CEASE])
    [<Verdict.CEASE: 'cease'>, <Verdict.CREASE: 'crease'>, <Verdict.INVALID: 'invalid'>]
    """

    CEASE = "cease"
    """The pocket closes within the criteria, by the length of its fibres or by certified minima."""
    UNDECIDED = "undecided"
    """The evidence lies on both sides of a limit, or is not certified."""
    CREASE = "crease"
    """A ridge, bridging ply or an RMS above the criteria remains."""
    INVALID = "invalid"
    """No judgement is possible: too little was seen, the rim is not closed and fixed, or the input was refused."""

    @property
    def severity(self) -> int:
        """0 for CEASE up to 3 for INVALID."""
        return list(Verdict).index(self)

    def __str__(self) -> str:
        """Return the name, as every page and table has it; files hold the value."""
        return self.name

    def __format__(self, spec: str) -> str:
        """Format the name."""
        return format(self.name, spec)

    # A verdict is also text, which compares alphabetically: "invalid" < "undecided" must not decide anything.
    def __lt__(self, other: object) -> bool:
        return self.severity < self._severity_of(other)

    def __le__(self, other: object) -> bool:
        return self.severity <= self._severity_of(other)

    def __gt__(self, other: object) -> bool:
        return self.severity > self._severity_of(other)

    def __ge__(self, other: object) -> bool:
        return self.severity >= self._severity_of(other)

    @staticmethod
    def _severity_of(other: object) -> int:
        if not isinstance(other, Verdict):
            raise TypeError(f"a Verdict compares with a Verdict, not with a {type(other).__name__}")
        return other.severity

    @classmethod
    def worst(cls, verdicts: Iterable[Verdict]) -> Verdict:
        """Return the most severe of the verdicts, or CEASE if there are none."""
        return max(verdicts, default=cls.CEASE)


_DEFAULTS = _core.verdict.Criteria()  # the numbers are defined only in cpp/debulk/verdict/judge.hpp


@dataclass(frozen=True)
class Criteria:
    """Limits of what is accepted, and how a pocket is judged.

    Examples
    --------
    >>> Criteria(max_ridge_height_mm=0.5).max_rms_mm
    0.3
    """

    max_rms_mm: float = _DEFAULTS.max_rms_mm
    """Limit of the post-processed RMS inside the perimeter, mm. Default 0.30 as in the paper, the nominal thickness."""
    max_ridge_height_mm: float = _DEFAULTS.max_ridge_height_mm
    """Limit of the height of a ridge and of bridging ply, mm. Default 0.60, provisional."""
    min_coverage: float = _DEFAULTS.min_coverage
    """Share of the ply that the scan must have seen. Default 0.98."""
    min_pocket_coverage: float = _DEFAULTS.min_pocket_coverage
    """Share of a pocket's area that must have been measured. Default 0.80."""
    rms_margin_mm: float = _DEFAULTS.rms_margin_mm
    ridge_margin_mm: float = _DEFAULTS.ridge_margin_mm
    """`rms_margin_mm`, `ridge_margin_mm`: margins round the limits, mm: an RMS, ridge or bridge nearer to its limit
    decides nothing. Default 0.01 and 0.05."""
    compliance_margin_mm: float = _DEFAULTS.compliance_margin_mm
    """Least margin of the figures of the minima if the length constraints needed a compliance, mm. Default 0.05."""
    criterion: str = _DEFAULTS.criterion.name.lower()
    """"excess": a pocket inside the ply is judged by the ridge that the excess length of its fibres makes, and by
    bridges. "paper": it is judged by RMS, ridges and bridges of the minima. Pockets at the ply's edge always are."""

    def __post_init__(self) -> None:
        check_fields(self)
        _compiled(self).check()

    @classmethod
    def from_core(cls, compiled: _core.verdict.Criteria) -> Criteria:
        """Wrap compiled criteria, whose fields have the same names."""
        return cls(**same_named(cls, compiled, "criterion"), criterion=compiled.criterion.name.lower())


@functools.lru_cache(maxsize=16)  # each pocket asks for them several times
def criteria_of(recipe: Recipe, criterion: Literal["excess", "paper"] | None = None) -> Criteria:
    """Take the limits from the recipe, and the criterion, too, unless another is given."""
    from debulk.recipe import options

    return Criteria.from_core(options.criteria(recipe, criterion))


@functools.lru_cache(maxsize=16)  # each pocket is judged several times by the same ones
def _compiled(criteria: Criteria) -> _core.verdict.Criteria:
    compiled = _core.verdict.Criteria()
    known = {c.name.lower(): c for c in _core.verdict.Criterion.__members__.values()}
    if criteria.criterion not in known:
        raise _core.InputError(f"criterion: expected {' or '.join(known)}, but got {criteria.criterion!r}")
    for entry in fields(criteria):
        value = getattr(criteria, entry.name)
        setattr(compiled, entry.name, known[value] if entry.name == "criterion" else value)
    return compiled


@dataclass(frozen=True)
class Judgement:
    """A verdict, its reason in one sentence with the numbers, and the criterion that decided (empty if none did)."""

    verdict: Verdict
    reason: str
    decided_by: str = field(default="", repr=False)
    remedy: str = field(default="", repr=False)
    """What to do, if the reason asks for something of its own."""


@typed
def judge(
    *,
    certified: bool,
    rms_mm: float = math.nan,
    ridge_height_mm: float = math.nan,
    bridge_height_mm: float = 0.0,
    rms_range_mm: tuple[float, float] | None = None,
    ridge_range_mm: tuple[float, float] | None = None,
    bridge_range_mm: tuple[float, float] | None = None,
    compliant: bool = False,
    solve_status: str = "",
    deadline_passed: bool = False,
    coverage: float = 1.0,
    closed_rim: bool = True,
    refused: str = "",
    inside_ply: bool = False,
    excess_range_mm: tuple[float, float] | None = None,
    criteria: Criteria | None = None,
) -> Judgement:
    """Judge one pocket.

    INVALID takes precedence over CREASE, CREASE over UNDECIDED, and UNDECIDED over CEASE. If the figures of the minima
    decide and there is no certificate, the verdict is UNDECIDED, because a truncated solve still has the height of the
    pocket it began with. The excess needs no minimum, since every minimum keeps it.

    Parameters
    ----------
    certified
        Whether the certificate holds for every solution that the figures come from.
    rms_mm, ridge_height_mm, bridge_height_mm
        Figures of `debulk.ridge.post_process`, mm. NaN means that none was found, which gives UNDECIDED.
    rms_range_mm, ridge_range_mm
        Lowest and highest value over the certified solutions from several starts, mm. Default: the figure itself.
    bridge_range_mm
        Lowest and highest height of a bridge, mm. Default: `bridge_height_mm`. NaN: not known.
    compliant
        Whether the length error is above 1e-4, so that a compliance was needed. The margin round the limits is then
        wider.
    solve_status
        The solver's outcome in words, for the reason.
    deadline_passed
        Whether time ran out before the solution was certified, or before all starts that the rule requires were tried.
    coverage
        Measured share of the pocket's area, 0 to 1.
    closed_rim
        Whether fixed nodes close the pocket's rim; pass True for a pocket at the ply's edge.
    refused
        Why the pocket was not evaluated at all; empty when it was.
    inside_ply
        Whether the excess decides: every node of the rim is held, or the ridge keeps the limit even if it is.
    excess_range_mm
        Lowest and highest height of the ridge from the excess length, mm. None: it is not known.
    criteria
        Default: ``Criteria()``.

    Returns
    -------
    Judgement
        Verdict and reason.

    Raises
    ------
    InputError
        If a range is reversed or negative, or a coverage is outside 0 to 1.

    Examples
    --------
    >>> judge(certified=True, rms_mm=0.26, ridge_height_mm=0.0)
    Judgement(verdict=<Verdict.CEASE: 'cease'>, reason='no ridge, RMS 0.26 mm keeps the limit of 0.30 mm')
    >>> judge(certified=True, rms_mm=0.28, ridge_height_mm=1.57).reason
    'ridge 1.57 mm exceeds the limit of 0.60 mm'
    >>> judge(certified=False, rms_mm=0.26, ridge_height_mm=0.0, solve_status="iteration limit").verdict
    <Verdict.UNDECIDED: 'undecided'>

    By the excess length, which is the same at every minimum:

    >>> judge(certified=False, inside_ply=True, excess_range_mm=(0.71, 0.75)).reason
    'ridge by the excess length 0.71 to 0.75 mm exceeds the limit of 0.60 mm'
    """
    evidence = _core.verdict.PocketEvidence()
    evidence.inside_ply = inside_ply
    evidence.excess_ridge = None if excess_range_mm is None else _core.verdict.Spread(*excess_range_mm)
    evidence.rms = _core.verdict.Spread(*(rms_range_mm or (rms_mm, rms_mm)))
    evidence.ridge_height = _core.verdict.Spread(*(ridge_range_mm or (ridge_height_mm, ridge_height_mm)))
    evidence.bridge_height = _core.verdict.Spread(*(bridge_range_mm or (bridge_height_mm, bridge_height_mm)))
    evidence.certified = certified
    evidence.compliant = compliant
    evidence.solve_status = solve_status
    evidence.deadline_passed = deadline_passed
    evidence.coverage = coverage
    evidence.closed_rim = closed_rim
    evidence.refused = refused
    return _judgement(_core.verdict.judge(evidence, _compiled(criteria or Criteria())))


@typed
def judge_layup(
    pockets: Iterable[tuple[int, Judgement]], coverage: float, criteria: Criteria | None = None
) -> Judgement:
    """Judge the layup by its worst pocket and its coverage.

    Parameters
    ----------
    pockets
        Number and judgement of each pocket.
    coverage
        Share of the ply that the scan saw, 0 to 1.
    criteria
        Default: ``Criteria()``.

    Returns
    -------
    Judgement
        INVALID if too little was seen; CEASE if enough was seen and there is no pocket.

    Raises
    ------
    InputError
        If a coverage is outside 0 to 1.

    Examples
    --------
    >>> judge_layup([], 0.995)
    Judgement(verdict=<Verdict.CEASE: 'cease'>, reason='no air pocket, and 99.5 % of the ply was seen')
    >>> pockets = [(1, Judgement(Verdict.CEASE, "flat")), (2, Judgement(Verdict.CREASE, "high"))]
    >>> judge_layup(pockets, 0.995).reason
    '1 of 2 pockets crease, pocket 2: high'
    """
    judged = []
    for number, judgement in pockets:
        inner = _core.verdict.Judgement()
        inner.verdict = getattr(_core.verdict.Verdict, judgement.verdict.name)
        inner.reason = judgement.reason
        outer = _core.verdict.JudgedPocket()
        outer.id = number
        outer.judgement = inner
        judged.append(outer)
    return _judgement(_core.verdict.judge_layup(judged, coverage, _compiled(criteria or Criteria())))


@dataclass(frozen=True)
class RidgeBounds:
    """Heights of ridges that an excess length allows, mm: the least, by the ridge formula, and of an elastic fold."""

    least_mm: float
    geometric_mm: float
    elastic_mm: float


@typed
def excess_bounds(
    excess_length_mm: float, *, thickness_mm: float, bulk_factor: float, modulus_mpa: float, pressure_mpa: float
) -> RidgeBounds:
    """Bound the heights of ridges by the excess length of the initial net, before anything is solved.

    Parameters
    ----------
    excess_length_mm
        Largest excess of a fibre (`debulk.ridge.largest_fibre_excess`), mm.
    thickness_mm, bulk_factor
        Nominal thickness of the ply, mm, and ratio of nominal to consolidated thickness.
    modulus_mpa, pressure_mpa
        Bending modulus of the ply and pressure of the vacuum, MPa.

    Returns
    -------
    RidgeBounds
        Least height: 0, since the excess may be shared or sheared away. Geometric height: half the excess plus 0.43
        thicknesses, or 0 if that stays within the consolidated ply. Elastic height: that of an elastic fold, which
        needs far less excess (0.36 mm makes one of 1 mm).

    Raises
    ------
    InputError
        If a figure is not finite, or not positive where it must be.

    Examples
    --------
    >>> bounds = excess_bounds(0.362, thickness_mm=0.3, bulk_factor=1.2, modulus_mpa=360.0, pressure_mpa=0.1)
    >>> round(bounds.geometric_mm, 2), round(bounds.elastic_mm, 2)
    (0.31, 1.0)
    """
    length = _core.verdict.natural_length(modulus_mpa, thickness_mm, pressure_mpa)
    bounds = _core.verdict.excess_bounds(excess_length_mm, thickness_mm, bulk_factor, length)
    return RidgeBounds(bounds.least_mm, bounds.geometric_mm, bounds.elastic_mm)


@typed
def natural_length(modulus_mpa: float, thickness_mm: float, pressure_mpa: float) -> float:
    """Length scale set by bending stiffness and pressure, (E t³ / 12 P)^(1/3), mm.

    Parameters
    ----------
    modulus_mpa, thickness_mm, pressure_mpa
        Bending modulus E, MPa, and thickness t of the ply, mm, and the vacuum's pressure P, MPa.

    Raises
    ------
    InputError
        If a figure is not positive and finite.

    Examples
    --------
    >>> round(natural_length(360.0, 0.3, 0.1), 2)
    2.01
    """
    return float(_core.verdict.natural_length(modulus_mpa, thickness_mm, pressure_mpa))


def _judgement(compiled: _core.verdict.Judgement) -> Judgement:
    decided_by = "" if compiled.decided_by is None else compiled.decided_by.name.lower()
    return Judgement(Verdict[compiled.verdict.name], compiled.reason, decided_by)
