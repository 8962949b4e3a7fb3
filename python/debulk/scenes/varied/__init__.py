"""A second family of virtual layups, which shares no code and no shape with the first.

`molds` and `bumps` are the surfaces, `placing` and `ply` put them together, `seeing` and `rendering` look at them,
`faults` spoil what was seen, `regions`, `fibres` and `truth` say what is so, and `layup` is the way through all of them.
"""

from debulk.scenes.varied.layup import VariedLayup, varied_layup

__all__ = ["VariedLayup", "varied_layup"]
