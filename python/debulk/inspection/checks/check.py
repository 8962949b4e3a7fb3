"""The shape of a check, and the one runner of all of them, which fails closed."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from debulk import _core
from debulk.inspection.checks.seen import Seen
from debulk.results.finding import Finding, unexpected
from debulk.verdict import Verdict

log = logging.getLogger("debulk")


@dataclass(frozen=True)
class Check:
    """One thing that can make the verdict of a layup worse, or that a reader of the report must know."""

    name: str
    """Name of its findings; what it looks at and its limit stand under this name in `debulk.results.check_texts`."""
    look: Callable[[Seen], Iterable[Finding]]
    """Returns the findings, from what was seen."""
    limits: tuple[Any, ...] = ()
    """Its thresholds that no recipe has: a frozen dataclass of each instrument; docs/checks.md shows its comments."""


def findings_of(checks: Sequence[Check], seen: Seen) -> tuple[Finding, ...]:
    """Ask each check, in order. One that runs out of time leaves the layup UNDECIDED, one that fails INVALID."""
    out: list[Finding] = []
    for check in checks:
        try:
            out += check.look(seen)
        except _core.Stopped:
            reason = f"the deadline passed during the check {check.name}"
            out.append(Finding("deadline", Verdict.UNDECIDED, reason))
        except Exception as error:
            log.exception("the check %s failed", check.name)
            out.append(Finding(check.name, Verdict.INVALID, f"the check {check.name} failed: {unexpected(error)}"))
    return tuple(out)
