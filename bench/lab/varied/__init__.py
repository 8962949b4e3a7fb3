"""A second family of virtual layups, which shares no code and no shape with the first.

`molds` and `bumps` define the surfaces. `placing` and `ply` put them together, and `seeing` and `rendering` view them.
`faults` spoils the view. `regions`, `fibres` and `truth` compute the truth. `scanning` makes the clouds, and `layup`
runs all of these steps. `MISTAKES` are errors that people make with layups of either family.
"""

from lab.varied.given import Given, Mistake, given_right
from lab.varied.layup import varied_layup
from lab.varied.mistaken_clouds import CLOUDS
from lab.varied.mistaken_ply import PLY
from lab.varied.mistaken_setup import SETUP
from lab.varied.mistaken_software import SOFTWARE
from lab.varied.scanning import VariedLayup

__all__ = ["MISTAKES", "Given", "Mistake", "VariedLayup", "given_right", "varied_layup"]

MISTAKES: tuple[Mistake, ...] = (*SETUP, *CLOUDS, *SOFTWARE, *PLY)
"""Mistakes of set-up, clouds, software and laying, each with its own name, for layups of either family."""
