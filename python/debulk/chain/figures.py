"""The figures of a signature by which a chain is recognised, how far each may be off, and what it means if it is."""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """One figure of a `Signature`."""

    name: str
    unit: str
    """`name`, `unit`: its name there, and its unit; a share has none."""
    says: str
    """What it is, for the reader."""
    above: str
    below: str
    """`above`, `below`: what a scan is that has more or less of it than the chain; empty: that is no difference."""
    share: float = 0.0
    least: float = 0.0
    """`share`, `least`: by which share of its mean, and by how much, a scan of the same chain may be off whatever the
    scatter from scan to scan: another mold and another part lie in another way. `bench/trust/chains.py` measures what
    that misses."""
    never_negative: bool = False
    """Whether it is a share, a length or the like."""


FIGURES = (
    Quantity("image", "", "whether it is an image", "an image", "a list of points", least=0.5),
    Quantity("pitch_mm", "mm", "distance from point to point", "coarser", "denser", share=0.08),
    Quantity("noise_mm", "mm", "scatter of the points", "noisier", "smoother", share=0.25),
    Quantity("near", "", "noise shared at most 1.5 pitches apart", "smoother", "less smooth", least=0.04),
    Quantity("middle", "", "noise shared 1.5 to 2.5 pitches apart", "smoother", "less smooth", least=0.04),
    Quantity("far", "", "noise shared 2.5 to 4.5 pitches apart", "smoother", "less smooth", least=0.04),
    Quantity(
        "repeated",
        "",
        "depths that repeat from point to point",
        "ranked by a median",
        "not ranked",
        least=0.012,
        never_negative=True,
    ),
    Quantity(
        "step_mm", "mm", "step of the depths", "rounded", "rounded less", share=0.25, least=0.0005, never_negative=True
    ),
    Quantity("missing", "", "points that were not seen", "", "filled", share=0.7, never_negative=True),
    Quantity("edge_mm", "mm", "spread of the ply's edge", "blurred", "sharper", least=0.6),
)
"""In the order in which a report names them."""
