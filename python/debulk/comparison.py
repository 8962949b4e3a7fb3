"""The comparison of predictions with measurements, for display and for saving."""

from __future__ import annotations

from os import PathLike

from debulk.arguments import typed
from debulk.results import codec, comparison_text, saving
from debulk.results.agreement import Agreement, agreement
from debulk.results.comparison import FORMAT, ComparisonData, PocketComparison

__all__ = ["Agreement", "Comparison", "PocketComparison", "agreement"]


class Comparison(ComparisonData):
    """A report compared with a scan after debulking.

    Its fields are those of `debulk.results.comparison.ComparisonData`.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> pose = layup.mold_from_scanner
    >>> inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=pose)
    >>> comparison = inspector.compare(inspector.inspect(layup.scan), layup.debulked().scan)
    >>> comparison.pockets[0].measured
    <Verdict.CEASE: 'cease'>
    """

    def table(self) -> str:
        """Return a line for each pocket, the outcome counts, and the hit rate with its interval as plain text."""
        return comparison_text.table(self)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"Comparison({len(self.pockets)} pockets, {self.agreement})"

    def _repr_html_(self) -> str:
        from debulk.results.notebook import comparison_html

        return comparison_html(self)

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the comparison.

        Parameters
        ----------
        path
            Name of the file, which ends in .json (everything; :meth:`load` reads it back), .csv (a line for each
            pocket) or .html (one self-contained page).

        Raises
        ------
        InputError
            If the name has another ending, or the file cannot be written.
        """

        def html() -> str:
            from debulk.page.comparison import page

            return page(self)

        json, csv = (lambda: codec.dumps(self, FORMAT)), (lambda: comparison_text.csv_text(self))
        saving.save(path, {".json": json, ".csv": csv, ".html": html})

    @classmethod
    @typed
    def load(cls, path: str | PathLike[str]) -> Comparison:
        """Read a comparison that :meth:`save` wrote as .json, in this or any earlier version.

        Parameters
        ----------
        path
            Name of that file.

        Raises
        ------
        InputError
            If the file is not a comparison, was cut off, or is of a newer schema.
        """
        return saving.load(cls, path, FORMAT)
