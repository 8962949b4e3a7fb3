"""A finding: what one check of an inspection found, and how good the layup's verdict can be at best with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from debulk.results.check_texts import text_of
from debulk.verdict import Verdict


class Reason(NamedTuple):
    """A sentence that says what is wrong, and what it asks for."""

    text: str
    remedy: str


@dataclass(frozen=True)
class Finding:
    """What one check found."""

    check: str
    """Name of the check, such as ``"level"`` or ``"holes"``. Programs test this name instead of reading the reason.
    ``"deadline"`` is the name of whatever time did not allow."""
    at_best: Verdict | None
    """The layup's verdict can be no better than this. None: the finding is only mentioned."""
    reason: str
    """What was found and what to do about it, in words."""
    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    """`measured`, `limit`, `unit`: the figure that the check compared, its limit, and the unit of both; None and empty
    if there is no such figure."""
    place_mm: tuple[float, float] | None = None
    """(x, y) in the mold's frame; None: it is not about one place."""
    pocket: int | None = None
    """Number of the pocket that it is about; None: it is not about a pocket."""
    remedy: str = ""
    """What to do about it, if that is more than what the list of checks says for all findings of the check."""

    @property
    def asks(self) -> str:
        """What to do about it: its own remedy, or that of its check."""
        text = text_of(self.check)
        return self.remedy or (text.remedy if text else "scan again")


def unexpected(error: Exception) -> str:
    """Name an error that nobody foresaw, on one line, and ask for a report of it."""
    what = " ".join(str(error).split())
    return f"{type(error).__name__}{': ' if what else ''}{what}; please report it"
