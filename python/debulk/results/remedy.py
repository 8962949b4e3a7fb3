"""The remedy that a reason names: its last clause that is a request."""

from __future__ import annotations

import re

__all__ = ["remedy"]

_REQUESTS = re.compile(
    r"(?:check|clean|complete|crop|give|lay|look|scan again|set|smooth|swap|switch|treat|turn|use|multiply|qualify)\b",
    re.IGNORECASE,
)


def remedy(reason: str) -> str:
    """Return what a reason asks for, without the clauses that say why; empty if it asks for nothing.

    This is for display only: no verdict depends on it.

    Examples
    --------
    >>> remedy("scan and reference look swapped: 12 cm² hang below the reference; give them the other way round")
    'give them the other way round'
    >>> remedy("a hole of 9 cm² borders on it and decides: scan again; CREASE with it filled in")
    'scan again'
    >>> remedy("ridge 0.87 to 0.88 mm above the limit of 0.60 mm")
    ''
    """
    clauses = [clause.strip() for clause in re.split(r"[;:?] ", reason)]
    asked = [clause for clause in clauses if _REQUESTS.match(clause)]
    return asked[-1][0].lower() + asked[-1][1:] if asked else ""
