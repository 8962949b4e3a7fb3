"""Compare pockets of virtual layups with the truth they were made from: areas, peaks, volumes. Writes accuracy.txt.

accuracy.py [--seeds 10-15] [--size 1280x960 5120x3840] [-v] [-o FILE]. The method was chosen on the seeds 0 to 3.

The standard errors in the last two columns follow from the scan's noise alone. "window" is that of any method that
knows only that the surface is smooth over a window as large as ours: the remaining noise at the outline shifts the
outline by noise over slope, and inside the outline it adds up. "ideal" is the Cramér-Rao bound of a method that knows
that the pocket is a bell over an ellipse and determines its six parameters. Neither has to cope with a noisy reference,
drop-outs or flying pixels.
"""

import argparse
from pathlib import Path

import numpy as np
from noise_bounds import ideal_errors, window_errors

import debulk

CHOSEN_ON = range(4)
GOALS = {"peak": 0.1, "volume": 0.3}  # mm, %: from issue 5, for pockets whose rim no drop-out touches
UNITS = {"area": "%", "peak": "mm", "volume": "%"}


def gap_at_rim(layup, outline, mold_height):
    """Return whether a drop-out larger than single pixels lies on the outline."""
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


def middle(outline):
    return (outline.min(axis=0) + outline.max(axis=0)) / 2


def errors(layup, seed):
    """Return one dict per true pocket: whether it was found, its errors and bounds in UNITS, and its classes."""
    inspector = debulk.Inspector(
        None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, camera=layup.camera
    )
    pockets = [found.pocket for found in inspector.find(layup.scan).pockets]
    rows = []
    for number, true in enumerate(layup.truth.pockets, 1):
        near = [p for p in pockets if np.hypot(*(middle(p.outline_mm) - middle(true.outline_mm))) < 3]
        row = {"name": f"pocket {number} of seed {seed}", "found": len(near) == 1}
        rows.append(row)
        if not row["found"]:
            continue
        p = near[0]
        row["area"] = 100 * (p.area_mm2 / true.area_mm2 - 1)
        row["peak"] = p.peak_mm - true.peak_mm
        row["volume"] = 100 * (p.volume_mm3 / true.volume_mm3 - 1)
        row["gap"] = gap_at_rim(layup, true.outline_mm, layup.truth.mold_height)
        row["edge"] = true.touches_ply_edge
        row["window"] = window_errors(layup, true, inspector.recipe.patch.smooth_mm)
        row["ideal"] = ideal_errors(layup, true)
    return rows


def line(name, what, rows):
    values = np.array([row[what] for row in rows])
    size = np.abs(values)

    def rms(x):
        return np.sqrt(np.mean(np.square(x)))

    window = f"{rms([row['window'][what] for row in rows]):9.3f}" if what != "peak" else " " * 9
    return (
        f"  {name:<38}{UNITS[what]:>3}{np.median(size):9.3f}{np.quantile(size, 0.9):9.3f}{size.max():9.3f}"
        f"{np.mean(values):+9.3f}{rms(values):9.3f}{window}{rms([row['ideal'][what] for row in rows]):9.3f}"
    )


def summary(title, rows):
    """Return one block of text."""
    lost = [row["name"] for row in rows if not row["found"]]
    rows = [row for row in rows if row["found"]]
    clear = [row for row in rows if not row["gap"]]
    classes = {
        "": rows,
        ", no drop-out at the rim": clear,
        ", the three smallest of a layup": [r for r in clear if int(r["name"].split()[1]) >= 12],
        ", at the ply's edge": [r for r in clear if r["edge"]],
    }
    out = [
        f"{title}: {len(rows)} pockets, {len(lost)} not found{''.join(', ' + name for name in lost)}, "
        f"{len(rows) - len(clear)} with a drop-out at the rim",
        f"{'':43}   median     90 %    worst     bias      rms   window    ideal",
    ]
    out += [line(what + name, what, part) for what in UNITS for name, part in classes.items()]
    for what, goal in GOALS.items():
        beyond = [row for row in clear if abs(row[what]) > goal]
        share = f"{len(beyond)} of {len(clear)}"
        out.append(f"  {what} off by more than {goal} {UNITS[what]}, no drop-out at the rim: {share}")
        for row in beyond if len(beyond) <= 8 else []:
            noise = f"window {row['window'][what]:.2f}, " if what != "peak" else ""
            out.append(f"    {row['name']}: {row[what]:+.2f} {UNITS[what]} ({noise}ideal {row['ideal'][what]:.2f})")
    return "\n".join(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="10-15", help="first-last")
    parser.add_argument("--size", nargs="+", default=["1280x960", "5120x3840"])
    parser.add_argument("-v", action="store_true")
    parser.add_argument("-o", type=Path, default=Path(__file__).with_name("accuracy.txt"))
    wanted = parser.parse_args()
    first, last = map(int, wanted.seeds.split("-"))
    held_out = "held out" if first > max(CHOSEN_ON) else "those that the method was chosen on among them"
    blocks = [__doc__.split("\n\n", 2)[2].strip()]
    for size in wanted.size:
        rows = []
        for seed in range(first, last + 1):
            rows += errors(debulk.scenes.layup(seed, tuple(map(int, size.split("x")))), seed)
            if wanted.v:
                for row in rows[-14:]:
                    print({k: np.round(v, 3) if isinstance(v, float) else v for k, v in row.items()}, flush=True)
        blocks.append(summary(f"{size.replace('x', ' x ')}, seeds {first} to {last} ({held_out})", rows))
        print(blocks[-1], flush=True)
    wanted.o.write_text("\n\n".join(blocks) + "\n")


if __name__ == "__main__":
    main()
