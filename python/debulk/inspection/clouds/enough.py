"""How much is enough to say something: one number for each such question, in place of one in every file that asks it.

The files had numbers of their own before. At half and at twice of those no verdict of 36 scenes of the third family
changed (bench/trust/thresholds.txt).
"""

SEEN = 0.75  # of what is looked at must have been seen, at least: with less, what it shows is that of its gaps
FEW = 20  # of points, windows, squares or nodes: fewer say nothing
PLACES = 100  # lines, corners or squares that stand for all of them
POINTS = 30_000  # of a cloud that stand for it: about 30 in a square of 40 mm on a ply of a square metre
