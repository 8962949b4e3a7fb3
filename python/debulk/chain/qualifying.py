"""The qualification of a chain: what it delivers, scan after scan, of one layup that nobody moved."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from debulk import __version__
from debulk._core import InputError
from debulk.arguments import typed
from debulk.arrays import Floats
from debulk.chain import repeatability
from debulk.chain.blur import transfer
from debulk.chain.figures import FIGURES, Quantity
from debulk.chain.gauge import Gauge, measured
from debulk.chain.record import Chain, Figure
from debulk.chain.study import Drift
from debulk.inspection.inspector import Inspector, Progress
from debulk.inspection.ply.fibre_angles import Angles
from debulk.report import Report
from debulk.results.trace import now_utc
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe

_FEWEST = 10
_SHARE, _SURE = 0.9973, 0.95  # of the scans of this chain that lie within the limits, and how sure that is
_DRIFTS = 0.01  # probability by chance below which a trend is named
_NEEDED = ("pitch_mm", "noise_mm", "near")
_UNSTEADY = 0.5  # of a figure's mean: limits farther off recognise hardly any filter
_BY_PITCH = ("edge_mm",)  # figures whose least tolerance grows with the pitch


@typed
def qualify(
    scans: Iterable[ArrayLike],
    reference: ArrayLike,
    recipe: Recipe | None = None,
    ply_outline: ArrayLike | None = None,
    fibre_angles_deg: Angles = (0.0, 90.0),
    mold_from_scanner: ArrayLike | None = None,
    camera: tuple[float, float, float] | None = None,
    mask: ArrayLike | None = None,
    progress: Progress | None = None,
    *,
    name: str = "chain",
    sessions: Sequence[str] | None = None,
    gauge: Gauge | None = None,
) -> Chain:
    """Qualify a chain of scanner, filters and export by scans of one layup that was not moved between them.

    Parameters
    ----------
    scans
        At least ten scans, in the order in which they were taken, each in the form that `Inspector.inspect` takes. They
        are read one at a time, so that a generator may load them.
    reference, recipe, ply_outline, fibre_angles_deg, mold_from_scanner, camera, mask
        As for an `Inspector`.
    progress
        Called with what is done and the share of the scans that are done. That share is 0 if their number is not known.
    name
        The chain's name.
    sessions
        The session, such as the day or the operator, of each scan; sessions of equally many scans, at least two, tell
        reproducibility from repeatability. None: all scans are of one session.
    gauge
        Scans of a strip or a ridge of known height and width.

    Returns
    -------
    Chain
        What the chain delivers, with the limits by which an inspector recognises it. ``doubts`` says what the
        qualification could not show.

    Raises
    ------
    InputError
        If there are fewer than ten scans, or the same one twice, or a scan that shows too little of the ply, or the
        extra ``qualify`` (SciPy) is not installed.

    Examples
    --------
    >>> import debulk
    >>> layups = [debulk.scenes.layup(1, (448, 336), repeat=k) for k in range(10)]
    >>> of, scans = layups[0], [layup.scan for layup in layups]
    >>> recipe = debulk.Recipe(solve={"when": "needed"})
    >>> chain = qualify(scans, of.reference, recipe, of.ply_outline, (0, 90), of.mold_from_scanner)
    >>> round(chain.figure("noise_mm").mean, 2)
    0.05
    """
    check_installed()
    inspector = Inspector(
        recipe, reference, ply_outline, fibre_angles_deg, mold_from_scanner, camera, mask, chain=_unknown(name)
    )
    many = len(scans) if isinstance(scans, Sequence) else 0
    if isinstance(scans, Sequence):
        _check_count(many)  # before the work is done
    reports: list[Report] = []
    for scan in scans:
        if progress is not None:
            progress(f"scan {len(reports) + 1}", len(reports) / many if many else 0.0)
        reports.append(inspector.inspect(scan))
        _check_last(reports)
    _check_count(len(reports))
    signatures = _signatures(reports)
    figures = limits(signatures)
    strip = None if gauge is None else measured(gauge, inspector)
    edge = next((one for one in figures if one.name == "edge_mm"), None)
    blur_mm = strip.blur_mm if strip is not None else edge.mean if edge is not None and edge.mean > 0 else None
    limit_mm = inspector.recipe.verdict.max_ridge_mm
    found = repeatability.studies(reports, sessions, limit_mm)
    drifts = tuple(_drift(one, signatures[one.name]) for one in FIGURES if one.name in signatures)
    levels = [report.level.laid_mm for report in reports if report.level is not None]
    if len(levels) == len(reports):
        height = Quantity("level_mm", "mm", "height of the ply between the pockets", "", "")
        drifts = (*drifts, _drift(height, np.array(levels)))
    chain = Chain(
        name=name,
        made_utc=now_utc(),
        debulk=__version__,
        scans=len(reports),
        image=_image(reports[0]),
        figures=figures,
        drifts=drifts,
        studies=found.studies,
        agreement=found.agreement,
        strip=strip,
        blur_mm=blur_mm,
        transfer=() if blur_mm is None else transfer(blur_mm),
    )
    return chain.model_copy(update={"doubts": tuple(_doubts(chain, reports, sessions))})


def check_installed() -> None:
    """Refuse to qualify without SciPy."""
    try:
        import scipy  # noqa: F401
    except ImportError:
        raise InputError('debulk.qualify needs SciPy: pip install "debulk[qualify]"') from None


def _unknown(name: str) -> Chain:
    """Return a chain of which nothing is known: reports compared with it carry their scans' figures."""
    blank = tuple(Figure(name=one.name, mean=0.0, sd=0.0, low=None, high=None) for one in FIGURES)
    return Chain(name=name, made_utc="", debulk=__version__, scans=1, figures=blank)


def _image(report: Report) -> tuple[int, int] | None:
    shape = report.trace.scan.shape if report.trace and report.trace.scan else ()
    return (shape[0], shape[1]) if len(shape) == 3 else None


def _check_count(count: int) -> None:
    if count < _FEWEST:
        raise InputError(f"scans: expected at least {_FEWEST} of one unmoved layup, but got {count}")


def _check_last(reports: Sequence[Report]) -> None:
    """Refuse a scan that was not looked at, or that is a copy of an earlier one."""
    *earlier, last = reports
    if last.chain is None:
        raise InputError(f"scans: scan {len(reports)} cannot be used: {last.reason}")
    own = _fingerprint(last)
    for number, report in enumerate(earlier, start=1):
        if own is not None and _fingerprint(report) == own:
            raise InputError(f"scans: scan {len(reports)} is scan {number} again, bit for bit; a copy shows no scatter")


def _fingerprint(report: Report) -> tuple[str, str] | None:
    return report.trace.scan.fingerprint if report.trace and report.trace.scan else None


def _signatures(reports: Sequence[Report]) -> dict[str, Floats]:
    """Return the scans' figures by name; those that every scan shows."""
    every = [{one.name: one.measured for one in report.chain.figures} for report in reports if report.chain]
    for name in _NEEDED:
        lacking = [number for number, one in enumerate(every, start=1) if name not in one]
        if lacking:
            raise InputError(f"scans: scan {lacking[0]} shows too little of the ply to measure its {name}")
    names = set.intersection(*(set(one) for one in every))
    return {one.name: np.array([of[one.name] for of in every]) for one in FIGURES if one.name in names}


def limits(signatures: Mapping[str, Floats]) -> tuple[Figure, ...]:
    """Return the limits by which a chain is recognised, from (N,) figures of its scans by name; the pitch is needed."""
    pitch_mm = float(signatures["pitch_mm"].mean())
    return tuple(_wider(_figure(one, signatures[one.name]), pitch_mm) for one in FIGURES if one.name in signatures)


def _figure(quantity: Quantity, values: Floats) -> Figure:
    """Return the limits: a tolerance interval of the scatter, but no narrower than other parts and molds need."""
    mean, sd = float(values.mean()), float(values.std(ddof=1))
    reach = max(_factor(len(values)) * sd, quantity.share * abs(mean), quantity.least)
    low: float | None = mean - reach if quantity.below else None
    if low is not None and low <= 0 <= values.min() and quantity.never_negative:
        low = None  # so little is there now and then anyway
    return Figure(name=quantity.name, mean=mean, sd=sd, low=low, high=mean + reach if quantity.above else None)


def _wider(figure: Figure, pitch_mm: float) -> Figure:
    """Return a figure with limits that are no narrower than half a pitch, where it is a length across the edge."""
    if figure.name not in _BY_PITCH or figure.low is None or figure.high is None:
        return figure
    half = 0.5 * pitch_mm
    return figure.model_copy(
        update={"low": min(figure.low, figure.mean - half), "high": max(figure.high, figure.mean + half)}
    )


def _factor(count: int) -> float:
    """Return the factor of a two-sided normal tolerance interval (W. G. Howe, JASA 64 (1969) 610)."""
    from scipy.stats import chi2, norm

    df = count - 1
    return float(norm.ppf(0.5 + 0.5 * _SHARE) * math.sqrt(df * (1 + 1 / count) / chi2.ppf(1 - _SURE, df)))


def _drift(quantity: Quantity, values: Floats) -> Drift:
    from scipy.stats import linregress

    if np.ptp(values) == 0:
        return Drift(name=quantity.says, unit=quantity.unit, change=0.0, p=1.0)
    line = linregress(np.arange(len(values)), values)
    return Drift(
        name=quantity.says, unit=quantity.unit, change=float(line.slope * (len(values) - 1)), p=float(line.pvalue)
    )


def _doubts(chain: Chain, reports: Sequence[Report], sessions: Sequence[str] | None) -> list[str]:
    bad = [(k, report.reason) for k, report in enumerate(reports, start=1) if report.verdict is Verdict.INVALID]
    out = [f"{len(bad)} of {len(reports)} scans are INVALID, such as scan {bad[0][0]}: {bad[0][1]}"] if bad else []
    for one in FIGURES:
        figure = chain.figure(one.name)
        if figure is None:
            out.append(f"the {one.says} could not be measured: a change of it alone is not noticed")
        elif one.share and any(
            limit is not None and abs(limit - figure.mean) > max(_UNSTEADY, one.share) * abs(figure.mean) > 0
            for limit in (figure.low, figure.high)
        ):
            out.append(
                f"the {one.says} varies so much from scan to scan ({figure.mean:.3g} ± {figure.sd:.2g}) that its "
                "limits recognise only coarse changes"
            )
    out += [
        f"the {one.name} drifts: {one.change:+.2g}{' ' * bool(one.unit)}{one.unit} from the first to the last scan"
        for one in chain.drifts
        if one.p < _DRIFTS
    ]
    if sessions is None:
        out.append("all scans are of one session: reproducibility from day to day, or between operators, is not known")
    if not chain.studies:
        out.append("fewer than two pockets were found in every scan: repeatability of pockets is not known")
    if chain.strip is None:
        out.append("no gauge was scanned: the gain of heights is not known, and blur only by the ply's edge")
    return out
