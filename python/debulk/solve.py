"""The ply under vacuum: the configuration of least energy, with inextensible fibres, and its certificate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.arguments import typed

if TYPE_CHECKING:
    from debulk.sheet import Sheet

__all__ = ["Certificate", "Solution", "best", "certify", "methods", "minimise"]

# Each default stands once, in cpp/debulk/solve/options.hpp and cpp/debulk/sheet/minimise.hpp.
_DEFAULTS = _core.sheet.MinimiseOptions()
STIFFNESS = _DEFAULTS.solve.stiffness


@dataclass(frozen=True)
class Certificate:
    """What is known of a configuration from its nodes alone, whatever a solver said.

    Attributes
    ----------
    kkt_error
        Largest component of ∇Π - Jᵀλ - ν over the movable nodes, in units of the nodal vacuum force P A / N (without
        vacuum: of a node's weight), or of 1 % of the largest force of a single spring (a corner's bending or shear) in
        the initial net, if that is more: a stiff ply, whose fibres hold forces that dwarf the vacuum's. The
        multipliers λ of the lengths and ν ≥ 0 of touching nodes are fitted by least squares. Limit 1e-4. Not a number
        where a stop came before it was known.
    strict_kkt_error
        The same in units of P A / N (or of a node's weight) whatever the ply; no limit.
    length_error
        Largest relative error of a segment's length. Limit 1e-4; up to 1e-3 with a compliance.
    penetration_mm
        Deepest movable node below the reference, mm. Limit 1e-3.
    energy_rise_mj
        Π above that of the initial configuration, mJ; 0 where it is not above. Limit 0.
    curvature
        Smallest curvature of Π within the active constraints, in the unit of `kkt_error` over Δ; 0 where none is
        negative.
    compliant
        Whether the length error needed the wider limit.
    certified
        Whether every limit is kept.
    failure
        Which limits are not kept, in words; empty if certified.
    """

    kkt_error: float
    strict_kkt_error: float
    length_error: float
    penetration_mm: float
    energy_rise_mj: float
    curvature: float
    compliant: bool
    certified: bool
    failure: str


@dataclass(frozen=True, eq=False)
class Solution:
    """A configuration of the sheet with what is known of it.

    Attributes
    ----------
    nodes_mm
        (N, 3) nodes, mm.
    status
        How the solve ended: converged, nothing_moves, iteration_limit, deadline, cancelled, infeasible,
        numerical_failure; or refused up front: too_few_movable_nodes (more lengths to keep than coordinates to keep
        them with), no_minimum (nothing fixed, and friction does not hold the ply on the mold; where that shows only
        during the solve, iterations is above 0), not_a_surface (segments
        off by more than half their length). Only the first two can be a success.
    explanation
        The same as a sentence.
    certificate
        Computed apart from the solver.
    certified
        Ended well and certified: the only kind of success.
    energy_mj
        Π, mJ.
    iterations, evaluations
        Of the method, retries included.
    minima
        Of every start, in their order; this solution is the certified one of least energy.
    """

    nodes_mm: NDArray[np.float64]
    status: str
    explanation: str
    certificate: Certificate
    certified: bool
    energy_mj: float
    iterations: int
    evaluations: int
    minima: tuple[Solution, ...] = ()
    _core: Any = field(default=None, repr=False)

    @property
    def length_error(self) -> float:
        """Of the certificate."""
        return self.certificate.length_error

    @property
    def penetration_mm(self) -> float:
        """Of the certificate, mm."""
        return self.certificate.penetration_mm

    @property
    def kkt_error(self) -> float:
        """Of the certificate."""
        return self.certificate.kkt_error


def methods() -> list[str]:
    """Names that `minimise` takes.

    Examples
    --------
    >>> methods()
    ['auto', 'interior_point', 'ipopt', 'nlopt']
    """
    return _core.solve.method_names()


@typed
def minimise(
    sheet: Sheet,
    method: str = _DEFAULTS.method,
    start: ArrayLike | None = None,
    starts: int = _DEFAULTS.starts,
    seed: int = _DEFAULTS.seed,
    deadline_s: float | None = None,
    *,
    tolerance: float = _DEFAULTS.solve.tolerance,
    max_iterations: int = _DEFAULTS.solve.max_iterations,
    stiffness: float = STIFFNESS,
    first_start: int = _DEFAULTS.first_start,
    stop: _core.Stop | None = None,
) -> Solution:
    """Minimise the sheet's energy subject to inextensible fibres and no node below the reference.

    Parameters
    ----------
    sheet
        The ply.
    method
        One of `methods`.
    start
        (N, 3) configuration to start from, mm; default: the initial one. Fixed nodes stay at the initial one.
    starts
        Number of starts: the given one, and seeded perturbations of it by up to 0.1 spacings.
    seed
        Of the perturbations.
    deadline_s
        Seconds until the solve stops with status "deadline"; the default method keeps it within a few milliseconds at
        1000 nodes, the others within an iteration.
    tolerance, max_iterations
        Of the method.
    stiffness
        k of the fibres, in units of the vacuum force: a fibre's strain is its tension over k. Large enough that
        lengths are right within 1e-4; where fibres pinned at both ends would need endless tension, it bounds it.
    first_start
        Leave out the starts before this one, counted from 0: an earlier call has been through them.
    stop
        Another thread may cancel the solve through it.

    Returns
    -------
    Solution
        The certified solution of least energy, without a compliance if there is one; the first start's if none is
        certified.

    Raises
    ------
    InputError
        An unknown method, wrong shapes, options out of range.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> reference = debulk.surface.Reference(np.zeros((4, 4)), (-10, -10), 10.0)
    >>> h = np.sqrt(25 - 4.9**2)  # a roof, 1 mm high, pinned at both ends: it can tip over, no more
    >>> nodes = [[-4.9, 0, 0], [0, 0, h], [4.9, 0, 0]]
    >>> fibre = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> sheet = debulk.sheet.Sheet(nodes, fibre, [1, 0, 1], 5.0, 75.0, reference)
    >>> solution = minimise(sheet)
    >>> solution.certified, solution.length_error < 1e-4, bool(abs(solution.nodes_mm[1, 2]) < 1e-3)
    (True, True, True)
    """
    if stop is None:
        stop = _core.Stop()
    if deadline_s is not None:
        stop.set_deadline(deadline_s)
    options = _core.sheet.MinimiseOptions()
    options.method = method
    options.starts = starts
    options.first_start = first_start
    options.seed = seed
    options.solve.tolerance = tolerance
    options.solve.max_iterations = max_iterations
    options.solve.stiffness = stiffness
    return minimise_with(options, sheet, None if start is None else np.asarray(start, dtype=np.float64), stop)


def minimise_with(
    options: _core.sheet.MinimiseOptions, sheet: Sheet, start: NDArray[np.float64] | None, stop: _core.Stop
) -> Solution:
    """Do the same with compiled options."""
    return best([_solution(m) for m in sheet._minimiser.run(options, start, stop)])


def best(minima: Sequence[Solution]) -> Solution:
    """Choose among the minima of several starts: the certified one of least energy, or the first if none is.

    One whose fibres needed a compliance is chosen only where no other is certified.

    Parameters
    ----------
    minima
        At least one, in the order of their starts.

    Returns
    -------
    Solution
        It, with all of them in `minima`.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> reference = debulk.surface.Reference(np.zeros((4, 4)), (-10, -10), 10.0)
    >>> nodes = [[-4.9, 0, 0], [0, 0, np.sqrt(25 - 4.9**2)], [4.9, 0, 0]]
    >>> fibre = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> sheet = debulk.sheet.Sheet(nodes, fibre, [1, 0, 1], 5.0, 75.0, reference)
    >>> few, more = minimise(sheet, starts=2), minimise(sheet, starts=4, first_start=2)
    >>> solution = best(few.minima + more.minima)
    >>> len(solution.minima), solution.energy_mj == minimise(sheet, starts=4).energy_mj
    (4, True)
    """
    found = min((m for m in minima if m.certified), key=rank, default=minima[0])
    return replace(found, minima=tuple(minima))


def rank(certified: Solution) -> tuple[bool, float]:
    """Sort key of certified solutions, the best first: strained fibres save energy, so without a compliance first.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> reference = debulk.surface.Reference(np.zeros((4, 4)), (-10, -10), 10.0)
    >>> nodes = [[-4.9, 0, 0], [0, 0, np.sqrt(25 - 4.9**2)], [4.9, 0, 0]]
    >>> fibre = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> sheet = debulk.sheet.Sheet(nodes, fibre, [1, 0, 1], 5.0, 75.0, reference)
    >>> solution = minimise(sheet)
    >>> rank(solution) == (False, solution.energy_mj)
    True
    """
    return certified.certificate.compliant, certified.energy_mj


@typed
def certify(sheet: Sheet, nodes_mm: ArrayLike, stiffness: float = STIFFNESS) -> Certificate:
    """Judge a configuration from its nodes alone.

    Parameters
    ----------
    sheet
        The ply.
    nodes_mm
        (N, 3) configuration, mm.
    stiffness
        That of the solve; used only where lengths are off by more than 1e-4, when the fibres' tensions must be
        stiffness times strain.

    Raises
    ------
    InputError
        Nodes of another shape than the sheet's, or not finite.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> reference = debulk.surface.Reference(np.zeros((4, 4)), (-10, -10), 10.0)
    >>> h = np.sqrt(25 - 4.9**2)
    >>> nodes = [[-4.9, 0, 0], [0, 0, h], [4.9, 0, 0]]
    >>> fibre = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> sheet = debulk.sheet.Sheet(nodes, fibre, [1, 0, 1], 5.0, 75.0, reference)
    >>> certify(sheet, nodes).certified  # upright, the roof is in balance, but would fall over: a saddle
    False
    """
    return _certificate(_core.sheet.certify(sheet._core, np.asarray(nodes_mm, dtype=np.float64), stiffness))


def _certificate(c: _core.solve.Certificate) -> Certificate:
    return Certificate(
        c.kkt_error,
        c.strict_kkt_error,
        c.length_error,
        c.penetration_mm,
        c.energy_gain_mj,
        c.curvature,
        c.compliant,
        c.certified,
        c.failure,
    )


def _solution(m: _core.sheet.Minimum) -> Solution:
    return Solution(
        m.nodes_mm,
        m.status,
        m.explanation,
        _certificate(m.certificate),
        m.certified,
        m.energy_mj,
        m.iterations,
        m.evaluations,
        _core=m,
    )
