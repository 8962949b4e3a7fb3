"""Write virtual layups for bench_front and cycle.py: make_scene.py [--pitch MM] DIRECTORY [WIDTH HEIGHT]...

The default is 5120 x 3840 pixels, with the mold filling the image. The paper's scanner has a pitch of 0.55 mm.
"""

import argparse
from pathlib import Path

import numpy as np

import debulk.scenes

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--pitch", type=float)
parser.add_argument("folder", type=Path)
parser.add_argument("pixels", type=int, nargs="*", default=[5120, 3840])
args = parser.parse_args()
folder, numbers = args.folder, args.pixels
folder.mkdir(parents=True, exist_ok=True)
for width, height in zip(numbers[::2], numbers[1::2], strict=True):
    stem = folder / f"{width}x{height}"
    if Path(f"{stem}.view").exists():
        continue
    layup = debulk.scenes.layup(seed=0, pixels=(width, height), pitch_mm=args.pitch)
    layup.scan.tofile(f"{stem}.scan")
    layup.reference.tofile(f"{stem}.reference")
    np.savetxt(f"{stem}.outline", layup.ply_outline)
    np.savetxt(f"{stem}.view", np.concatenate([layup.mold_from_scanner.ravel(), layup.camera]))
    print(stem)
