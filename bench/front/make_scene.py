"""Write virtual layups for bench_front: make_scene.py DIRECTORY [WIDTH HEIGHT]..., default 5120 x 3840."""

import sys
from pathlib import Path

import numpy as np

import debulk.scenes

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
numbers = [int(n) for n in sys.argv[2:]] or [5120, 3840]
for width, height in zip(numbers[::2], numbers[1::2], strict=True):
    stem = folder / f"{width}x{height}"
    if Path(f"{stem}.view").exists():
        continue
    layup = debulk.scenes.layup(seed=0, pixels=(width, height))
    layup.scan.tofile(f"{stem}.scan")
    layup.reference.tofile(f"{stem}.reference")
    np.savetxt(f"{stem}.outline", layup.ply_outline)
    np.savetxt(f"{stem}.view", np.concatenate([layup.mold_from_scanner.ravel(), layup.camera]))
    print(stem)
