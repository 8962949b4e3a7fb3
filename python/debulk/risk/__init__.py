"""The probability that a ridge exceeds the limit, of every pocket and of the layup (docs/probability.md)."""

from debulk.risk.layup import Risk, risk
from debulk.risk.place import Place, place_of

__all__ = ["Place", "Risk", "place_of", "risk"]
