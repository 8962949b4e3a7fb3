"""The fibres of a net, node by node."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["ALONG", "fibres"]

ALONG = ((0, 1), (2, 3))
"""Columns of a net's neighbour table: the next node ahead and back, for each of the two fibre directions."""


def fibres(neighbours: NDArray[np.integer]) -> Iterator[tuple[int, list[int]]]:
    """Yield the direction, 0 or 1, and the nodes, from end to end, of every fibre of a net with (N, 4) neighbours."""
    links = neighbours.tolist()
    for direction, (ahead, back) in enumerate(ALONG):
        for first in np.flatnonzero(neighbours[:, back] < 0).tolist():
            nodes = [first]
            while (following := links[nodes[-1]][ahead]) >= 0:
                nodes.append(following)
            yield direction, nodes
