"""The report of an inspection, to be shown and kept."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from debulk.arguments import typed
from debulk.results import codec, report_text, saving
from debulk.results.fitting import check_fits
from debulk.results.report import FORMAT, LeftOut, PocketNet, PocketReport, ReportData, SolveReport
from debulk.verdict import Verdict

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["LeftOut", "PocketNet", "PocketReport", "Report", "SolveReport", "Verdict"]


class Report(ReportData):
    """The outcome of one inspection; its values are those of `debulk.results.report.ReportData`.

    Examples
    --------
    >>> report = Report(verdict=Verdict.CEASE, reason="no pocket", pockets=(), coverage=0.995)
    >>> report.passed
    True
    >>> print(report.table().splitlines()[0])
    CEASE: no pocket
    """

    def table(self) -> str:
        """Return the verdict and a line for each pocket as plain text."""
        return report_text.table(self)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"Report({self.verdict.name}, {len(self.pockets)} pockets)"

    def _repr_html_(self) -> str:
        from debulk.results.notebook import report_html

        return report_html(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the pockets as a table of pandas; needs the extra "pandas".

        Returns
        -------
        pandas.DataFrame
            A row for each pocket, its number being the index; columns as in the .csv, units in their names. What a
            pocket does not have is NaN, or None where the column holds words.

        Raises
        ------
        InputError
            If pandas is not installed: names the command that installs it.
        """
        from debulk.results.frame import to_dataframe

        return to_dataframe(self)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the height map with the pockets over it; needs the extra "plot" (Matplotlib).

        Pockets have their verdict's colour, their number, the height of the ridge that their verdict comes from where
        there is one, and a white line where the section across the worst ridge of the minimum runs.

        Parameters
        ----------
        ax
            Axes to draw into. None: those of a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            Mold frame, mm; ``report.plot().figure.savefig("map.png")`` keeps the picture.

        Raises
        ------
        InputError
            If Matplotlib is not installed: names the command that installs it.
        """
        from debulk.results.plotting import plot

        return plot(self, ax)

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the report.

        Parameters
        ----------
        path
            Ends in .json (all of it, :meth:`load` reads it back to the last bit), .csv (a line for each pocket) or
            .html (one page that needs nothing else).

        Raises
        ------
        InputError
            If the ending is another, or the file cannot be written.
        """

        def html() -> str:
            from debulk.page.report import page

            return page(self)

        json, csv = (lambda: codec.dumps(self, FORMAT)), (lambda: report_text.csv_text(self))
        saving.save(path, {".json": json, ".csv": csv, ".html": html})

    @classmethod
    @typed
    def load(cls, path: str | PathLike[str]) -> Report:
        """Read a report that :meth:`save` wrote as .json.

        Parameters
        ----------
        path
            Of that file.

        Raises
        ------
        InputError
            If the file is not such a report, was cut off, lacks a value, is of another schema, or its verdict does not
            follow from its pockets, or theirs from their figures and the recipe's limits.
        """
        return saving.load(cls, path, FORMAT, check_fits)
