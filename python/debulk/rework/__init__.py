"""What to do about a ply that is too long: which length is to leave, along which fibres, towards which edge."""

from debulk.rework.handling import Handling
from debulk.rework.move import Move, Rework
from debulk.rework.plan import plan

__all__ = ["Handling", "Move", "Rework", "plan"]
