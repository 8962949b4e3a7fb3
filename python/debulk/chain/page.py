"""The qualification of a chain as one self-contained HTML page, for whoever audits the cell."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from debulk.chain.figures import FIGURES, Quantity
from debulk.page.charts import Bar, Chart
from debulk.page.render import render

if TYPE_CHECKING:
    from debulk.chain.record import Chain, Figure
    from debulk.chain.study import Study

_SMALLEST = 1e-4  # that is worth a figure


class Row(NamedTuple):
    """A figure of the signature: what it is, what was measured, and between which limits a scan is recognised."""

    quantity: Quantity
    figure: Figure
    limits: str


def page(chain: Chain) -> str:
    """Return the page."""
    rows = [
        Row(quantity, figure, _limits(figure, quantity.unit))
        for quantity in FIGURES
        if (figure := chain.figure(quantity.name)) is not None
    ]
    when = f"{chain.made_utc[:10]} {chain.made_utc[11:19]} UTC"
    return render(
        "chain.html.j2",
        running=f"chain {chain.name} · {when} · {chain.scans} scans",
        chain=chain,
        when=when,
        rows=rows,
        figures=figure_text,
        charts=[_components(study) for study in chain.studies],
    )


def figure_text(value: float | None, unit: str = "") -> str:
    """Return a figure with four digits, and its unit; a dash if there is none."""
    if value is None:
        return "–"
    if 0 < abs(value) < _SMALLEST:
        return f"below {_SMALLEST:g}"
    text = f"{value:.4g}".replace("-", "−")
    return f"{text} {unit}" if unit else text


def _limits(figure: Figure, unit: str) -> str:
    low, high = figure_text(figure.low, unit), figure_text(figure.high, unit)
    if figure.low is None:
        return "any" if figure.high is None else f"at most {high}"
    return f"at least {low}" if figure.high is None else f"{figure_text(figure.low)} to {high}"


def _components(study: Study) -> Chart:
    """Chart the components of the standard deviation, in percent of the total."""
    of_sessions = [("reproducibility", study.reproducibility), ("parts by sessions", study.interaction)]
    parts = [
        ("repeatability", study.repeatability),
        *(of_sessions if study.sessions > 1 else []),
        ("gauge R&R", study.grr),
        ("part to part", study.part),
    ]
    shares = [(name, 100 * value / study.total if study.total else 0.0) for name, value in parts]
    bars = [Bar(name, f"{share:.1f} %", min(share, 100.0)) for name, share in shares]
    return Chart(f"{study.quantity}: share of the total standard deviation", bars, 30.0, "30 % (MSA)")
