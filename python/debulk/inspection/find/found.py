"""What a finder finds in a scan: the pockets, how much of the ply is known, and which parts were not examined."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from debulk.fibre import FibreRuns
from debulk.forking import kept
from debulk.grid import Grid
from debulk.inspection.ply.fibre_runs import ScanRuns
from debulk.pocket import Dropped, Feet, Foot, Pocket, Segmentation, Unseen, UnseenHole
from debulk.results.report import LeftOut

Hole = tuple[UnseenHole, str]
"""An unseen part of the ply, and what hides it, as `debulk.results.half_seen.HoleBeside.of` names it."""


@dataclass(frozen=True, eq=False)
class FoundPocket:
    """One pocket of a segmentation."""

    number: int
    """1 for the largest pocket of the scan."""
    segmentation: Segmentation
    feet: Feet
    """`segmentation`, `feet`: the scan in which the pocket was found, or a window of it."""
    index: int
    """Index of the pocket there, from 0."""
    holes: tuple[Hole, ...] = ()
    """As in the `Found` that the pocket comes from."""
    promoted: str = ""
    """Why it is judged although it is below a tolerance; empty if it is not below any."""
    joined: tuple[int, ...] = ()
    """Numbers of the other pockets that share their foot with this one; its net spans them too."""
    runs: ScanRuns | None = None
    """As in the `Found` that the pocket comes from."""

    @property
    def pocket(self) -> Pocket:
        """The part above the cut; its `id` is unique only within its segmentation."""
        return self.segmentation.pockets[self.index]

    @property
    def foot(self) -> Foot:
        """The foot, where the ply comes down to the mold."""
        return self.feet.feet[self.index]

    @kept
    def crossing(self) -> NDArray[np.intp]:
        """Numbers of the runs that cross its foot."""
        return np.zeros(0, dtype=np.intp) if self.runs is None else self.runs.crossing(self.feet, self.index)

    @kept
    def excess(self) -> FibreRuns | None:
        """The runs that cross its foot; None if there are none, which says nothing of its fibres."""
        return None if self.runs is None or not len(self.crossing) else self.runs.runs[self.crossing]


def runs_over(pockets: Iterable[FoundPocket]) -> NDArray[np.intp]:
    """Return the numbers of the runs that cross the foot of any of the pockets, in order."""
    return np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *(one.crossing for one in pockets)]))


@dataclass(frozen=True, eq=False)
class Found:
    """The pockets of a scan.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> pose = layup.mold_from_scanner
    >>> inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=pose)
    >>> found = inspector.find(layup.scan)
    >>> len(found.pockets), found.pockets[0].number, found.pockets[0].pocket.touches_ply_edge
    (14, 1, False)
    """

    part: tuple[Segmentation, Feet] | None
    """The segmented scan with its feet; None: no pockets were looked for."""
    unseen: Unseen
    """How much of the ply is known (of the reference, if the outline is unknown), and the holes in it."""
    holes: tuple[Hole, ...]
    """The holes of `unseen`, each with what hides it."""
    overview: Grid
    """Heights above the reference for a picture."""
    times_ms: dict[str, float] = field(default_factory=dict)
    """Duration of each stage."""
    left_out: tuple[LeftOut, ...] = ()
    """What this search leaves out."""
    doubt: str = ""
    """Why no pockets were looked for: the scan shows far too little of the ply. Empty if they were looked for."""
    runs: ScanRuns | None = None
    """The runs of the fibre lines over the scan; None: not read."""
    pitch_mm: float = 0.0
    """Distance from point to point of the scan; 0: not measured. The heights between them are interpolated."""

    @property
    def pockets(self) -> tuple[FoundPocket, ...]:
        """All pockets, largest area first."""
        if self.part is None:
            return ()
        segmentation, feet = self.part
        order = sorted(range(len(segmentation.pockets)), key=lambda k: -round(1e6 * segmentation.pockets[k].area_mm2))
        sharing: dict[int, list[int]] = {}
        for number, index in enumerate(order, start=1):
            sharing.setdefault(feet.feet[index].label, []).append(number)
        return tuple(
            FoundPocket(
                number,
                segmentation,
                feet,
                index,
                self.holes,
                joined=tuple(n for n in sharing[feet.feet[index].label] if n != number),
                runs=self.runs,
            )
            for number, index in enumerate(order, start=1)
        )

    @property
    def dropped(self) -> tuple[Dropped, ...]:
        """The bumps that stand above the cut but are no pockets, largest area first."""
        return () if self.part is None else tuple(sorted(self.part[0].dropped, key=lambda d: -d.area_mm2))
