"""The parts of a qualification beside the signature's figures, as chain.json keeps them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from debulk.chain.part import Part

_GOOD, _FAIR, _CATEGORIES = 10.0, 30.0, 5  # AIAG's limits of %GRR and of the distinct categories


class Source(Part):
    """A source of variation: degrees of freedom, sum and mean of squares, F, and its probability by chance."""

    name: str
    df: int
    ss: float
    ms: float
    f: float | None
    p: float | None


class Study(Part):
    """A gauge study of one quantity; standard deviations, in its unit."""

    quantity: str
    unit: str
    """`quantity`, `unit`: what was measured."""
    parts: int = Field(ge=2)
    sessions: int = Field(ge=1)
    trials: int = Field(ge=2)
    """`parts`, `sessions`, `trials`: pockets, sessions, and scans in each session."""
    table: tuple[Source, ...]
    pooled: bool
    """`table`, `pooled`: the analysis of variance, and whether its interaction was pooled with the repeatability
    afterwards."""
    repeatability: float
    reproducibility: float
    interaction: float
    grr: float
    """`repeatability`, `reproducibility`, `interaction`, `grr`: from trial to trial (equipment variation), from session
    to session (appraiser variation), what a session does to single parts, and all three together."""
    part: float
    total: float
    """`part`, `total`: from part to part, and everything."""
    tolerance: float | None
    """Width of the tolerance; None: there is none."""
    percent_grr: float
    percent_tolerance: float | None
    """`percent_grr`, `percent_tolerance`: %GRR, of the total variation, and P/T, six standard deviations of the gauge
    over the tolerance; %."""
    distinct: int | None
    """Number of distinct categories; None: the gauge shows no variation at all."""

    @property
    def rating(self) -> str:
        """AIAG's word for the worse of %GRR and P/T: acceptable, marginal, or not acceptable."""
        worst = max(self.percent_grr, self.percent_tolerance or 0.0)
        few = self.distinct is not None and self.distinct < _CATEGORIES
        if worst > _FAIR:
            return "not acceptable"
        return "marginal" if worst > _GOOD or few else "acceptable"


class Agreement(Part):
    """How well the verdicts of the same pockets agree from scan to scan."""

    pockets: int
    scans: int
    """`pockets`, `scans`: number of pockets that were found in every scan, and of scans."""
    same: int
    """Number of pockets that got the same verdict in every scan."""
    kappa: float | None
    """Fleiss's kappa: 1 is full agreement, 0 that of chance. None: there is only one verdict, which chance explains."""
    sometimes: int
    """Number of pockets that were found in some scans only."""


class Drift(Part):
    """A trend from the first scan to the last: the change over all of them, and P of such a one by chance."""

    name: str
    unit: str
    change: float
    p: float


class Strip(Part):
    """What the scans of a strip or a ridge of known height and width show."""

    height_mm: float
    width_mm: float
    """`height_mm`, `width_mm`: as they are known."""
    scans: int
    """Number of scans."""
    gain: float
    gain_sd: float
    """`gain`, `gain_sd`: measured over known height, mean and standard deviation over the scans."""
    blur_mm: float
    blur_sd: float
    """`blur_mm`, `blur_sd`: sigma of the Gaussian by which the chain blurs it."""
    shape: Literal["strip", "ridge"] = "strip"
    """"strip" or "ridge"."""
    excess: float | None = None
    excess_sd: float | None = None
    """`excess`, `excess_sd`: of a ridge: the share of its excess length that the chain lets through. None: it is a
    strip."""


class Transfer(Part):
    """What is left of a bump H cos²(πx/w) so wide: shares of its height and of its excess length."""

    width_mm: float
    height: float
    excess: float
