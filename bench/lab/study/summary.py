"""Tables with one line per setting, from the rows of all pockets."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from lab.study.runs import Row


@dataclass(frozen=True)
class Line:
    """Summary of a setting over all pockets. Errors count every pocket, including those without a certificate."""

    sweep: str
    label: str
    pockets: int
    failed: int  # pockets without a certificate
    starts_mean: float
    net_median_ms: float
    cpu_median_ms: float
    cpu_p99_ms: float
    iterations_median: float
    iterations_p99: float
    rms_error_mean_mm: float
    rms_error_p90_mm: float
    ridge_error_mean_mm: float
    ridge_error_p90_mm: float
    energy_gap_mean: float
    length_error_max: float
    undecided: float  # share of pockets
    flipped: float  # decided differently from the reference
    overconfident: float  # decided where the reference's starts lie on both sides of a limit
    wrong: float  # flipped, or without a certificate
    crease: float
    rms_mean_mm: float
    ridge_mean_mm: float


def lines(rows: Sequence[Row]) -> list[Line]:
    """One line per sweep and label, in the order in which they first occur."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.sweep, row.label), []).append(row)
    return [_line(sweep, label, group) for (sweep, label), group in groups.items()]


def _line(sweep: str, label: str, rows: list[Row]) -> Line:
    def of(name: str) -> Any:
        return np.array([getattr(row, name) for row in rows], dtype=float)

    def high(name: str, share: float) -> float:
        # The value is that of the nearest pocket above, not an interpolated one.
        return float(np.nanquantile(of(name), share, method="higher"))

    return Line(
        sweep=sweep,
        label=label,
        pockets=len(rows),
        failed=sum(not row.certified for row in rows),
        starts_mean=float(of("starts").mean()),
        net_median_ms=float(np.median(of("net_ms"))),
        cpu_median_ms=float(np.median(of("cpu_ms"))),
        cpu_p99_ms=high("cpu_ms", 0.99),
        iterations_median=float(np.median(of("iterations"))),
        iterations_p99=high("iterations", 0.99),
        rms_error_mean_mm=float(np.nanmean(of("rms_error_mm"))),
        rms_error_p90_mm=high("rms_error_mm", 0.9),
        ridge_error_mean_mm=float(np.nanmean(of("ridge_error_mm"))),
        ridge_error_p90_mm=high("ridge_error_mm", 0.9),
        energy_gap_mean=float(np.nanmean(of("energy_gap"))),
        length_error_max=float(of("length_error").max()),
        undecided=float(np.mean([row.verdict == "undecided" for row in rows])),
        flipped=float(of("flipped").mean()),
        overconfident=float(of("overconfident").mean()),
        wrong=float(np.mean([row.flipped or not row.certified for row in rows])),
        crease=float(np.mean([row.verdict == "crease" for row in rows])),
        rms_mean_mm=float(of("rms_mm").mean()),
        ridge_mean_mm=float(of("ridge_mm").mean()),
    )


def profile(rows: Sequence[Row], labels: Sequence[str], most_gap: float) -> dict[str, list[float]]:
    """Dolan-Moré profile of a sweep's rows, in the form of `ratios`.

    A pocket counts as solved if it is certified and misses at most `most_gap` of the energy's fall. Pockets that were
    not run with all of the labels are left out.
    """
    times: dict[tuple[int, int], dict[str, float]] = {}
    for row in rows:
        if row.label in labels:
            good = row.certified and not row.energy_gap > most_gap
            times.setdefault((row.layup, row.pocket), {})[row.label] = row.cpu_ms if good else np.inf
    return ratios([t for t in times.values() if len(t) == len(labels)], labels)


def ratios(times: Sequence[Mapping[str, float]], labels: Sequence[str]) -> dict[str, list[float]]:
    """For each label, the sorted ratios of its times to the best label's, infinite for failures.

    `times` has one mapping per problem, with infinity where it was not solved. A problem that no label solves counts
    against all of them.
    """
    found: dict[str, list[float]] = {label: [] for label in labels}
    for t in times:
        best = min(t.values())
        for label in labels:
            found[label].append(t[label] / best if np.isfinite(t[label]) else np.inf)
    return {label: sorted(values) for label, values in found.items()}


def write_csv(path: Path, records: Sequence[Any]) -> None:
    """Write dataclasses or mappings, one per line, with floats to five digits."""
    tables = [r if isinstance(r, dict) else asdict(r) for r in records]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(tables[0]) if tables else [], lineterminator="\n")
        writer.writeheader()
        for table in tables:
            writer.writerow({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in table.items()})


def text(title: str, records: Sequence[Any], columns: dict[str, tuple[str, str]]) -> str:
    """Return a plain table; `columns` maps each field to (heading, format)."""
    assert not records or set(columns) <= {f.name for f in fields(records[0])}
    cells = [[heading for heading, _ in columns.values()]]
    cells += [[format(getattr(r, name), spec) for name, (_, spec) in columns.items()] for r in records]
    widths = [max(len(row[k]) for row in cells) for k in range(len(columns))]
    body = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]
    return "\n".join([title, "", *("  " + line for line in body), ""])
