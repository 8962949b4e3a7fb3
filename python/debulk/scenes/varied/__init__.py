"""A second family of virtual layups, which shares no code and no shape with the first.

`molds` and `bumps` are the surfaces, `placing` and `ply` put them together, `seeing` and `rendering` look at them,
`faults` spoil what was seen, `regions`, `fibres` and `truth` say what is so, `scanning` makes the clouds, and
`layup` leads through all of them.
`MISTAKES` are what people do wrong with layups of either family.
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
"""Mistakes of set-up, clouds, software and laying, each with a name of its own, for layups of either family."""
