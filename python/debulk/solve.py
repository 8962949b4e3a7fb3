"""The ply under vacuum: its configuration of least energy, with inextensible fibres, and the certificate of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.arguments import typed
from debulk.arrays import same_named

if TYPE_CHECKING:
    from debulk.sheet import Sheet

__all__ = ["Certificate", "Solution", "best", "certify", "methods", "minimise"]

# Each default is defined only in cpp/debulk/solve/options.hpp or cpp/debulk/sheet/minimise.hpp.
_DEFAULTS = _core.sheet.MinimiseOptions()
STIFFNESS = _DEFAULTS.solve.stiffness


@dataclass(frozen=True)
class Certificate:
    """What is known of a configuration from its nodes alone, regardless of what a solver reported."""

    kkt_error: float
    """Largest component of ∇Π - Jᵀλ - ν over the movable nodes. Its unit is the nodal vacuum force P A / N (without
    vacuum, a node's weight), or 1 % of the largest force of a single spring (a corner's bending or shear) in the
    initial net if that is more, as in a stiff ply whose fibres hold forces far above the vacuum's. The multipliers λ of
    the lengths and ν ≥ 0 of touching nodes are fitted by least squares. Limit 1e-4. Not a number if a stop came before
    it was known."""
    strict_kkt_error: float
    """The same in units of P A / N (or of a node's weight) for any ply; it has no limit."""
    length_error: float
    """Largest relative error of a segment's length. Limit 1e-4; up to 1e-3 with a compliance."""
    penetration_mm: float
    """Deepest movable node below the reference, mm. Limit 1e-3."""
    energy_rise_mj: float
    """Rise of Π above that of the initial configuration, mJ; 0 if it is not above. Limit 0."""
    curvature: float
    """Smallest curvature of Π within the active constraints, in the unit of `kkt_error` over Δ; 0 if none is
    negative."""
    compliant: bool
    """Whether the length error required the wider limit."""
    certified: bool
    """Whether all limits are kept."""
    failure: str
    """Which limits are not kept, in words; empty if certified."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A configuration of the sheet, with its energy, status and certificate."""

    nodes_mm: NDArray[np.float64]
    """(N, 3) nodes, mm."""
    status: str
    """How the solve ended: converged, nothing_moves, iteration_limit, deadline, cancelled, infeasible,
    numerical_failure; or why it was refused up front: too_few_movable_nodes (more lengths to keep than coordinates to
    keep them with), no_minimum (nothing is fixed, and friction does not hold the ply on the mold; if that shows only
    during the solve, iterations is above 0), not_a_surface (segments off by more than half their length), too_stiff
    (the springs are a million times as strong as the load, or more). Only the first two can be a success."""
    explanation: str
    """The same as a sentence."""
    certificate: Certificate
    """Certificate, computed independently of the solver."""
    certified: bool
    """Whether the solve ended well and the result is certified: the only kind of success."""
    energy_mj: float
    """Π, mJ."""
    iterations: int
    evaluations: int
    """`iterations`, `evaluations`: counts of the method, retries included."""
    minima: tuple[Solution, ...] = ()
    """Solutions of all starts, in their order; this solution is the certified one of least energy."""
    _core: Any = field(default=None, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the compiled object, which only an inspection's post-processing uses."""
        return {**self.__dict__, "_core": None}

    @property
    def length_error(self) -> float:
        """Length error of the certificate."""
        return self.certificate.length_error

    @property
    def penetration_mm(self) -> float:
        """Penetration of the certificate, mm."""
        return self.certificate.penetration_mm

    @property
    def kkt_error(self) -> float:
        """KKT error of the certificate."""
        return self.certificate.kkt_error


def methods() -> list[str]:
    """Names of the methods that `minimise` takes.

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
        (N, 3) configuration to start from, mm. Default: the initial one. Fixed nodes stay where they are in the initial
        one.
    starts
        Number of starts: the given one, and seeded perturbations of it by up to 0.1 spacings.
    seed
        Seed of the perturbations.
    deadline_s
        Seconds until the solve stops with status "deadline". The default method keeps to it within a few milliseconds
        at 1000 nodes, the other methods within one iteration.
    tolerance, max_iterations
        Options of the method.
    stiffness
        k of the fibres, in units of the vacuum force: a fibre's strain is its tension over k. It is large enough that
        lengths are right within 1e-4. Where fibres pinned at both ends would need unlimited tension, it bounds the
        tension.
    first_start
        Starts before this one, counted from 0, are left out because an earlier call has tried them.
    stop
        Another thread may cancel the solve with it.

    Returns
    -------
    Solution
        The certified solution of least energy, one without a compliance if there is any; that of the first start if
        none is certified.

    Raises
    ------
    InputError
        If the method is unknown, shapes are wrong, or options are out of range.

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
    """Minimise in the same way, with compiled options."""
    return best([_solution(m) for m in sheet._minimiser.run(options, start, stop)])


def best(minima: Sequence[Solution]) -> Solution:
    """Choose among the solutions of several starts: the certified one of least energy, or else the first.

    A solution whose fibres needed a compliance is chosen only if no other is certified.

    Parameters
    ----------
    minima
        At least one solution, in the order of the starts.

    Returns
    -------
    Solution
        The chosen solution, with all of them in `minima`.

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
    """Sort key of certified solutions: the best has no compliance, since strain saves energy, and the least energy."""
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
        Stiffness of the solve. It is used only if lengths are off by more than 1e-4; the fibres' tensions must then be
        stiffness times strain.

    Raises
    ------
    InputError
        If the nodes do not have the sheet's shape, or are not finite.

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
    return Certificate(**same_named(Certificate, c, "energy_rise_mj"), energy_rise_mj=c.energy_gain_mj)


def _solution(m: _core.sheet.Minimum) -> Solution:
    made = same_named(Solution, m, "certificate", "minima", "_core")
    return Solution(**made, certificate=_certificate(m.certificate), _core=m)
