"""The report of an inspection, for display and for saving."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from debulk.arguments import typed
from debulk.results import codec, report_csv, report_text, saving
from debulk.results.fitting import check_fits
from debulk.results.report import FORMAT, LeftOut, PocketNet, PocketReport, ReportData, SolveReport
from debulk.verdict import Verdict

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["LeftOut", "PocketNet", "PocketReport", "Report", "SolveReport", "Verdict"]


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

        return to_dataframe(self)

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

        return plot(self, ax)

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the report.

        Parameters
        ----------
        path
            Name of the file, which ends in .json (everything; :meth:`load` reads it back to the last bit), .csv (a line
            for each pocket) or .html (one self-contained page).

        Raises
        ------
        InputError
            If the name has another ending, or the file cannot be written.
        """

        def html() -> str:
            from debulk.page.report import page

            return page(self)

        json, csv = (lambda: codec.dumps(self, FORMAT)), (lambda: report_csv.csv_text(self))
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
