"""A history as one HTML page: what recurs, what was right, and what drifts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from debulk import __version__
from debulk.history.control import control
from debulk.history.drawn import chart, place_map, stacked
from debulk.history.overview import FIGURES, Overview, overview
from debulk.history.search import Search
from debulk.history.store import History
from debulk.history.tables import connected
from debulk.page.render import render
from debulk.results.agreement import Agreement, agreement
from debulk.verdict import Verdict

_VERDICTS = {verdict.name: verdict for verdict in Verdict}


class Rate(NamedTuple):
    """A share of pockets with its interval, and what it means."""

    name: str
    found: Agreement


def page(history: History, search: Search | None = None, baseline: int = 300) -> str:
    """Return the page of the layups that a search finds; the first `baseline` of them give the control limits."""
    with connected(history.path) as connection:
        seen = overview(connection, search or Search())
    charted = {title: seen.figures[name] for name, title in FIGURES.items()} | seen.chain
    charts = [chart(title, seen.times, control(values, baseline)) for title, values in charted.items()]
    causes = sorted(seen.causes.items(), key=lambda entry: (-_VERDICTS[entry[0][1]].severity, -entry[1]))
    outcomes = {(_VERDICTS[p], _VERDICTS[m]): count for (p, m), count in seen.outcomes.items()}
    times = [time for time in seen.times if time]
    return render(
        "history.html.j2",
        layups=len(seen.verdicts),
        first=min(times, default="")[:10],
        last=max(times, default="")[:10],
        verdicts=[(v, n) for v in Verdict if (n := seen.verdicts.count(v.name))],
        pockets=sum(int(counts.sum()) for counts in seen.pockets.values()),
        stacked=stacked(seen.times, seen.verdicts, seen.pockets),
        maps=[
            place_map("all pockets" if name == "all" else f"pockets that are {name}", grid)
            for name, grid in seen.places.items()
        ],
        causes=[(name, _VERDICTS[verdict], count) for (name, verdict), count in causes],
        outcomes=outcomes,
        rows=[v for v in Verdict if any(p is v for p, _ in outcomes)],
        columns=[v for v in Verdict if any(m is v for _, m in outcomes)],
        rates=_rates(outcomes),
        charts=[one for one in charts if one is not None],
        times_ms=_quantiles(seen),
        versions=seen.versions,
        recipes=seen.recipes,
        version=__version__,
    )


def _rates(outcomes: dict[tuple[Verdict, Verdict], int]) -> list[Rate]:
    """Return the shares that a cell asks for, of the pockets that both sides decided."""
    cease, crease = Verdict.CEASE, Verdict.CREASE
    (kept, escaped), (needless, found) = ([outcomes.get((p, m), 0) for m in (cease, crease)] for p in (cease, crease))
    rates = [
        ("right, of all pockets that both sides decided", kept + found, kept + escaped + needless + found),
        ("escapes: creased, of those predicted CEASE", escaped, kept + escaped),
        ("needless: ceased, of those predicted CREASE", needless, needless + found),
    ]
    return [Rate(name, agreement(hits, total)) for name, hits, total in rates if total]


def _quantiles(seen: Overview) -> list[tuple[str, float]]:
    times = seen.figures["total_ms"]
    times = times[times > 0]
    if not len(times):
        return []
    return [(name, float(np.quantile(times, share))) for name, share in (("median", 0.5), ("99 % below", 0.99))]
