"""Compare regions of interest with the whole scan on layups of 20 million points, and the errors and times of other
coarse passes: regions.py [--seeds N...] [--pixels WIDTH HEIGHT] [-o FILE]. Writes regions.txt.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from cycle import difference

import debulk
from debulk import _core
from debulk.inspection.find.regions import RegionFinder

MESHES = ((1, 16), (2, 32), (4, 64), None, (16, 256), (32, 512), (64, 1024), (128, 2048))


def centres(found):
    """Return (area, centroid) of the pockets, largest first."""
    return [(one.pocket.area_mm2, one.pocket.centroid_mm) for one in found.pockets]


def worst(found, whole):
    """Return how many of the pockets are missing, and the largest relative difference in area of the others."""
    missing, most = 0, 0.0
    for area, centre in whole:
        near = [a for a, c in found if np.hypot(*(c - centre)) < 5]
        missing += len(near) != 1
        most = max([most, *(abs(a / area - 1) for a in near)])
    return missing, most


def study(inspector, scan, whole, cycles=5):
    """Yield for each mesh its steps; mm between rows, mm² of an eye, shares of the image read and processed, ms of the
    coarse pass, ms busy; (pockets missing, worst area) or (why it was refused,); whether it is the mesh in use.
    """
    usual = inspector.find(scan).regions
    for mesh in MESHES:
        if mesh == (usual.rows, usual.columns):
            continue
        finder = RegionFinder(inspector.setup, mesh=mesh)
        busy, coarse = [], []
        for _ in range(cycles):
            began = time.process_time()
            found = finder.find(scan)
            busy.append(1e3 * (time.process_time() - began) / _core.default_threads())
            coarse.append(found.times_ms.get("coarse", np.nan))
        used = found.regions
        if used is None:  # the scan was processed as a whole
            yield mesh, (np.nan,) * 6, (found.left_out[0].why,), False
            continue
        figures = used.rows * used.pixel_mm, used.eye_mm2, used.read_share, used.image_share, min(coarse), min(busy)
        yield (used.rows, used.columns), figures, worst(centres(found), whole), mesh is None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3])
    parser.add_argument("--pixels", type=int, nargs=2, default=[5120, 3840])
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).with_name("regions.txt"))
    args = parser.parse_args()
    lines = [f"Regions of interest against the whole scan, {args.pixels[0]} x {args.pixels[1]} pixels", ""]
    table = {}
    for seed in args.seeds:
        layup = debulk.scenes.layup(seed=seed, pixels=tuple(args.pixels))
        place = {"ply_outline": layup.ply_outline, "mold_from_scanner": layup.mold_from_scanner}
        inspector = debulk.Inspector(None, layup.reference, **place)
        plain = debulk.Inspector(
            debulk.Recipe(segmentation={"regions": False}), inspector.prepared, camera=inspector.camera, **place
        )
        regions, whole = inspector.inspect(layup.scan), plain.inspect(layup.scan)
        lines.append(f"layup {seed}: {len(whole.pockets)} pockets, {difference(regions, whole)}")
        print(lines[-1], flush=True)
        reference = [(p.area_mm2, centroid(p.outline_mm)) for p in whole.pockets if not p.promoted]  # as found
        for mesh, *row in study(inspector, layup.scan, reference):
            table.setdefault(mesh, []).append(row)
        del layup, inspector, plain
    lines += [
        "",
        f"Coarse passes, over {len(args.seeds)} layups; * is in use: the sparsest that can miss nothing of AreaTol",
        "   mesh, pixels   rows apart   an eye holds     read   worked on   coarse ms   busy ms   missing   worst area",
    ]
    for (rows, columns), cases in table.items():
        apart, eye, read, worked, coarse, busy = np.nanmean([c[0] for c in cases], axis=0)
        results = [c[1] for c in cases]
        refused = [r for r in results if len(r) == 1]
        missing = sum(r[0] for r in results if len(r) == 2)
        most = max([0.0, *(r[1] for r in results if len(r) == 2)])
        mark = "*" if cases[0][2] else " "
        end = f"   ({len(refused)} refused: {refused[0][0]})" if refused else ""
        lines.append(
            f" {mark} {rows:4d} x {columns:<7d}{apart:8.1f} mm{eye / 100:11.2f} cm²{100 * read:7.1f} %"
            f"{100 * worked:10.1f} %{coarse:12.1f}{busy:10.1f}{missing:10d}{most:13.1e}{end}"
        )
    lines += [
        "",
        "read: by the coarse pass and the sample of the outlier threshold; worked on: in windows. coarse: wall time;",
        "busy: processors' time of the front end, segmentation and feet over the threads; the best of five.",
    ]
    args.output.write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


def centroid(outline):
    """Return the centroid of the area of an (M, 2) polygon."""
    x, y = (outline - outline[0]).T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    return outline[0] + np.array([((v + np.roll(v, -1)) * cross).sum() for v in (x, y)]) / (3 * cross.sum())


if __name__ == "__main__":
    main()
