"""Pictures of the study; matplotlib is imported only when they are drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from debulk._core import InputError
from debulk.recipe import Recipe
from lab.study.curves import Mark, note_marks
from lab.study.plan import AS_INSPECTED
from lab.study.summary import Line, profile

if TYPE_CHECKING:
    from lab.study.results import Results
    from lab.study.rules import Rule

# Colours that colour-blind people can also distinguish (Okabe and Ito), dark enough for thin lines on white.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#a0527f", "#8a6d00", "#505050")
MARKERS = ("o", "s", "^", "D", "v", "P")
STYLE = {
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
    "starts": "Starts: of every pocket, or further ones close to a limit",
    "stiffness": "Stiffness of the fibres",
    "nodes": "Nodes, against the reference of the same net",
    "method": "Method and tolerance, one start",
}


def pyplot() -> Any:
    """Return matplotlib.pyplot, set up to draw into files."""
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
    with plt.rc_context(STYLE):
        for name, make in (
            ("work_precision", _work_precision),
            ("methods", _methods),
            ("nodes", _nodes),
            ("minima", _minima),
            ("rules", _rules),
        ):
            figure = make(plt, results)
            figure.savefig(folder / f"{name}.png", metadata={"Software": "debulk"})
            plt.close(figure)


def _work_precision(plt: Any, results: Results) -> Any:
    """Error and wrong decisions over CPU time, with one row of panels per sweep of a setting."""
    panels = (
        ("rms_error_mean_mm", "mean RMS error, mm", None),
        ("ridge_error_mean_mm", "mean ridge error, mm", None),
        ("wrong", "paper's verdict flips, or no certificate", 0.10),
    )
    figure, axes = plt.subplots(len(_TITLES), len(panels), figsize=(14, 20))
    # The layout is set by hand, because automatic layout would shrink the panels for the long titles beside them.
    figure.subplots_adjust(left=0.06, right=0.985, bottom=0.03, top=0.945, hspace=0.3, wspace=0.2)
    noted: list[tuple[Any, list[Mark]]] = []
    for column, (field, label, highest) in enumerate(panels):
        top = highest or 1.25 * max((getattr(line, field) for line in results.lines), default=1.0)
        for row, name in enumerate(_TITLES):
            ax = axes[row, column]
            noted.append((ax, _curves(ax, _by_curve(name, results.sweep(name)), field, top)))
            ax.set_ylabel(label)
            ax.set_xlabel("CPU time a pocket, ms")
            if field == "wrong":
                ax.yaxis.set_major_formatter(lambda v, _: f"{100 * v:g} %")
            if column == 0:
                ax.set_title(_TITLES[name], loc="left", fontweight="bold")
    figure.suptitle(
        "Work and precision of the minima: one setting varied, the others as in an inspection. Filled: over the median "
        "time; hollow, dashed: over the 99th percentile.\nErrors are against the converged reference of the same net; "
        "arrows: above the axis.",
        fontsize=11,
        y=0.985,
    )
    note_marks(figure, noted)
    return figure


def _by_curve(sweep: str, found: Sequence[Line]) -> dict[str, list[Line]]:
    """Make methods and rules for the starts separate curves; any other sweep is a single curve."""
    curves: dict[str, list[Line]] = {}
    for line in found:
        if sweep == "method":
            key = line.label.partition(" ")[0].replace("_", " ")
        elif sweep == "starts":
            further = "further ones close to a limit" if " to " in line.label else "the same for all"
            key = line.label if line.label == AS_INSPECTED else further
        else:
            key = ""
        curves.setdefault(key, []).append(line)
    return curves


def _curves(ax: Any, curves: Mapping[str, Sequence[Line]], field: str, top: float) -> list[Mark]:
    """Draw one panel: each curve over the median and the 99th percentile of the time. Return the notes."""
    ax.set_xscale("log")
    ax.set_ylim(0, top)
    marks: list[Mark] = []
    for k, (name, found) in enumerate(curves.items()):
        y = np.array([getattr(line, field) for line in found])
        shown, above = np.minimum(y, 0.97 * top), y > top
        for times, style, face in (
            ([line.cpu_median_ms for line in found], "-", COLOURS[k]),
            ([line.cpu_p99_ms for line in found], "--", "white"),
        ):
            x = np.array(times)
            ax.plot(x, shown, style, color=COLOURS[k], lw=0.9, alpha=0.6)
            ax.plot(x[~above], shown[~above], MARKERS[k], mfc=face, mec=COLOURS[k], ms=5, zorder=3, clip_on=False)
            ax.plot(x[above], shown[above], marker=r"$\uparrow$", ls="", color=COLOURS[k], ms=9, zorder=3)
            if face != "white":
                marks += [
                    Mark(
                        x[i],
                        shown[i],
                        line.label.split()[-1] + (f": {100 * y[i]:.0f} %" if above[i] else ""),
                        COLOURS[k],
                    )
                    for i, line in enumerate(found)
                ]
        ax.plot([], [], "-" + MARKERS[k], color=COLOURS[k], label=name)
    ax.margins(x=0.12)
    _plain_log(ax.xaxis)
    if len(curves) > 1:
        ax.legend(fontsize=8, loc="best")
    return marks


def profile_panel(
    ax: Any, ratios: Mapping[str, Sequence[float]], styles: Sequence[tuple[int, str]], title: str
) -> None:
    """Draw Dolan-Moré profiles: the share of problems that each label solves within a factor of the fastest.

    Parameters
    ----------
    ax
        Axes to draw into.
    ratios
        Ratios as `lab.study.summary.ratios` returns them.
    styles
        Colour number and line style for each label.
    title
        Title of the panel.
    """
    widest = 1.3 * max((v for values in ratios.values() for v in values if np.isfinite(v)), default=10.0)
    widest = max(widest, ax.get_xlim()[1] if ax.get_xscale() == "log" else 10.0)
    for (label, values), (k, style) in zip(ratios.items(), styles, strict=True):
        solved = np.array([v for v in values if np.isfinite(v)])
        share = np.arange(1, solved.size + 1) / max(1, len(values))
        last = share[-1] if solved.size else 0.0
        ax.step(
            np.concatenate([[1.0], solved, [1e9]]),
            np.concatenate([[0.0], share, [last]]),
            where="post",
            color=COLOURS[k % len(COLOURS)],
            ls=style,
            lw=1.6,
            label=f"{label}: {solved.size} of {len(values)}",
        )
    ax.set_xscale("log")
    _plain_log(ax.xaxis)
    ax.set_xlim(1.0, widest)
    ax.set_ylim(0, 1.03)
    ax.yaxis.set_major_formatter(lambda v, _: f"{100 * v:g} %")
    ax.set_title(title, loc="left", fontsize=10, fontweight="bold")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2 if len(ratios) > 4 else 1, fontsize=8)


def _methods(plt: Any, results: Results) -> Any:
    """Dolan-Moré profiles over all pockets, failures included."""
    labels = [line.label for line in results.sweep("method")]
    rows = [row for row in results.rows if row.sweep == "method"]
    methods = list(dict.fromkeys(label.split()[0] for label in labels))
    dashes = (":", "--", "-", "-.")
    same = {m: [label for label in labels if label.split()[0] == m] for m in methods}
    styles = [(methods.index(m), dashes[same[m].index(label) % 4]) for label in labels for m in [label.split()[0]]]
    figure, axes = plt.subplots(1, 2, figsize=(13, 6), layout="constrained", sharey=True)
    for ax, (gap, title) in zip(
        axes,
        ((np.inf, "Certified"), (0.05, "Certified, within 5 % of the energy's fall to the reference")),
        strict=True,
    ):
        found = profile(rows, labels, gap)
        named = {label.replace("_", " ").replace(" 1e", ", tolerance 1e"): found[label] for label in labels}
        profile_panel(ax, named, styles, title)
        ax.set_xlabel("CPU time over that of the fastest on the same pocket")
    axes[0].set_ylabel("share of pockets solved within that factor")
    return figure


def _nodes(plt: Any, results: Results) -> Any:
    """Show the effect of the net's size on the answer itself."""
    table: dict[tuple[int, int], list[tuple[int, float, float]]] = {}
    for case, reference in results.references:
        table.setdefault((case.layup, case.pocket), []).append(
            (case.node_target, reference.figures.rms_mm, reference.figures.ridge_height_mm)
        )
    most = max((len(entries) for entries in table.values()), default=0)
    table = {pocket: entries for pocket, entries in table.items() if len(entries) == most}  # only those with every size
    limits = results.references[0][0].recipe.verdict if results.references else None
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.8), layout="constrained")
    for ax, column, name, limit in (
        (axes[0], 1, "RMS, mm", limits and limits.max_rms_mm),
        (axes[1], 2, "ridge height, mm", limits and limits.max_ridge_mm),
    ):
        sizes = sorted({entry[0] for entries in table.values() for entry in entries})
        for entries in table.values():
            ordered = sorted(entries)
            ax.plot([e[0] for e in ordered], [e[column] for e in ordered], color=COLOURS[0], lw=0.5, alpha=0.3)
        for share, style in ((0.25, "--"), (0.5, "-"), (0.75, "--")):
            middle = [np.quantile([e[column] for es in table.values() for e in es if e[0] == n], share) for n in sizes]
            ax.plot(sizes, middle, color=COLOURS[1], lw=1.8, ls=style)
        if limit:
            ax.axhline(limit, color="black", lw=1)
            ax.annotate(f"limit {limit:g}", (0, limit), xycoords=("axes fraction", "data"), xytext=(2, 3),
                        textcoords="offset points", fontsize=8)  # fmt: skip
        _sizes(ax, sizes)
        ax.set_title(f"{name.removesuffix(', mm').capitalize()} of the reference".replace("Rms", "RMS"), loc="left",
                     fontweight="bold")  # fmt: skip
        ax.set_ylabel(name)
    axes[0].plot([], [], color=COLOURS[0], lw=0.5, label="a pocket")
    axes[0].plot([], [], color=COLOURS[1], lw=1.8, label="median")
    axes[0].plot([], [], color=COLOURS[1], lw=1.8, ls="--", label="quartiles")
    axes[0].legend(loc="upper right", fontsize=8)
    ax = axes[2]
    found = results.sweep("nodes")
    x = np.array([int(line.label) for line in found])
    ax.plot(x, [line.cpu_median_ms for line in found], "o-", color=COLOURS[2], label="median")
    ax.plot(x, [line.cpu_p99_ms for line in found], "o--", color=COLOURS[2], mfc="white", label="99th percentile")
    ax.set_yscale("log")
    _plain_log(ax.yaxis)
    _sizes(ax, list(x))
    ax.set_ylabel("CPU time a pocket, ms")
    ax.set_title("Time as inspected, without the net", loc="left", fontweight="bold")
    ax.legend(loc="upper left", fontsize=8)
    return figure


def _sizes(ax: Any, sizes: Sequence[int]) -> None:
    ax.set_xscale("log")
    ax.set_xticks(sizes, [str(n) for n in sizes])
    ax.minorticks_off()
    ax.set_xlabel("nodes a net")


def _plain_log(axis: Any) -> None:
    """Write out tick labels: 1, 2, 5 per decade or, over more than two and a half decades, 1 per decade."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    subs = (1.0, 2.0, 5.0) if low > 0 and high / low < 300 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axis.set_minor_formatter(NullFormatter())


def _minima(plt: Any, results: Results) -> Any:
    """Show what more starts find, for each size of perturbation."""
    panels = (
        ("rms_range_mm", "Range of the RMS over the starts", "mm"),
        ("ridge_range_mm", "Range of the ridge height over the starts", "mm"),
        ("undecided", "Called UNDECIDED", "share of pockets"),
        ("flipped", "Decided otherwise than the least energy", "share of pockets"),
    )
    figure, axes = plt.subplots(2, 2, figsize=(11.5, 8.5), layout="constrained")
    for ax, (field, title, unit) in zip(axes.flat, panels, strict=True):
        for k, amplitude in enumerate(sorted({g.amplitude for g in results.growth})):
            found = [g for g in results.growth if g.amplitude == amplitude]
            x = [g.starts for g in found]
            ax.plot(
                x,
                [getattr(g, field) for g in found],
                "-" + MARKERS[k],
                ms=4,
                color=COLOURS[k],
                label=f"up to {amplitude:g} spacings",
            )
            if field.endswith("_mm"):
                high = [getattr(g, field.replace("_mm", "_p90_mm")) for g in found]
                ax.plot(x, high, "--" + MARKERS[k], ms=3, mfc="white", lw=1, color=COLOURS[k])
        if field == "undecided":
            every = np.mean([r.verdict_of_all == "undecided" for _, r in results.solved])
            ax.axhline(every, color="black", lw=1)
            ax.annotate("all starts of all sizes", (1, every), xytext=(0, -10), textcoords="offset points", fontsize=8)
        if not field.endswith("_mm"):
            ax.yaxis.set_major_formatter(lambda v, _: f"{100 * v:.3g} %")
        ax.set_title(title, loc="left", fontweight="bold")
        ax.set_ylabel(unit)
        counts = sorted({g.starts for g in results.growth})
        ax.set_xscale("log")
        ax.set_xticks(counts, [str(n) for n in counts])
        ax.minorticks_off()
        ax.set_xlim(0.95, 1.05 * max(counts))
        ax.set_ylim(bottom=0)
        ax.set_xlabel("starts of every pocket")
    axes[0, 0].plot([], [], "-", color="black", label="mean of the pockets")
    axes[0, 0].plot([], [], "--", lw=1, color="black", label="90 % of the pockets below")
    axes[0, 0].legend(fontsize=8, title="starts perturbed by", alignment="left")
    return figure


def _rules(plt: Any, results: Results) -> Any:
    """Show what a rule for the number of starts costs and how well it decides."""
    panels = (
        ("contrary", "Starts that end on the other side of the decisions", "share of all starts"),
        ("overconfident", "Decided, though undecidable", "share of pockets"),
        ("undecided", "Called UNDECIDED", "share of pockets"),
    )
    usual = Recipe()
    curves: dict[str, list[Rule]] = {}
    for rule in results.rules:
        if rule.rms_margin_mm != usual.verdict.rms_margin_mm:
            continue
        if rule.starts == rule.most_starts:
            curves.setdefault("the same for all", []).append(rule)
        elif rule.close_rms_mm == usual.solve.close_rms_mm:
            curves.setdefault(f"{rule.starts}, further ones close to a limit", []).append(rule)
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.8), layout="constrained")
    noted = []
    for ax, (field, title, unit) in zip(axes, panels, strict=True):
        marks: list[Mark] = []
        for k, (name, found) in enumerate(curves.items()):
            x, y = [r.cpu_mean_ms for r in found], [getattr(r, field) for r in found]
            ax.plot(x, y, "-" + MARKERS[k], ms=5, lw=1, color=COLOURS[k], label=name)
            marks += [Mark(a, b, f"{r.most_starts}", COLOURS[k]) for a, b, r in zip(x, y, found, strict=True)]
        ax.set_xscale("log")
        ax.set_ylim(bottom=0)
        ax.margins(y=0.1)
        _plain_log(ax.xaxis)
        ax.yaxis.set_major_formatter(lambda v, _: f"{100 * v:.3g} %")
        ax.set_title(title, loc="left", fontweight="bold")
        ax.set_xlabel("mean CPU time a pocket, ms")
        ax.set_ylabel(unit)
        noted.append((ax, marks))
    axes[0].legend(fontsize=8, title="starts (the number beside a mark: the most)", alignment="left")
    note_marks(figure, noted)
    return figure
