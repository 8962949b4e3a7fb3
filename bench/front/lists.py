"""Time an inspection of one virtual layup as an image, as a list in the image's order, and as a list in any order.

    python bench/front/lists.py [WIDTH HEIGHT]

Prints the processor time of preparing the reference and of an inspection: best and median of five, taken in turns.
"""

import sys
import time
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import TypeVar

import numpy as np

import debulk
import debulk.scenes

_TIMES = 5
_Made = TypeVar("_Made")


def timed(call: Callable[[], _Made]) -> tuple[float, _Made]:
    began = time.process_time()
    made = call()
    return time.process_time() - began, made


def main() -> None:
    width, height = map(int, sys.argv[1:3] or (1280, 960))
    layup = debulk.scenes.layup(seed=0, pixels=(width, height))
    order = np.random.default_rng(1).permutation(width * height)
    lists = {
        "an image": lambda points: points,
        "a list in its order": lambda points: points.reshape(-1, 3),
        "a list in any order": lambda points: points.reshape(-1, 3)[order],
    }
    clouds = {name: (change(layup.scan), change(layup.reference)) for name, change in lists.items()}
    took: dict[str, list[tuple[float, float]]] = {name: [] for name in lists}
    for _ in range(_TIMES):
        for name, (scan, reference) in clouds.items():
            prepare = partial(debulk.Inspector, None, reference, layup.ply_outline)
            preparing_s, inspector = timed(partial(prepare, mold_from_scanner=layup.mold_from_scanner))
            inspecting_s, _ = timed(partial(inspector.inspect, scan))
            took[name].append((preparing_s, inspecting_s))
    print(f"debulk {debulk.__version__}, {width} x {height} points, processor time in s, best and median of {_TIMES}")
    for name, times in took.items():
        columns = "   ".join(f"{min(t):6.2f} {median(t):6.2f}" for t in zip(*times, strict=True))
        print(f"{name:22}{columns}   (preparing, inspecting)")


if __name__ == "__main__":
    main()
