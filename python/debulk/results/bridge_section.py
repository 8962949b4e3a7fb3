"""How high the ply of a pocket bridges by sections along its fibres, in addition to what its net shows."""

from __future__ import annotations

from dataclasses import dataclass

from debulk.results.number import span


@dataclass(frozen=True, kw_only=True)
class BridgeSection:
    """The fibre that bridges highest, as a string over the mold held by friction alone (docs/model.md, section 5)."""

    height_mm: float
    """Height of the ply's upper side above the mold, as for a bridge of the net; 0 if the ply lies down, or no fibre is
    too short."""
    range_mm: tuple[float, float]
    """Lowest and highest height: the missing length is less or more by its error, or more as nothing flows to it from
    what is too long on the fibre, or on another one; and friction holds it over 10 mm less or more."""
    lacks_mm: float
    lacks_error_mm: float
    """`lacks_mm`, `lacks_error_mm`: length by which the fibre is shorter than its mold in the scan; two standard
    deviations of that, and at least 0.04 mm."""
    pull_n_per_mm: float
    hold_n_per_mm: float
    """`pull_n_per_mm`, `hold_n_per_mm`: pull of the fibre if its ends were pinned, and the force that friction between
    it and the ply's edge can hold. If it pulls more, it slips, and the height is that at which the pull equals the
    force that is held."""


def bridge_section_line(one: BridgeSection) -> str:
    """Say how high the fibre stands, and why."""
    if not one.lacks_mm > 0:
        return "none by the sections of its fibres, none of which is too short"
    lies = "it lies down" if one.range_mm[1] == 0 else f"{span(one.range_mm)} mm"
    slips = one.pull_n_per_mm > one.hold_n_per_mm
    less = ": it slips in until it pulls no more than that" if slips else ", so its ends stay where they are"
    return (
        f"{lies} by the sections of its fibres: one is {one.lacks_mm:.3f} ± {one.lacks_error_mm:.3f} mm too short and, "
        f"pinned at its ends, would pull with {one.pull_n_per_mm:.3g} N/mm; friction holds {one.hold_n_per_mm:.3g} "
        f"N/mm{less}"
    )
