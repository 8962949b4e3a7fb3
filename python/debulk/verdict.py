"""Will a pocket crease or cease? Criteria, the verdict of a pocket and of a layup, and the reason in one sentence."""

from __future__ import annotations

from enum import Enum

__all__ = ["Verdict"]


class Verdict(Enum):
    """What debulking will make of an air pocket, or of a layup.

    Examples
    --------
    >>> Verdict.CEASE.value
    'cease'
    >>> Verdict("crease") is Verdict.CREASE
    True
    """

    CEASE = "cease"
    """The pocket closes within the criteria, and a certificate says so."""
    CREASE = "crease"
    """A ridge or a roughness above the criteria remains."""
    UNDECIDED = "undecided"
    """The evidence lies on both sides of a limit, or is not certified."""
    INVALID = "invalid"
    """It cannot be judged: too little was seen, no closed fixed rim, or the input was refused."""
