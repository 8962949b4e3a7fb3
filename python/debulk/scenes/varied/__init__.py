"""A second family of virtual layups, which shares no code and no shape with the first.

`molds` and `bumps` define the surfaces. `placing` and `ply` put them together, and `seeing` and `rendering` view them.
`faults` spoils the view. `regions`, `fibres` and `truth` compute the truth. `scanning` makes the clouds, and `layup`
runs all of these steps. `MISTAKES` are errors that people make with layups of either family.
"""

from debulk.scenes.varied.given import Given, Mistake, given_right
from debulk.scenes.varied.layup import varied_layup
from debulk.scenes.varied.mistaken_clouds import CLOUDS
from debulk.scenes.varied.mistaken_ply import PLY
from debulk.scenes.varied.mistaken_setup import SETUP
from debulk.scenes.varied.mistaken_software import SOFTWARE
from debulk.scenes.varied.scanning import VariedLayup

__all__ = ["MISTAKES", "Given", "Mistake", "VariedLayup", "given_right", "varied_layup"]

MISTAKES: tuple[Mistake, ...] = (*SETUP, *CLOUDS, *SOFTWARE, *PLY)
"""Mistakes of set-up, clouds, software and laying, each with its own name, for layups of either family."""
