"""The data of each pocket: the outcomes of both referees' members, and the figures of the criteria."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

import figures
import mujoco_runs
import numpy as np
import own
from pockets import LIMIT_EXCESS_MM, THICKNESS_MM


@dataclass
class Truth:
    """A pocket with the results of both referees and the figures of the criteria."""

    name: str
    row: dict[str, str]
    gathered: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))  # by referee, one per member
    heights: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))

    def share(self, referee: str) -> float | None:
        """Return the share of the members above the limit, or None without members; "both" means those of both."""
        referees = self.gathered if referee == "both" else (referee,)
        members = [g for r in referees for g in self.gathered.get(r, [])]
        return float(np.mean([g > LIMIT_EXCESS_MM for g in members])) if members else None

    def value(self, column: str) -> float:
        """Return a figure of the criteria."""
        return float(self.row[column])

    @property
    def at_edge(self) -> bool:
        """Return whether the ply's edge cuts the pocket."""
        return self.row["at_edge"] == "1"


def ridge(excess_mm: float) -> float:
    """Return the ridge height by the formula, mm."""
    return excess_mm / 2 + (2 - np.pi / 2) * THICKNESS_MM


def truths() -> list[Truth]:
    """Return all pockets that a referee has judged."""
    found = {r["pocket"]: Truth(r["pocket"], r) for r in figures.table().rows()}
    for r in own.table().rows():
        if r["certified"] == "1" and r["variant"] == "" and r["pocket"] in found:
            found[r["pocket"]].gathered["own"].append(float(r["gathered_mm"]))
            found[r["pocket"]].heights["own"].append(float(r["height_mm"]))
    for r in mujoco_runs.table().rows():
        if r["accepted"] == "1" and r["variant"] == "" and r["pocket"] in found:
            found[r["pocket"]].gathered["mujoco"].append(float(r["gathered_mm"]))
            found[r["pocket"]].heights["mujoco"].append(float(r["height_mm"]))
    return [t for t in found.values() if t.gathered]


def extrapolated_excess(truth: Truth) -> float:
    """Return the excess extrapolated to spacing 0, mm: the error of a chord net falls with its spacing squared."""
    coarse, fine = truth.value("excess_mm"), truth.value("excess_half_spacing_mm")
    return fine + (fine - coarse) / 3
