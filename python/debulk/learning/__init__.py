"""Learning from outcomes: the limit of a ridge that a shop's own layups support, and what is detected of which size."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from debulk.learning.calibration import Calibrated, calibrate
    from debulk.learning.detection import Pod, pod
    from debulk.learning.likelihood import Outcomes, Posterior, posterior

__all__ = ["Calibrated", "Outcomes", "Pod", "Posterior", "calibrate", "pod", "posterior"]

_HOMES = {
    "Calibrated": "calibration",
    "calibrate": "calibration",
    "Outcomes": "likelihood",
    "Posterior": "likelihood",
    "posterior": "likelihood",
    "Pod": "detection",
    "pod": "detection",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"debulk.learning.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'debulk.learning' has no attribute {name!r}")
