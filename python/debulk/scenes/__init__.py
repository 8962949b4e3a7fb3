"""Virtual layups: what a scanner would see of a draped ply with air pockets, and the complete truth about it.

A scene stands in for a robot cell in the demonstration, the tests and the benchmarks. It is made from its seed alone:
the same seed gives the same bits, on any number of threads.
"""

from __future__ import annotations

from debulk.scenes.bump import Bump
from debulk.scenes.debulked import Debulked
from debulk.scenes.fringe_images import FringeImages, FringeTruth, fringe_images
from debulk.scenes.scene import Layup, Truth, layup

__all__ = [
    "Bump",
    "Debulked",
    "FringeImages",
    "FringeTruth",
    "Layup",
    "Truth",
    "fringe_images",
    "layup",
]
