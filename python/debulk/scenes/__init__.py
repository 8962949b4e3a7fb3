"""Virtual layups: what a scanner would see of a draped ply with air pockets, with everything about it known.

A scene stands in for a robot cell in the demonstration, the tests and the benchmarks. It is made from its seed alone:
the same seed gives the same bits, on any number of threads. `layup` makes those of the first family, `varied_layup`
those of a second one, written apart from the first; `mistakes` spoils what either gives to an inspector.
"""

from __future__ import annotations

from debulk.scenes.bump import Bump
from debulk.scenes.debulked import Debulked
from debulk.scenes.fringe_images import FringeImages, FringeTruth, fringe_images
from debulk.scenes.scene import Layup, Truth, layup
from debulk.scenes.varied import MISTAKES as mistakes
from debulk.scenes.varied import VariedLayup, varied_layup

__all__ = [
    "Bump",
    "Debulked",
    "FringeImages",
    "FringeTruth",
    "Layup",
    "Truth",
    "VariedLayup",
    "fringe_images",
    "layup",
    "mistakes",
    "varied_layup",
]
