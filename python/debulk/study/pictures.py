"""Pictures of the study; matplotlib is imported when they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from debulk._core import InputError
from debulk.study.summary import Line, profile

if TYPE_CHECKING:
    from debulk.study.results import Results

_COLOURS = ("#0b5fa5", "#c8500a", "#3a7d34", "#7b3fa0", "#8a6d00", "#606060")
_STYLE = {
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "savefig.dpi": 120,
}
_TITLES = {
    "tolerance": "Tolerance",
    "starts": "Starts",
    "stiffness": "Stiffness of the fibres",
    "nodes": "Nodes, against the reference of the same net",
    "method": "Method and tolerance, one start",
}


def pyplot() -> Any:
    """matplotlib.pyplot, drawing into files."""
    try:
        import matplotlib
    except ImportError:
        raise InputError("pictures: matplotlib is missing: pip install debulk[bench], or take pictures=False") from None
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt


def draw(results: Results, folder: Path) -> None:
    """Draw all pictures into the folder."""
    plt = pyplot()
    with plt.rc_context(_STYLE):
        for name, make in (
            ("work_precision", _work_precision),
            ("methods", _methods),
            ("nodes", _nodes),
            ("minima", _minima),
        ):
            figure = make(plt, results)
            figure.savefig(folder / f"{name}.png", metadata={"Software": "debulk"})
            plt.close(figure)


def _work_precision(plt: Any, results: Results) -> Any:
    """Error and flips over CPU time, a row a setting."""
    names = ("tolerance", "starts", "stiffness", "nodes", "method")
    panels = (
        ("rms_error_mean_mm", "mean RMS error, mm"),
        ("ridge_error_mean_mm", "mean ridge error, mm"),
        ("flipped", "pockets whose verdict flips"),
    )
    figure, axes = plt.subplots(len(names), len(panels), figsize=(13, 15), layout="constrained", sharey="col")
    for row, (name, colour) in enumerate(zip(names, _COLOURS, strict=False)):
        found = results.sweep(name)
        for column, (field, label) in enumerate(panels):
            ax = axes[row, column]
            _curve(ax, found, field, colour)
            ax.set_ylabel(label)
            ax.set_xscale("log")
            _plain_log(ax.xaxis)
            if field == "flipped":
                ax.yaxis.set_major_formatter(lambda v, _: f"{100 * v:g} %")
            else:
                ax.set_yscale("log")
                _plain_log(ax.yaxis)
            if column == 0:
                ax.set_title(_TITLES[name], loc="left", fontweight="bold")
            if row == len(names) - 1:
                ax.set_xlabel("CPU time a pocket, ms")
    axes[0, 2].set_ylim(bottom=0)
    figure.suptitle(
        "Work and precision: one setting varied, the others by the recipe; "
        "bars reach from the median time to the 99th percentile",
        fontsize=11,
    )
    return figure


def _curve(ax: Any, found: Sequence[Line], field: str, colour: str) -> None:
    x = np.array([line.cpu_median_ms for line in found])
    high = np.array([line.cpu_p99_ms for line in found])
    y = np.array([getattr(line, field) for line in found])
    ax.plot(x, y, "-", color=colour, lw=0.8, alpha=0.5)
    ax.hlines(y, x, high, color=colour, lw=1, alpha=0.35)
    failed = np.array([line.failed for line in found]) > 0
    ax.plot(x[~failed], y[~failed], "o", color=colour, ms=4.5)
    ax.plot(x[failed], y[failed], "o", mfc="white", mec=colour, ms=5.5)
    for k, line in enumerate(found):
        note = line.label.replace("interior_point", "ip") + (f" ({line.failed} failed)" if line.failed else "")
        ax.annotate(note, (x[k], y[k]), xytext=(4, 5 if k % 2 == 0 else -11), textcoords="offset points", fontsize=7.5)


def _methods(plt: Any, results: Results) -> Any:
    """Dolan-Moré profiles over all pockets, failures included."""
    labels = [line.label for line in results.sweep("method")]
    rows = [row for row in results.rows if row.sweep == "method"]
    methods = list(dict.fromkeys(label.split()[0] for label in labels))
    figure, axes = plt.subplots(1, 2, figsize=(12, 4.8), layout="constrained", sharey=True)
    for ax, (gap, title) in zip(
        axes, ((np.inf, "certified"), (0.01, "certified, within 1 % of the reference's energy fall")), strict=True
    ):
        ratios = profile(rows, labels, gap)
        widest = max((v for values in ratios.values() for v in values if np.isfinite(v)), default=10.0)
        for label, values in ratios.items():
            method, tolerance = label.split()
            k = methods.index(method)
            same = [other for other in labels if other.split()[0] == method]
            style = (":", "--", "-", "-.")[same.index(label) % 4]
            solved = np.array([v for v in values if np.isfinite(v)])
            share = np.arange(1, solved.size + 1) / max(1, len(values))
            x = np.concatenate([[1.0], solved, [1.3 * widest]]) if solved.size else np.array([1.0, 1.3 * widest])
            y = np.concatenate([[0.0], share, [share[-1]]]) if solved.size else np.zeros(2)
            ax.step(
                x,
                y,
                where="post",
                color=_COLOURS[k % len(_COLOURS)],
                ls=style,
                lw=1.5,
                label=f"{method}, {tolerance}: {solved.size} of {len(values)}",
            )
        ax.set_xscale("log")
        _plain_log(ax.xaxis)
        ax.set_xlim(1.0, 1.3 * widest)
        ax.set_ylim(0, 1.03)
        ax.set_title(f"solved: {title}", loc="left", fontweight="bold")
        ax.set_xlabel("CPU time over that of the fastest")
        ax.legend(loc="lower right", fontsize=8, title="method, tolerance: pockets solved")
    axes[0].set_ylabel("share of pockets solved within that factor")
    axes[0].yaxis.set_major_formatter(lambda v, _: f"{100 * v:g} %")
    return figure


def _nodes(plt: Any, results: Results) -> Any:
    """Show what the net's size does to the answer itself."""
    table: dict[tuple[int, int], list[tuple[int, float, float]]] = {}
    for case, reference in results.references:
        table.setdefault((case.layup, case.pocket), []).append(
            (case.node_target, reference.figures.rms_mm, reference.figures.ridge_mm)
        )
    limits = results.references[0][0].recipe.verdict if results.references else None
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.6), layout="constrained")
    for ax, column, name, limit in (
        (axes[0], 1, "RMS, mm", limits and limits.max_rms_mm),
        (axes[1], 2, "ridge height, mm", limits and limits.max_ridge_mm),
    ):
        sizes = sorted({entry[0] for entries in table.values() for entry in entries})
        for entries in table.values():
            ordered = sorted(entries)
            ax.plot([e[0] for e in ordered], [e[column] for e in ordered], color=_COLOURS[0], lw=0.5, alpha=0.25)
        for share, style in ((0.25, "--"), (0.5, "-"), (0.75, "--")):
            middle = [np.quantile([e[column] for es in table.values() for e in es if e[0] == n], share) for n in sizes]
            ax.plot(sizes, middle, color=_COLOURS[1], lw=1.8, ls=style)
        if limit:
            ax.axhline(limit, color="black", lw=1)
            ax.annotate("limit", (sizes[-1], limit), xytext=(0, 3), textcoords="offset points", ha="right", fontsize=8)
        _sizes(ax, sizes)
        ax.set_title(f"{name} of the reference, each pocket", loc="left", fontweight="bold")
        ax.set_ylabel(name)
    axes[0].plot([], [], color=_COLOURS[1], lw=1.8, label="median")
    axes[0].plot([], [], color=_COLOURS[1], lw=1.8, ls="--", label="quartiles")
    axes[0].legend(loc="upper right", fontsize=8)
    ax = axes[2]
    found = results.sweep("nodes")
    x = np.array([int(line.label) for line in found])
    ax.plot(x, [line.cpu_median_ms for line in found], "o-", color=_COLOURS[2], label="median")
    ax.plot(x, [line.cpu_p99_ms for line in found], "o--", color=_COLOURS[2], mfc="white", label="99th percentile")
    ax.set_yscale("log")
    _plain_log(ax.yaxis)
    _sizes(ax, list(x))
    ax.set_title("CPU time a pocket, the recipe's starts, ms", loc="left", fontweight="bold")
    ax.legend(loc="upper left", fontsize=8)
    return figure


def _sizes(ax: Any, sizes: Sequence[int]) -> None:
    ax.set_xscale("log")
    ax.set_xticks(sizes, [str(n) for n in sizes])
    ax.minorticks_off()
    ax.set_xlabel("nodes a net")


def _plain_log(axis: Any) -> None:
    """Ticks 1, 2, 5 a decade, written out."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axis.set_minor_formatter(NullFormatter())


def _minima(plt: Any, results: Results) -> Any:
    """Show what more starts find, for each size of perturbation."""
    panels = (
        ("rms_range_mm", "range of the RMS over the starts, mm"),
        ("ridge_range_mm", "range of the ridge height, mm"),
        ("undecided", "pockets called UNDECIDED"),
        ("flipped", "pockets decided otherwise than the least energy"),
    )
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    for ax, (field, title) in zip(axes.flat, panels, strict=True):
        for k, amplitude in enumerate(sorted({g.amplitude for g in results.growth})):
            found = [g for g in results.growth if g.amplitude == amplitude]
            x = [g.starts for g in found]
            ax.plot(
                x,
                [getattr(g, field) for g in found],
                "o-",
                ms=4,
                color=_COLOURS[k],
                label=f"{amplitude:g} spacings, mean",
            )
            if field.endswith("_mm"):
                high = [getattr(g, field.replace("_mm", "_p90_mm")) for g in found]
                ax.plot(x, high, "--", lw=1, color=_COLOURS[k], label="90 % of pockets below")
        if field == "undecided":
            every = np.mean([r.verdict_of_all == "undecided" for _, r in results.solved])
            ax.axhline(every, color="black", lw=1)
            ax.annotate("all starts of all sizes", (1, every), xytext=(0, 3), textcoords="offset points", fontsize=8)
        if not field.endswith("_mm"):
            ax.yaxis.set_major_formatter(lambda v, _: f"{100 * v:.3g} %")
        ax.set_title(title, loc="left", fontweight="bold")
        ax.set_xscale("log")
        ax.set_xticks([1, 2, 3, 4, 6, 8, 12, 16, 24, 37], ["1", "2", "3", "4", "6", "8", "12", "16", "24", "37"])
        ax.minorticks_off()
        ax.set_xlim(0.95, 1.05 * max(g.starts for g in results.growth))
        ax.set_ylim(bottom=0)
    for ax in axes[1]:
        ax.set_xlabel("starts")
    axes[0, 0].legend(fontsize=8)
    return figure
