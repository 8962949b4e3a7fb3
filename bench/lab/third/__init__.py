"""A third family of virtual layups, written from the laws of the model alone.

A mold is a height over XY, the ply's lower side lies a gap off it along its normal, and the upper side lies one
thickness off the lower side along that side's own normal. A pinhole camera looks at the upper side, ray by ray. The
truth is the excess of the ply's lower side by quadrature along straight fibres (docs/model.md, section 9). The family
takes nothing from `debulk.scenes` or `lab.varied`.
"""
