"""Archives inspected again: many layups on many processes, into a history, with nothing lost or done twice."""

from __future__ import annotations

from debulk.batch.archive import Layup, layups
from debulk.batch.running import Batch, run

__all__ = ["Batch", "Layup", "layups", "run"]
