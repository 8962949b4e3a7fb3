"""Finds the board in pairs of images, and says of each pair that is left out why."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.scanner.board import LEAST_CORNERS, Board
from debulk.scanner.board_reason import why_not_found
from debulk.scanner.stereo_fit import Pair

Image = NDArray[np.uint8]
Found = tuple[NDArray[np.int64], Floats]

REPEATED_PX = 0.5
"""A board whose corners moved by less than this, root mean square, in both images stands where it stood before."""


def seen_pairs(
    names: Sequence[str], left: Sequence[Image], right: Sequence[Image], board: Board, least: int
) -> tuple[list[Pair], dict[str, str], Board]:
    """Find the corners that both cameras see in each pair of images.

    If fewer than `least` images show the board in one of the layouts that it may have, the other is tried. Returned are
    the pairs that can be used, the reasons for those that cannot, by name, and the board with its layout.
    """
    left_out = repeated_images(names, left, right)
    used = [k for k, name in enumerate(names) if name not in left_out]
    best: list[tuple[Found, Found]] = []
    chosen = board
    for layout in board.layouts():
        found = [(layout.find(left[k]), layout.find(right[k])) for k in used]
        if not best or _corners(found) > _corners(best):
            best, chosen = found, layout
        if sum(len(ids) > 0 for pair in found for ids, _ in pair) >= least:
            break
    pairs: list[Pair] = []
    for k, (one, other) in zip(used, best, strict=True):
        pair = _common(names[k], (one, other), (left[k], right[k]), chosen)
        again = "" if isinstance(pair, str) else _stands_as(pair, pairs)
        if isinstance(pair, str) or again:
            left_out[names[k]] = again or str(pair)
        else:
            pairs.append(pair)
    return pairs, left_out, chosen


def repeated_images(names: Sequence[str], left: Sequence[Image], right: Sequence[Image]) -> dict[str, str]:
    """Say which pairs repeat an earlier one byte by byte; which has a wrong partner is not known: both are left out."""
    hashes = [[hashlib.sha256(image.tobytes()).digest() for image in side] for side in (left, right)]
    out: dict[str, str] = {}
    for k, name in enumerate(names):
        before = [side.index(side[k]) for side in hashes]
        if hashes[0][k] == hashes[1][k]:
            out[name] = "the same image for both cameras"
        elif before[0] == before[1] < k:
            out[name] = f"the same images as {names[before[0]]}"
        else:
            for side, first in zip(("left", "right"), before, strict=True):
                if first < k:
                    out[name] = f"the same {side} image as {names[first]}, but not the other"
                    out.setdefault(names[first], f"the same {side} image as {name}, but not the other")
    return out


def listed(left_out: dict[str, str], most: int = 6) -> str:
    """Join reasons, names with the same reason together.

    Examples
    --------
    >>> listed({"1": "dark", "2": "cut off", "3": "dark"})
    '1, 3: dark; 2: cut off'
    """
    by_reason: dict[str, list[str]] = {}
    for name, why in left_out.items():
        by_reason.setdefault(why, []).append(name)
    parts = []
    for why, names in by_reason.items():
        more = f" and {len(names) - most} more" if len(names) > most else ""
        parts.append(f"{', '.join(names[:most])}{more}: {why}")
    return "; ".join(parts)


def _corners(found: Sequence[tuple[Found, Found]]) -> int:
    return sum(len(ids) for pair in found for ids, _ in pair)


def _common(name: str, found: tuple[Found, Found], images: tuple[Image, Image], board: Board) -> Pair | str:
    """Return the corners that both cameras see, or why they are too few."""
    missing = [
        (side, image) for side, image, (ids, _) in zip(("left", "right"), images, found, strict=True) if len(ids) == 0
    ]
    if missing:
        whys = [why_not_found(image, board) for _, image in missing]
        if len(missing) == 1:
            return f"the board was not found in the {missing[0][0]} image, only in the other: {whys[0]}"
        if whys[0] == whys[1]:
            return f"the board was not found in either image: {whys[0]}"
        return f"the board was not found in either image: left, {whys[0]}; right, {whys[1]}"
    (left_ids, left_at), (right_ids, right_at) = found
    both, of_left, of_right = np.intersect1d(left_ids, right_ids, return_indices=True)
    if len(both) < LEAST_CORNERS:
        return (
            f"only {len(both)} corners are seen by both cameras, {len(left_ids)} by the left and {len(right_ids)} by "
            f"the right, and {LEAST_CORNERS} are needed"
        )
    if min(np.ptp(board.corners_mm[both, :2], axis=0)) == 0:
        return "only corners on one line are seen by both cameras"
    return Pair(name, board.corners_mm[both], left_at[of_left], right_at[of_right])


def _stands_as(pair: Pair, earlier: Sequence[Pair]) -> str:
    """Say that the board stands where it stood in an earlier pair: that counts once."""
    for other in earlier:
        here = {tuple(corner): k for k, corner in enumerate(pair.board.tolist())}
        both = [(here[tuple(corner)], k) for k, corner in enumerate(other.board.tolist()) if tuple(corner) in here]
        if len(both) < LEAST_CORNERS:
            continue
        ours, theirs = (list(column) for column in zip(*both, strict=True))
        moved = [a[ours] - b[theirs] for a, b in ((pair.left, other.left), (pair.right, other.right))]
        if all(np.sqrt(np.mean((way**2).sum(axis=1))) < REPEATED_PX for way in moved):
            return f"the board stands as in {other.name}, to {REPEATED_PX:g} px"
    return ""
