"""One move of a rework, and the plan that it belongs to, as text for a person and as JSON for a robot."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from debulk.arrays import Floats
from debulk.rework.handling import Handling
from debulk.words import in_mm, pocket_names


@dataclass(frozen=True, eq=False)
class Move:
    """Length that leaves one place along its fibres."""

    pockets: tuple[int, ...]
    """Numbers of the pockets there; empty where no pocket is."""
    fibre: int
    """0: along the first fibre; 1: along the second."""
    towards_deg: float | None
    """Direction in which it leaves, 0 to 360 degrees from the mold's +x; None: no way out is known."""
    length_mm: float
    """What leaves the fibre that must give the most, with what it passes on from places farther in."""
    band_mm: float
    """Width across those fibres of the band that moves."""
    flat_mm: float
    """Flat ply that slides along: to the edge, or to the place into which the length is carried."""
    force_n: float
    """Force that this takes, N."""
    across_mm: float
    """By how much the fibres that cross the band get shorter: it shears, and draws the flat ply beside it in."""
    by: str
    """"pull", or "lift" where more force is needed than can be held, where the band would shear too much, or no way out
    is known: lift the ply and lay it again from this place on, by so much shorter."""
    into: bool
    """True: the length goes on from the next place on the fibres, in a later move; False: over the ply's edge."""
    from_mm: Floats
    to_mm: Floats
    lengths_mm: Floats
    """`from_mm`, `to_mm`, `lengths_mm`: (L, 2), (L, 2) and (L,) for each fibre line of the band: where it leaves the
    mold last, where the length goes, mold XY, and how much. `to_mm` is straight on from `from_mm`; equal to it where no
    way out is known."""

    @property
    def at(self) -> str:
        """The place in words."""
        if not self.pockets:
            return f"the ply at {in_mm(self.from_mm[np.argmax(self.lengths_mm)])}"
        return pocket_names(self.pockets)

    @property
    def short(self) -> str:
        """Length and direction in a few words."""
        towards = "" if self.towards_deg is None else f" towards {round(self.towards_deg) % 360}°"
        return f"{self.length_mm:.2f} mm{towards}"

    def line(self, hold_n: float) -> str:
        """Say in a sentence what to do, given the force that can be held."""
        band = f"{self.short} in a band {self.band_mm:.0f} mm wide"
        if self.towards_deg is None:
            return (
                f"{self.at}: lift the ply and lay it again from there, {band} shorter; no way out to an edge is known"
            )
        end = in_mm(self.to_mm[np.argmax(self.lengths_mm)])
        where = f"{'into the next place' if self.into else 'over the edge'} at {end}"
        over = f"{self.flat_mm:.0f} mm of flat ply, about {float(f'{self.force_n:.2g}'):g} N"
        if self.by == "pull":
            return f"{self.at}: pull {band}, {where}: {over}"
        edge = f"lift the ply from the edge at {end} back to there and lay it again, {band}"
        if self.force_n > hold_n:
            return f"{self.at}: {edge}; to pull {over} would be needed, and {hold_n:g} N can be held"
        return f"{self.at}: {edge}; a pull would draw the ply beside the band in by {self.across_mm:.2f} mm"

    def to_dict(self) -> dict[str, Any]:
        """Return the move as JSON types."""
        names = ("fibre", "by", "into", "towards_deg", "length_mm", "band_mm", "flat_mm", "across_mm", "force_n")
        plain = {name: getattr(self, name) for name in names}
        lines = zip(self.from_mm.tolist(), self.to_mm.tolist(), self.lengths_mm.tolist(), strict=True)
        points = [{"from_mm": a, "to_mm": b, "length_mm": length} for a, b, length in lines]
        return {"pockets": list(self.pockets), **plain, "lines": points}


@dataclass(frozen=True, eq=False)
class Rework:
    """What to do about the fibres that are too long, in this order."""

    moves: tuple[Move, ...]
    """The moves; empty if no length has to leave."""
    without: tuple[int, ...]
    """Numbers of pockets that do not pass and whose fibres are not too long by themselves: no length helps there."""
    target_mm: float
    """The excess that every fibre keeps at most: that of a ridge as high as the limit less its margin."""
    handling: Handling
    """What it was planned for."""

    def of(self, pocket: int) -> tuple[Move, ...]:
        """Return the moves at one pocket, by its number."""
        return tuple(move for move in self.moves if pocket in move.pockets)

    def __str__(self) -> str:
        lines = [f"{k}. {move.line(self.handling.hold_n)}" for k, move in enumerate(self.moves, 1)]
        if self.without:
            lines.append(f"{pocket_names(self.without)}: no fibre is known to be too long; see the reason")
        if self.moves:
            lines.append("then scan again before the vacuum is drawn")
        return "\n".join(lines or ["no length has to leave"])

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as JSON types: mold frame, mm, N, degrees; moves in their order."""
        return {
            "format": "debulk rework",
            "schema": 1,
            "target_excess_mm": self.target_mm,
            "hold_n": self.handling.hold_n,
            "stick_mpa": self.handling.stick_mpa,
            "moves": [move.to_dict() for move in self.moves],
            "without": list(self.without),
        }

    def to_json(self) -> str:
        """Return the plan as JSON text."""
        return json.dumps(self.to_dict(), indent=1) + "\n"
