"""Faults of Gray code images, which are found on some rows or columns of pixels and named before anything is decoded.

On a surface the absolute phase goes on without a jump, also where a stripe of the code ends, and order plus phase lies
in the cell that the code gives. If either fails at more places than edges of objects explain, the code is not the one
that the fringes belong to. The likely causes are tried one by one, and the one that leaves no fault is named.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Bools, Singles
from debulk.scanner.gray_code import Code, most_residual, order_of, place_of

MOST_JUMPS = 0.10  # jumps of the phase over ends of stripes; edges of objects cause some hundredths
_MOST_OUTSIDE = 0.02  # share of pixels whose order plus phase lies outside the code's cell; good images: 0.001
_LEAST_ENDS = 60  # ends of stripes that are needed for a judgement, and
_LEAST_OF_ONE = 20  # those of one image, at most half of which may be jumps
_REACH = 4  # pixels between two that are compared: what lies between them may be uncertain
_START = 0.1  # turns by which the fringes may begin beside the code


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Pairs of sure pixels that are close together on one line of the image."""

    bits: Bools  # (n, 2, M)
    turns: Singles  # (2, M) wrapped phases, 0 to 1
    apart: NDArray[np.int64]  # (M,) pixels

    @property
    def ends(self) -> int:
        """Number of ends of stripes."""
        return int(np.count_nonzero(self.bits[:, 0] != self.bits[:, 1]))

    def changed(self, order: list[int] | None = None, turned: tuple[int, ...] = ()) -> Neighbours:
        """Put the images in another order, or turn some of them from black to white."""
        bits = self.bits[order] if order is not None else self.bits.copy()
        bits[list(turned)] ^= True
        return Neighbours(bits, self.turns, self.apart)


def neighbours(code: Code, turns: Singles, lit: Bools) -> Neighbours:
    """Collect pairs from (n, R, L) lines of pixels, whose bits are all sure."""
    fine = lit & code.sure.all(axis=0)
    line, at = np.nonzero(fine)
    pair = (np.diff(line) == 0) & (np.diff(at) <= _REACH)
    first, second = (np.flatnonzero(pair) + k for k in (0, 1))
    bits = np.stack([code.bits[:, line[k], at[k]] for k in (first, second)], axis=1)
    return Neighbours(bits, np.stack([turns[line[k], at[k]] for k in (first, second)]), at[second] - at[first])


def fault_of_code(seen: Neighbours, cells: int, start_turns: float) -> str:
    """Say what is wrong with the Gray images; an empty string if nothing is, or if too little is seen."""
    if seen.ends < _LEAST_ENDS:
        return ""
    found = _Fit(seen, cells, start_turns)
    start = _start(seen, cells)
    beside = abs((start - start_turns + 0.5) % 1.0 - 0.5) > _START
    if found.fine and not beside:
        return ""
    for name, other in () if found.fine else _causes(seen):
        if _Fit(other, cells, start_turns).fine and other.ends >= _LEAST_ENDS:
            return name
    if found.fine or _Fit(seen, cells, start).fine:
        return (
            f"the fringes begin with a phase of {2 * np.pi * start:.2f} rad where the code begins, but start_rad is "
            f"{2 * np.pi * start_turns:.2f}: give start_rad={2 * np.pi * start:.2f} if the projector's patterns begin "
            f"so"
        )
    mirrored = seen.changed(turned=(0,))
    if _Fit(mirrored, cells, _start(mirrored, cells)).fine:
        return "image 1 shows black for white, or the steps of the fringes run backwards and begin elsewhere"
    worst = int(np.argmax(found.jumps / np.maximum(found.ends, _LEAST_OF_ONE)))
    return (
        f"fringes and code do not belong together: the phase jumps {int(found.jumps.sum()) + found.inside} times at "
        f"{found.ends.sum()} ends of stripes, most of all at those of image {worst + 1}, and "
        f"{100 * found.outside:.0f} % of the phases lie outside the code's cell; an image is missing or in the place "
        f"of another, or periods or steps are not those of the projector"
    )


def _causes(seen: Neighbours) -> Iterator[tuple[str, Neighbours]]:
    count = len(seen.bits)
    every = list(range(count))
    yield "the images begin with the narrowest stripes: reverse their order", seen.changed(every[::-1])
    yield "all images show black for white: exchange images and inverted", seen.changed(turned=tuple(every))
    for k in every:
        # The widest stripes, turned, mirror the whole code, which is the same as steps in reverse.
        more = ", or the steps of the fringes run backwards" if k == 0 else ""
        yield f"image {k + 1} shows black for white, or is missing{more}", seen.changed(turned=(k,))
    for i, j in combinations(every, 2):
        order = every.copy()
        order[i], order[j] = j, i
        yield f"images {i + 1} and {j + 1} are exchanged", seen.changed(order)


class _Fit:
    """How well phases and code agree."""

    def __init__(self, seen: Neighbours, cells: int, start_turns: float) -> None:
        turns = (seen.turns - np.float32(start_turns)) % 1.0
        place, _ = place_of(Code(seen.bits, np.ones_like(seen.bits)), cells)
        order, residual = order_of(place, turns)
        outside = residual > most_residual(cells)
        moved = order[1] + turns[1] - order[0] - turns[0]
        close = seen.apart == 1
        step = float(np.median(((turns[1] - turns[0] + 0.5) % 1.0 - 0.5)[close])) if close.any() else 0.0
        jump = (np.abs(moved - step * seen.apart) > 0.5) & ~outside.any(axis=0)
        end = seen.bits[:, 0] != seen.bits[:, 1]
        self.jumps, self.ends = (end & jump).sum(axis=1), end.sum(axis=1)
        """At the ends of each image's stripes."""
        self.inside = int((jump & ~end.any(axis=0)).sum())
        # Where a cell is a whole period, every phase lies in it.
        self.outside = float(outside.mean()) if cells > 1 else 0.0

    @property
    def fine(self) -> bool:
        most = (self.ends >= _LEAST_OF_ONE) & (self.jumps > 0.5 * self.ends)
        few = self.jumps.sum() + self.inside <= MOST_JUMPS * self.ends.sum()
        return bool(few and not most.any() and self.outside <= _MOST_OUTSIDE)


def _start(seen: Neighbours, cells: int) -> float:
    """Phase, in turns, at which the code's periods begin."""
    place, _ = place_of(Code(seen.bits, np.ones_like(seen.bits)), cells)
    met = 0.5 * (place[0] + place[1])
    begins = (np.abs(place[1] - place[0]) * cells == 1) & (met % 1.0 == 0)
    turned = np.exp(2j * np.pi * seen.turns[:, begins])
    middle = turned.sum(axis=0)  # of the two phases on both sides of the beginning
    return float(np.angle(middle.sum()) / (2 * np.pi)) % 1.0 if begins.any() else 0.0
