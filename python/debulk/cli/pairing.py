"""Pairs the images of two cameras by the numbers in their names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from debulk import InputError

Key = tuple[int, ...] | str


def paired(left: Sequence[Path], right: Sequence[Path]) -> tuple[list[tuple[Path, Path]], dict[str, str]]:
    """Pair left_01 with right_01, cam0_7 with cam1_07: numbers that are the same in a whole folder tell nothing.

    Where names hold no number that changes, the names themselves have to be the same in both folders.

    Returns
    -------
    tuple[list[tuple[Path, Path]], dict[str, str]]
        Pairs, in the order of their numbers, and the images without a partner, by name.

    Raises
    ------
    debulk.InputError
        If two images of a folder have the same number, or no image has a partner.

    Examples
    --------
    >>> pairs, alone = paired([Path("left_1.png"), Path("left_3.png")], [Path("right_01.png"), Path("right_02.png")])
    >>> [(one.name, other.name) for one, other in pairs]
    [('left_1.png', 'right_01.png')]
    >>> alone
    {'left_3.png': 'the right camera has no image 3', 'right_02.png': 'the left camera has no image 2'}
    """
    keys = [_keys(side) for side in (left, right)]
    common = [key for key in keys[0] if key in keys[1]]
    if not common:
        raise InputError(
            f"{left[0].parent}, {right[0].parent}: expected images that can be paired by the numbers in their names, "
            f"like left_01.png and right_01.png, but got {left[0].name} and {right[0].name}"
        )
    alone = {
        path.name: f"the {other} camera has no image {key if isinstance(key, str) else '-'.join(map(str, key))}"
        for side, others, other in ((keys[0], keys[1], "right"), (keys[1], keys[0], "left"))
        for key, path in side.items()
        if key not in others
    }
    return [(keys[0][key], keys[1][key]) for key in common], alone


def _keys(paths: Sequence[Path]) -> dict[Key, Path]:
    """Return what identifies each image: the numbers in its name that differ within the folder, or else the name."""
    numbers = [tuple(int(digits) for digits in re.findall(r"\d+", path.stem)) for path in paths]
    same_length = len({len(row) for row in numbers}) == 1
    if same_length and len(paths) > 1:
        differ = [k for k, column in enumerate(zip(*numbers, strict=True)) if len(set(column)) > 1]
        numbers = [tuple(row[k] for k in differ) for row in numbers]
    keys: list[Key] = [
        row if same_length and row else path.stem.lower() for row, path in zip(numbers, paths, strict=True)
    ]
    twice = [key for key, count in Counter(keys).items() if count > 1]
    if twice:
        both = [path.name for key, path in zip(keys, paths, strict=True) if key == twice[0]]
        raise InputError(f"{paths[0].parent}: expected images of different numbers, but got {' and '.join(both)}")
    return dict(zip(keys, paths, strict=True))
