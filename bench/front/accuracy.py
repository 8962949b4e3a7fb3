"""Pockets of virtual layups against the truth they were made from: areas, peaks, volumes. Writes accuracy.txt.

accuracy.py [--seeds N] [--large N] [-o FILE]: N layups of 1.2 million points, N of 20 million.
"""

import argparse
from pathlib import Path

import numpy as np

import debulk


def gap_at_rim(layup, outline, mold_height):
    """Whether a drop-out of more than single pixels lies on the outline."""
    f, cx, cy = layup.camera
    pose = layup.mold_from_scanner
    xyz = np.column_stack([outline, mold_height(outline) + layup.truth.cut_height_mm])
    seen = (xyz - pose[:3, 3]) @ pose[:3, :3]
    column = np.rint(f * seen[:, 0] / seen[:, 2] + cx).astype(int)
    row = np.rint(f * seen[:, 1] / seen[:, 2] + cy).astype(int)
    missing = layup.truth.dropout
    reach = max(1, round(f / 2400.0))  # about a millimetre
    window = (2 * reach + 1) ** 2
    for i, j in zip(column, row, strict=True):
        part = missing[max(0, j - reach) : j + reach + 1, max(0, i - reach) : i + reach + 1]
        if part.sum() > 0.5 * window:
            return True
    return False


def errors(layup):
    """Rows of relative area error, peak error (mm), relative volume error, drop-out at the rim, at the ply's edge."""
    inspector = debulk.Inspector(
        None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, camera=layup.camera
    )
    report = inspector.inspect(layup.scan)
    rows = []
    for true in layup.truth.pockets:
        found = [p for p in report.pockets if np.hypot(*(middle(p.outline_mm) - middle(true.outline_mm))) < 3]
        if len(found) != 1:
            rows.append((np.nan,) * 5)
            continue
        p = found[0]
        rows.append(
            (
                p.area_mm2 / true.area_mm2 - 1,
                p.peak_mm - true.peak_mm,
                p.volume_mm3 / true.volume_mm3 - 1,
                gap_at_rim(layup, p.outline_mm, inspector.reference.height),
                p.touches_ply_edge,
            )
        )
    return np.array(rows, dtype=float)


def middle(outline):
    return (outline.min(axis=0) + outline.max(axis=0)) / 2


def summary(name, rows):
    """One block of text."""
    lost = int(np.isnan(rows[:, 0]).sum())
    rows = rows[~np.isnan(rows[:, 0])]
    clear = rows[rows[:, 3] == 0]

    def line(what, values, scale, unit):
        size = np.abs(values) * scale
        return (
            f"  {what:<34} median {np.median(size):7.3f} {unit:<2}  90 % {np.quantile(size, 0.9):7.3f}"
            f"  worst {size.max():7.3f}  bias {np.mean(values) * scale:+7.3f}"
        )

    return "\n".join(
        [
            f"{name}: {len(rows)} pockets, {lost} not found, {len(rows) - len(clear)} with a drop-out at the rim",
            line("area", rows[:, 0], 100, "%"),
            line("area, no drop-out at the rim", clear[:, 0], 100, "%"),
            line("area, at the ply's edge", rows[rows[:, 4] == 1, 0], 100, "%"),
            line("peak", rows[:, 1], 1, "mm"),
            line("volume", rows[:, 2], 100, "%"),
            line("volume, no drop-out at the rim", clear[:, 2], 100, "%"),
        ]
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--large", type=int, default=3)
    parser.add_argument("-v", action="store_true")
    parser.add_argument("-o", type=Path, default=Path(__file__).with_name("accuracy.txt"))
    wanted = parser.parse_args()
    blocks = []
    for pixels, count in (((1280, 960), wanted.seeds), ((5120, 3840), wanted.large)):
        rows = []
        for seed in range(count):
            rows.append(errors(debulk.scenes.layup(seed, pixels)))
            if wanted.v:
                print(seed, np.round(rows[-1] * [100, 1, 100, 1, 1], 3), sep="\n")
        if rows:
            blocks.append(summary(f"{pixels[0]} x {pixels[1]}, {count} layups", np.concatenate(rows)))
            print(blocks[-1], flush=True)
    wanted.o.write_text("\n\n".join(blocks) + "\n")


if __name__ == "__main__":
    main()
