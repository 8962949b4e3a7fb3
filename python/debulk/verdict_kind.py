"""The four outcomes of an inspection, in one place for every room that names them."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum


class Verdict(StrEnum):
    """What the inspection says about a pocket, or about the whole layup.

    Examples
    --------
    >>> Verdict.worst([Verdict.CEASE, Verdict.CREASE, Verdict.UNDECIDED])
    <Verdict.CREASE: 'crease'>
    """

    CEASE = "cease"  # closes under vacuum
    UNDECIDED = "undecided"  # too near a limit, or the solution could not be certified
    CREASE = "crease"  # leaves a wrinkle
    INVALID = "invalid"  # cannot be judged

    @property
    def severity(self) -> int:
        """0 for CEASE up to 3 for INVALID; a layup takes the verdict of its worst pocket."""
        return list(Verdict).index(self)

    @classmethod
    def worst(cls, verdicts: Iterable[Verdict]) -> Verdict:
        """Return the most severe of the verdicts, CEASE where there are none."""
        return max(verdicts, key=lambda verdict: verdict.severity, default=cls.CEASE)
