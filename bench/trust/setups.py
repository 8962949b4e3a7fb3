"""Layups given in the wrong way: python bench/trust/setups.py [--layups 31101 31104 ...] [--only NAME] [--out FILE].

A hundred ways to give scan, reference, pose, outline, mask, camera or recipe in another way than meant; most are not
among the mistakes of `debulk.scenes`. Some matter, some do not. In each of the layups one pocket creases, not much
above the limit, so that whatever hides or lowers it would let the layup pass: none may.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import InputError, Inspector
from debulk.recipe import Recipe
from lab.varied import varied_layup
from lab.varied.given import Given, given_right, moved, shift

LAYUPS = (31101, 31102, 31104, 31112, 31120, 31126)
LETTER = {"cease": "PASSED", "crease": "C", "undecided": "U", "invalid": "I"}
Cloud = NDArray[np.floating[Any]]


def of_place(given: Given) -> Iterator[tuple[str, Given]]:
    """Yield clouds in other frames, units and scales."""
    scan, reference, pose = given.scan.astype(float), given.reference.astype(float), given.mold_from_scanner
    assert pose is not None
    for far in (1e5, 1e6):
        away = np.array([0.2 * far, -0.3 * far, far])
        back = pose.copy()
        back[:3, 3] -= pose[:3, :3] @ away
        for kind in (np.float32, np.float64):
            clouds = {"scan": (scan + away).astype(kind), "reference": (reference + away).astype(kind)}
            yield f"scanner's origin {far:g} mm away, {kind.__name__}", replace(given, mold_from_scanner=back, **clouds)
        kept = (scan + away).astype(np.float32) - away
        yield f"scan rounded as {far:g} mm away", replace(given, scan=kept.astype(np.float32))
    middle = np.nanmean(scan.reshape(-1, 3), axis=0)
    for scale in (1.0005, 1.001, 1.003, 0.997):
        for name, about in (("the camera", np.zeros(3)), ("its middle", middle)):
            larger = ((scan - about) * scale + about).astype(np.float32)
            yield f"scan x {scale} about {name}", replace(given, scan=larger)
    yield "pose inverted", replace(given, mold_from_scanner=np.linalg.inv(pose))
    for up in (0.1, 0.2, -0.2):
        higher = moved(given.scan, given.motion_of_scanner(shift(z=up))).astype(np.float32)
        yield f"scan {up:+g} mm up", replace(given, scan=higher)
    for name, factor in (("inches", 1 / 25.4), ("centimetres", 0.1)):
        yield f"scan in {name}", replace(given, scan=scan * factor)
        yield f"both in {name}", replace(given, scan=scan * factor, reference=reference * factor)
    yield "scan mirrored", replace(given, scan=scan * [-1, 1, 1])
    yield "both mirrored", replace(given, scan=scan * [-1, 1, 1], reference=reference * [-1, 1, 1])
    yield "reference twice", replace(given, scan=given.reference)
    yield "scan twice", replace(given, reference=given.scan)
    yield "swapped", replace(given, scan=given.reference, reference=given.scan)


def of_camera_and_mask(given: Given, camera: tuple[float, float, float]) -> Iterator[tuple[str, Given]]:
    """Yield other cameras and masks."""
    f, cx, cy = camera
    for name, wrong in (
        ("centre swapped", (f, cy, cx)), ("f x 1.02", (f * 1.02, cx, cy)), ("3 pixels off", (f, cx + 3, cy - 2)),
        ("of half the pixels", (f / 2, cx / 2, cy / 2)),
    ):  # fmt: skip
        yield f"camera {name}", replace(given, camera=wrong)
    height, width = given.scan.shape[:2]
    mask = np.zeros((height, width), np.bool_) if given.mask is None else given.mask
    over = mask.copy()
    over[height // 4 : 3 * height // 4, width // 4 : 3 * width // 4] = True
    yield "mask inverted", replace(given, mask=~mask)
    yield "mask 60 pixels off", replace(given, mask=np.roll(mask, 60, axis=1))
    yield "mask over the middle", replace(given, mask=over)


def of_outline(given: Given) -> Iterator[tuple[str, Given]]:
    """Yield other outlines."""
    outline = given.ply_outline
    assert outline is not None
    middle, crossed = outline.mean(axis=0), outline.copy()
    crossed[[0, 1]] = crossed[[1, 0]]
    wrong = {"reversed": outline[::-1], "with crossing sides": crossed}
    wrong |= {f"x {scale}": (outline - middle) * scale + middle for scale in (0.9, 0.97, 1.03, 1.1)}
    wrong |= {f"{off} mm off": outline + np.array([off, 0]) for off in (8, 20, 60)}
    wrong |= {"turned by half": 2 * middle - outline, "mirrored": (outline - middle) * [-1, 1] + middle}
    wrong |= {"in metres": outline / 1000, "of three corners": outline[:3]}
    for name, corners in wrong.items():
        yield f"outline {name}", replace(given, ply_outline=corners)


def of_pixels(given: Given, rng: np.random.Generator) -> Iterator[tuple[str, Given]]:
    """Yield scans whose pixels were moved, thinned, repeated, interpolated, or drowned in noise."""
    scan = given.scan
    height, width = scan.shape[:2]
    wrong: dict[str, Cloud] = {f"rows rolled by {n}": np.roll(scan, n, axis=0) for n in (1, 3, 40)}
    wrong["every row twice"] = np.repeat(scan[::2], 2, axis=0)[:height]
    for n in (2, 4):
        wrong[f"{n} by {n} pixels alike"] = np.repeat(np.repeat(scan[::n, ::n], n, 0), n, 1)[:height, :width]
        wrong[f"1 pixel of {n} each way, linear between"] = cv2.resize(scan[::n, ::n], (width, height))
        cubic = cv2.resize(scan[::n, ::n], (width, height), interpolation=cv2.INTER_CUBIC)
        wrong[f"1 pixel of {n} each way, cubic between"] = cubic
    wrong["flipped"] = scan[:, ::-1]
    wrong["seen twice, 5 pixels apart"] = ((scan + np.roll(scan, 5, axis=1)) / 2).astype(np.float32)
    for share in (0.3, 0.5, 0.8):
        holed = scan.copy()
        holed[rng.random((height, width)) < share] = np.nan
        wrong[f"{100 * share:g} % of the pixels missing"] = holed
    for noise in (0.15, 0.4):
        wrong[f"noise of {noise} mm"] = (scan + rng.normal(0, noise, scan.shape) * [0, 0, 1]).astype(np.float32)
    for share in (0.05, 0.3):
        wild, which = scan.copy(), rng.random((height, width)) < share
        wild[which, 2] += rng.uniform(-100, 100, np.count_nonzero(which)).astype(np.float32)
        wrong[f"{100 * share:g} % of the points wild"] = wild
    for name, cloud in wrong.items():
        yield name, replace(given, scan=cloud)
    for n in (2, 4):
        yield f"1 pixel of {n} each way", replace(given, scan=scan[::n, ::n], mask=None)
    yield "transposed", replace(given, scan=scan.transpose(1, 0, 2), mask=None)
    points = scan[np.isfinite(scan).all(axis=2)]
    for n in (1, 4, 16):
        yield f"points in no order, 1 of {n}", replace(given, scan=rng.permutation(points)[::n], mask=None)


def of_heights(given: Given) -> Iterator[tuple[str, Given]]:
    """Yield scans whose heights a filter of the scanner's software has changed."""
    scan, reference = given.scan, given.reference
    above = given.in_mold(scan)[..., 2] - given.in_mold(reference)[..., 2]
    assert given.mold_from_scanner is not None
    up = given.mold_from_scanner[2, :3]
    for most in (1.5, 4.0):
        cut = scan.copy()
        cut[above > most] = np.nan
        yield f"nothing above {most:g} mm", replace(given, scan=cut)
    for least in (0.8, 2.0):
        filled = np.where((above > least)[..., None], reference, scan)
        yield f"the reference above {least:g} mm", replace(given, scan=filled)
    yield "half way to the reference", replace(given, scan=(reference + 0.5 * (scan - reference)).astype(np.float32))
    for pixels in (20, 60, 150):
        low = cv2.GaussianBlur(np.nan_to_num(above), (0, 0), pixels)
        flat = (scan - ((low - np.median(low))[..., None] * up)).astype(np.float32)
        yield f"without waves longer than {pixels} pixels", replace(given, scan=flat)


def of_recipe(given: Given) -> Iterator[tuple[str, Given]]:
    """Yield other recipes."""
    for section, name, values in (
        ("material", "thickness_mm", (0.1, 0.2, 0.35, 0.6)), ("segmentation", "area_tol_mm2", (6000.0,)),
        ("segmentation", "peak_tol_mm", (4.0, 8.0)), ("segmentation", "cut_height_mm", (3.5, 8.0)),
        ("net", "spacing_mm", (15.0, 30.0)), ("net", "node_target", (25, 400)), ("patch", "smooth_mm", (14.0, 60.0)),
        ("patch", "mold_tol_mm", (0.6, 1.5)), ("clean", "spike_mm", (0.1,)), ("clean", "median_cells", (15,)),
        ("clean", "std_ratio", (0.2, 6.0)),
    ):  # fmt: skip
        for value in values:
            yield f"{section}.{name} = {value:g}", replace(given, recipe={section: {name: value}})


def setups(seed: int) -> Iterator[tuple[str, Given]]:
    """Yield every set-up of a layup, with its name."""
    layup = varied_layup(seed, (1280, 960), pockets=1 + seed % 2, severity="any")
    given = given_right(layup)
    yield "as it is", given
    yield from of_place(given)
    yield from of_camera_and_mask(given, layup.camera)
    yield from of_outline(given)
    yield from of_pixels(given, np.random.default_rng(seed))
    yield from of_heights(given)
    yield from of_recipe(given)


def said(given: Given) -> tuple[str, str]:
    """Return a letter for the verdict, and the reason."""
    try:
        inspector = Inspector(
            Recipe(**given.recipe), given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner,
            given.camera, given.mask,
        )  # fmt: skip
        report = inspector.inspect(given.scan)
    except InputError as error:
        return "-", str(error)
    return LETTER[report.verdict.value], report.reason


def main() -> None:
    """Print the table, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--layups", type=int, nargs="+", default=LAYUPS)
    parser.add_argument("--only", default="", help="part of the names of the set-ups that are wanted")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    rows: dict[str, list[tuple[str, str]]] = {}
    began = time.perf_counter()
    for seed in args.layups:
        for name, given in setups(seed):
            if args.only in name:
                rows.setdefault(name, []).append(said(given))
                print(f"{seed} {name}: {' '.join(rows[name][-1])[:160]}", flush=True)
    counts = Counter(letter for cells in rows.values() for letter, _ in cells)
    about = (
        f"{len(rows)} set-ups of the layups {', '.join(map(str, args.layups))} of the second family. In each, one "
        "pocket creases. C: CREASE, U: UNDECIDED, I: INVALID, -: refused by an error that names what is wrong. The "
        "reason is the first layup's."
    )
    lines = ["LAYUPS GIVEN IN THE WRONG WAY", "", fill(about, 110), ""]
    lines += [
        f"passed {counts['PASSED']}; CREASE {counts['C']}, UNDECIDED {counts['U']}, INVALID {counts['I']}, "
        f"refused {counts['-']}",
        "",
    ]
    for name, cells in rows.items():
        lines.append(
            f"  {name:<44}{' '.join(f'{letter:<2}' for letter, _ in cells)}  {' '.join(cells[0][1].split())[:110]}"
        )
    text = "\n".join(lines) + "\n"
    print(text, f"\n{time.perf_counter() - began:.0f} s")
    if args.out:
        args.out.write_text(text)


if __name__ == "__main__":
    main()
