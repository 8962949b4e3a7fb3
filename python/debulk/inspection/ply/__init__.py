"""The ply of an inspection and the lines along its fibres, the same for every scan; the ridge that an excess makes."""
