"""The report of an inspection, to be shown and kept."""

from __future__ import annotations

from os import PathLike

from debulk.results import codec, report_text, saving
from debulk.results.fitting import check_fits
from debulk.results.report import FORMAT, LeftOut, PocketNet, PocketReport, ReportData, SolveReport
from debulk.verdict import Verdict

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
    def load(cls, path: str | PathLike[str]) -> Report:
        """Read a report that :meth:`save` wrote as .json.

        Raises
        ------
        InputError
            If the file is not such a report, was cut off, lacks a value, is of another schema, or its verdict does not
            follow from its pockets, or theirs from their figures and the recipe's limits.
        """
        return saving.load(cls, path, FORMAT, check_fits)
