"""Gauge repeatability and reproducibility by a crossed analysis of variance, as in AIAG's MSA, 4th edition."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from debulk._core import InputError
from debulk.arrays import Floats
from debulk.chain.study import Source, Study

_POOLED = 0.25  # significance of the interaction above which it counts as repeatability (MSA)
_DISTINCT = 1.41  # distinct categories: this times the parts' over the gauge's standard deviation (MSA)


class _Sums(NamedTuple):
    """Degrees of freedom and sum of squares of one source of variation."""

    df: int
    ss: float

    @property
    def ms(self) -> float:
        return self.ss / self.df if self.df else 0.0


class _Squares(NamedTuple):
    """The sources of a crossed study: parts, sessions, both together, and what is left within the cells."""

    parts: _Sums
    sessions: _Sums
    both: _Sums
    within: _Sums


def crossed(values: ArrayLike, quantity: str = "", unit: str = "", tolerance: float | None = None) -> Study:
    """Analyse a crossed study: (P, S, T) values of parts, sessions (appraisers, days, set-ups) and trials.

    P and T are 2 at least. With one session nothing is known of reproducibility, which is then 0. An interaction that
    is not significant at 0.25 is pooled with the repeatability. `tolerance` is the width for P/T; None: there is none.
    """
    from scipy.stats import f as fisher

    array = np.asarray(values, dtype=np.float64)
    enough = array.ndim == 3 and array.shape[0] > 1 and array.shape[1] > 0 and array.shape[2] > 1
    if not (enough and np.isfinite(array).all()):
        raise InputError(
            f"values: expected finite ones of the shape (parts from 2, sessions, trials from 2), got {array.shape}"
        )
    parts, sessions, trials = array.shape
    of = _sums(array)
    error = of.within
    alone = sessions == 1
    pooled = not alone and _tail(fisher, of.both, of.within) > _POOLED
    if pooled:
        error = _Sums(error.df + of.both.df, error.ss + of.both.ss)
    against = error if pooled or alone else of.both
    interaction = 0.0 if pooled or alone else max(0.0, (of.both.ms - error.ms) / trials)
    session = 0.0 if alone else max(0.0, (of.sessions.ms - against.ms) / (parts * trials))
    part = max(0.0, (of.parts.ms - against.ms) / (sessions * trials))
    rows = [_row("parts", of.parts, of.within if alone else of.both, fisher)]
    if not alone:
        rows += [_row("sessions", of.sessions, of.both, fisher), _row("parts by sessions", of.both, of.within, fisher)]
    rows.append(Source(name="repeatability", df=of.within.df, ss=of.within.ss, ms=of.within.ms, f=None, p=None))
    grr = float(np.sqrt(error.ms + session + interaction))
    total = float(np.sqrt(grr**2 + part))
    return Study(
        quantity=quantity,
        unit=unit,
        parts=parts,
        sessions=sessions,
        trials=trials,
        table=tuple(rows),
        pooled=pooled,
        repeatability=float(np.sqrt(error.ms)),
        reproducibility=float(np.sqrt(session)),
        interaction=float(np.sqrt(interaction)),
        grr=grr,
        part=float(np.sqrt(part)),
        total=total,
        tolerance=tolerance,
        percent_grr=100 * grr / total if total else 0.0,
        percent_tolerance=None if tolerance is None else 100 * 6 * grr / tolerance,
        distinct=int(_DISTINCT * np.sqrt(part) / grr) if grr else None,
    )


def _sums(array: Floats) -> _Squares:
    parts, sessions, trials = array.shape
    mean, of_part, of_session, of_cell = (array.mean(axis=axes) for axes in ((0, 1, 2), (1, 2), (0, 2), 2))
    part = sessions * trials * float(np.sum((of_part - mean) ** 2))
    session = parts * trials * float(np.sum((of_session - mean) ** 2))
    both = trials * float(np.sum((of_cell - of_part[:, None] - of_session + mean) ** 2))
    within = float(np.sum((array - of_cell[:, :, None]) ** 2))
    return _Squares(
        _Sums(parts - 1, part),
        _Sums(sessions - 1, session),
        _Sums((parts - 1) * (sessions - 1), both),
        _Sums(parts * sessions * (trials - 1), within),
    )


def _row(name: str, one: _Sums, against: _Sums, fisher: object) -> Source:
    f = one.ms / against.ms if against.ms else None
    return Source(name=name, df=one.df, ss=one.ss, ms=one.ms, f=f, p=None if f is None else _tail(fisher, one, against))


def _tail(fisher: object, one: _Sums, against: _Sums) -> float:
    """Return the probability of such a ratio of mean squares, or a larger one, by chance."""
    return float(fisher.sf(one.ms / against.ms, one.df, against.df)) if against.ms else 0.0  # type: ignore[attr-defined]
