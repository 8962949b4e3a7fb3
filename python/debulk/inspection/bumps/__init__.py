"""Bumps that the tolerances drop: the excess of each is bounded, and one that could crease is judged as a pocket."""
