"""How a scan compares with the chain of scanner, filters and export that was qualified for it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ChainFigure:
    """One figure of a scan beside the limits of its chain."""

    name: str
    says: str
    unit: str
    """`name`, `says`, `unit`: its name, what it is, and its unit; empty for a share or a correlation."""
    measured: float
    """The scan's."""
    low: float | None
    high: float | None
    """`low`, `high`: the chain's limits; None: none on that side."""
    differs: str = ""
    """In which way the scan differs from the chain, such as "smoother"; empty: it does not."""

    @property
    def limit(self) -> float | None:
        """The limit that the scan exceeds; None: it exceeds none."""
        if self.low is not None and self.measured < self.low:
            return self.low
        return self.high if self.high is not None and self.measured > self.high else None

    @property
    def span(self) -> str:
        """The limits in words; empty: there are none."""
        low, high = (None if limit is None else f"{limit:.2g}" for limit in (self.low, self.high))
        if low is not None and high is not None:
            return f"{low} to {high}"
        return f"at least {low}" if low is not None else f"at most {high}" if high is not None else ""

    @property
    def figures(self) -> str:
        """What was measured, and the limits."""
        limits = f", qualified {self.span}" if self.span else ""
        return f"{self.measured:.2g}{' ' * bool(self.unit)}{self.unit}{limits}"

    def __str__(self) -> str:
        return f"{self.says} {self.figures}"


@dataclass(frozen=True, kw_only=True)
class ChainReport:
    """The comparison of a scan with its chain."""

    name: str
    made_utc: str
    sha256: str
    """`name`, `made_utc`, `sha256`: name of the chain, when it was qualified, and the fingerprint of its file."""
    figures: tuple[ChainFigure, ...] = ()
    """What the scan shows of its chain."""
