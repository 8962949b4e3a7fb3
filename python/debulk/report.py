"""The report of an inspection, for display and for saving."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

from debulk._core import InputError
from debulk.arguments import typed
from debulk.results import codec, report_csv, report_text, saving
from debulk.results.fitting import check_fits
from debulk.results.report import FORMAT, LeftOut, PocketNet, PocketReport, ReportData, SolveReport
from debulk.results.rework import rework
from debulk.rework import Handling, Rework
from debulk.verdict import Verdict

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["LeftOut", "PocketNet", "PocketReport", "Report", "SolveReport", "Verdict"]

_LATER = "_later"


class Report(ReportData):
    """The outcome of one inspection; its fields are those of `debulk.results.report.ReportData`.

    Examples
    --------
    >>> report = Report(verdict=Verdict.CEASE, reason="no pocket", pockets=(), coverage=0.995)
    >>> report.passed
    True
    >>> print(report.table().splitlines()[0])
    CEASE: no pocket
    """

    @property
    def later(self) -> Callable[[], Report] | None:
        """What makes the report with all nets and minima; None: nothing is missing, or nothing can be added."""
        return self.__dict__.get(_LATER)

    def settle(self) -> Report:
        """Return the report with the nets and minima that its verdict did not need.

        With ``solve.when = "needed"``, the default, an inspection lays no net on a pocket that the excess of its fibres
        decides, and computes no minimum of it. They are made here, once, and are those of ``solve.when = "always"`` to
        the last bit, as are reasons and `left_out`. Whatever shows or saves a report does so by itself, and reading
        one such field of a pocket makes that pocket's. If the net disagrees with a verdict, the worse of the two holds
        here, and a finding ``audit`` says so.

        It takes its own time: the inspection's deadline does not count. Until then the report holds the heights round
        its pockets, some 14 MB at 20 million points; :meth:`as_decided` lets go of them. Copies by pickle, and reports
        in a history to which an inspection added them, hold what decided, and cannot be settled.

        Returns
        -------
        Report
            This report itself if nothing is missing, or nothing can be added. A pocket on which no net can be laid, or
            whose net does not close its rim, is INVALID in it.

        Examples
        --------
        >>> import debulk
        >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
        >>> pose = layup.mold_from_scanner
        >>> report = debulk.inspect(layup.scan, layup.reference, None, layup.ply_outline, mold_from_scanner=pose)
        >>> [any(p.net is None for p in one.pockets) for one in (report.as_decided(), report, report.settle())]
        [True, False, False]
        """
        if self.later is None:
            return self
        full = self.later()
        names = ("verdict", "reason", "findings", "pockets", "left_out", "unseen", "crease_probability")
        return dataclasses.replace(self, **{name: getattr(full, name) for name in names})

    def as_decided(self) -> Report:
        """Return the report as its verdict was reached: nets and minima that were not needed are None, and stay so."""
        return dataclasses.replace(self, pockets=tuple(pocket.as_decided() for pocket in self.pockets))

    def settled_by(self, later: Callable[[], Report] | None) -> Report:
        """Have `settle` take what is missing from the report that this function makes; returns this report."""
        self.__dict__[_LATER] = later  # beside the fields, which are what is saved and compared
        return self

    def changed(self, **changes: Any) -> Report:
        """Return the report with other values of some fields; unlike with `dataclasses.replace` it can be settled."""
        return dataclasses.replace(self, **changes).settled_by(self.later)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != _LATER}

    @typed
    def rework(self, handling: Handling | None = None) -> Rework:
        """Plan how the length leaves that would become ridges (docs/rework.md).

        Parameters
        ----------
        handling
            What can be held, and how firmly the ply sticks; None: `debulk.rework.Handling()`.

        Returns
        -------
        Rework
            Its moves, in their order; as text by `str`, as JSON types by `to_dict`. Every fibre over a pocket that
            creases keeps at most the excess of a ridge as high as the limit less ``verdict.ridge_margin_mm``.

        Raises
        ------
        InputError
            If the report has no fibre lines: they are read with ``verdict.criterion = "excess"`` from schema 13 on.

        Examples
        --------
        >>> import debulk
        >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
        >>> pose = layup.mold_from_scanner
        >>> report = debulk.inspect(layup.scan, layup.reference, None, layup.ply_outline, mold_from_scanner=pose)
        >>> worst = report.rework().of(2)[0]
        >>> worst.by, worst.length_mm > 2, round(worst.towards_deg)
        ('lift', True, 90)
        """
        if (planned := rework(self, handling)) is None:
            raise InputError("report: it has no fibre lines, so that no rework follows from it: inspect the scan again")
        return planned

    def table(self) -> str:
        """Return the verdict and a line for each pocket as plain text."""
        return report_text.table(self.settle())

    def to_dict(self) -> Mapping[str, Any]:
        """Return the report, settled, as JSON types, as :meth:`save` writes it."""
        return codec.encode(self.settle(), FORMAT)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"Report({self.verdict.name}, {len(self.pockets)} pockets)"

    def _repr_html_(self) -> str:
        from debulk.results.notebook import report_html

        return report_html(self.settle())

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the pockets as a pandas table; needs the extra "pandas".

        Returns
        -------
        pandas.DataFrame
            A row for each pocket, indexed by its number. The columns are those of the .csv, with units in their names.
            A value that a pocket does not have is NaN, or None in a column of words.

        Raises
        ------
        InputError
            If pandas is not installed; the message names the command that installs it.
        """
        from debulk.results.frame import to_dataframe

        return to_dataframe(self.settle())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the height map with the pockets over it; needs the extra "plot" (Matplotlib).

        Each pocket is drawn in its verdict's colour, with its number and, if it has one, the height of the ridge that
        decides its verdict. The predicted ridges are drawn as on the page, thin where they stay below the limit.

        Parameters
        ----------
        ax
            Axes to draw into; None means those of a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            Axes in the mold frame, mm; ``report.plot().figure.savefig("map.png")`` saves the picture.

        Raises
        ------
        InputError
            If Matplotlib is not installed; the message names the command that installs it.
        """
        from debulk.results.plotting import plot

        return plot(self.settle(), ax)

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the report.

        Parameters
        ----------
        path
            Name of the file, which ends in .json (everything; :meth:`load` reads it back to the last bit), .csv (a line
            for each pocket) or .html (one self-contained page). The report is settled for it, see :meth:`settle`;
            ``report.as_decided().save(...)`` writes only what the verdict needed.

        Raises
        ------
        InputError
            If the name has another ending, or the file cannot be written.
        """

        def html() -> str:
            from debulk.page.report import page

            return page(self.settle())

        json, csv = (lambda: codec.dumps(self.settle(), FORMAT)), (lambda: report_csv.csv_text(self.settle()))
        saving.save(path, {".json": json, ".csv": csv, ".html": html})

    @classmethod
    @typed
    def load(cls, path: str | PathLike[str]) -> Report:
        """Read a report that :meth:`save` wrote as .json, in this or any earlier version.

        A report of an earlier schema is brought to the present one, with a warning in it: its verdicts are those of the
        rules of its time, and are not checked against its figures.

        Parameters
        ----------
        path
            Name of that file.

        Raises
        ------
        InputError
            If the file is not such a report, was cut off, misses a value or is of a newer schema; if its verdict does
            not follow from its pockets, or their verdicts do not follow from their figures and the recipe's limits.
        """
        return saving.load(cls, path, FORMAT, check_fits)
