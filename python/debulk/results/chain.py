"""How a scan compares with the chain of scanner, filters and export that was qualified for it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ChainFigure:
    """One figure of a scan beside the limits of its chain.

    Attributes
    ----------
    name, says, unit
        Its name, what it is, and its unit; empty for a share or a correlation.
    measured
        The scan's.
    low, high
        The chain's limits; None: none on that side.
    differs
        In which way the scan differs from the chain, such as "smoother"; empty: it does not.
    """

    name: str
    says: str
    unit: str
    measured: float
    low: float | None
    high: float | None
    differs: str = ""

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
    """The comparison of a scan with its chain.

    Attributes
    ----------
    name, made_utc, sha256
        Name of the chain, when it was qualified, and the fingerprint of its file.
    figures
        What the scan shows of its chain.
    """

    name: str
    made_utc: str
    sha256: str
    figures: tuple[ChainFigure, ...] = ()
