"""Compare the virtual scanner with its truth, from fringe images to verdicts; writes virtual.txt and virtual.png.

.venv/bin/python bench/scanner/virtual.py [--seeds 11 12 13 14 15] [--pixels 2560x1920]
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from debulk import InputError, scanner, scenes
from debulk.inspection.inspector import Inspector

HERE = Path(__file__).resolve().parent


def order_errors(phase, truth):
    """Return the numbers of pixels whose phase is more than half a period off, that have a phase, and that are lit."""
    lit = np.isfinite(truth)
    off = phase.phase_rad - truth
    there = np.isfinite(off) & lit
    return np.array([np.count_nonzero(np.abs(off[there]) > np.pi), np.count_nonzero(there), np.count_nonzero(lit)])


def inspected(layup, reference, scan, pose, camera):
    """Return the report, and the verdicts and ridges of the pockets found at each true bump; pockets come first."""
    report = Inspector(None, reference, layup.ply_outline, (0, 90), mold_from_scanner=pose, camera=camera).inspect(scan)
    bumps = (*layup.truth.pockets, *layup.truth.decoys)
    found = [[] for _ in bumps]
    for pocket in report.pockets:
        away = [np.hypot(*(pocket.outline_mm.mean(axis=0) - bump.centre_mm)) for bump in bumps]
        found[int(np.argmin(away))].append(pocket)
    return report, found


def said(pockets):
    if not pockets:
        return "not found"
    return " and ".join(
        p.verdict.name + (f" (ridge {p.ridge_height_mm:.3f} mm)" if p.ridge_height_mm is not None else "")
        for p in pockets
    )


def study(seed, pixels, lines, totals, keep):
    layup = scenes.layup(seed=seed, pixels=(320, 240))
    ply = scenes.fringe_images(layup, pixels)
    bare = scenes.fringe_images(layup, pixels, bare=True)
    instrument = scanner.Scanner(ply.calibration, details=True)
    reference = instrument.scan(bare.left, bare.right).points_mm
    second = None
    if keep:  # only once, because it takes long
        again = scenes.fringe_images(layup, pixels, repeat=1)
        second = instrument.scan(again.left, again.right)
    scan = instrument.scan(ply.left, ply.right)
    for side, phase, truth in (
        ("left", instrument.left, ply.truth.left_phase_rad),
        ("right", instrument.right, ply.truth.right_phase_rad),
    ):
        totals["with"] += order_errors(phase, truth)
        images = getattr(ply, side)
        for e in range(len(images)):
            try:
                totals[f"exposure {e + 1}"] += order_errors(scanner.decode(images[e]), truth)
            except InputError as error:
                lines.append(f"  {side}, exposure {e + 1} alone: {error}")
    totals["read"] += sum(p.counts["read"] for p in (instrument.left, instrument.right)), ply.left.size + ply.right.size

    along = np.linalg.norm(scan.points_mm, axis=-1) - np.linalg.norm(ply.truth.points_mm, axis=-1)
    there = np.isfinite(along) & ply.truth.seen
    noise = np.sqrt(np.mean(scan.uncertainty_mm[there] ** 2))
    close = np.abs(along[there]) < 3
    bias = float(np.mean(along[there][close]))
    spread = 1.4826 * np.median(np.abs(along[there] - np.median(along[there])))
    lines.append(
        f"layup {seed}: {np.count_nonzero(np.isfinite(along)):,} points, "
        f"{100 * there.sum() / ply.truth.seen.sum():.2f} % of what both cameras see; predicted noise {noise:.3f} mm, "
        f"standard deviation of the error, the texture's "
        f"included, {spread:.3f} mm; mean error {bias:+.4f} mm, median {np.median(along[there]):+.4f} mm; "
        f"{100 * (1 - close.mean()):.3f} % more than 3 mm off, on edges; "
        f"rows agree within {scan.epipolar.error_px:.2f} px"
    )
    totals["bias"].append(abs(bias) / noise)
    if second is not None:
        pair = np.linalg.norm(scan.points_mm, axis=-1) - np.linalg.norm(second.points_mm, axis=-1)
        z = (pair / np.sqrt(scan.uncertainty_mm**2 + second.uncertainty_mm**2))[there & np.isfinite(pair)]
        quiet = np.abs(z) < 6
        totals["ratio"].append(np.sqrt(np.mean(z[quiet] ** 2)))
        lines.append(
            f"  two scans of it differ by {totals['ratio'][-1]:.3f} of what is predicted (rms, without the "
            f"{100 * (1 - quiet.mean()):.3f} % beyond six deviations)"
        )

    true_reference, true_scan = bare.truth.points_mm.copy(), ply.truth.points_mm.copy()
    pose, camera = ply.mold_from_scanner, scan.camera
    report, found = inspected(layup, reference, scan.points_mm, pose, camera)
    true_report, true_found = inspected(layup, true_reference, true_scan, pose, camera)
    same = 0
    for k, (mine, true) in enumerate(zip(found, true_found, strict=True)):
        agree = [p.verdict for p in mine] == [p.verdict for p in true]
        pocket = k < len(layup.truth.pockets)
        same += agree and pocket
        if not agree:
            lines.append(f"  {'pocket' if pocket else 'decoy'} {k + 1}: {said(mine)}, from the true cloud {said(true)}")
    lines.append(
        f"  {len(report.pockets)} pockets, {len(true_report.pockets)} from the true cloud; {same} of "
        f"{len(layup.truth.pockets)} verdicts the "
        f"same; the layup: {report.verdict.name}, from the true cloud {true_report.verdict.name}"
    )
    totals["same"] += same, len(layup.truth.pockets)
    if keep:
        draw(ply, scan, instrument, along)


def draw(ply, scan, instrument, along):
    raw = [cv2.cvtColor(image[1, 0], cv2.COLOR_GRAY2BGR) for image in (ply.left, ply.right)]
    size = 700, round(700 * raw[0].shape[0] / raw[0].shape[1])
    off = np.clip((np.nan_to_num(along, nan=-9) + 1) * 127.5, 0, 255).astype(np.uint8)
    error = cv2.applyColorMap(off, cv2.COLORMAP_TWILIGHT_SHIFTED)
    error[~np.isfinite(along)] = 60
    titles = ("left camera, exposure 2, first pattern", "right camera, the same", "error along the ray, -1 to 1 mm")
    parts = []
    for image, title in zip((*raw, error), titles, strict=True):
        head = np.full((26, 700, 3), 255, np.uint8)
        cv2.putText(head, title, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1, cv2.LINE_AA)
        parts.append(np.vstack([head, cv2.resize(image, size, interpolation=cv2.INTER_AREA)]))
    parts.append(np.full_like(parts[0], 255))
    four = scanner.picture(scan, instrument.left, 1400)
    picture = np.vstack([np.hstack(parts[:2]), np.hstack(parts[2:]), four])
    # Noise does not compress well, so the picture has fewer pixels and sixteen levels of each colour.
    small = cv2.resize(picture, (900, 900 * picture.shape[0] // picture.shape[1]), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(HERE / "virtual.png"), small // 16 * 16 + 8)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12, 13, 14, 15])
    parser.add_argument("--pixels", default="2560x1920")
    parser.add_argument("-o", "--output", type=Path, default=HERE / "virtual.txt")
    given = parser.parse_args()
    pixels = tuple(int(n) for n in given.pixels.split("x"))
    totals = {name: np.zeros(3, int) for name in ("with", "exposure 1", "exposure 2", "exposure 3")}
    totals |= {"read": np.zeros(2, int), "same": np.zeros(2, int), "ratio": [], "bias": []}
    lines = []
    for k, seed in enumerate(given.seeds):
        study(seed, pixels, lines, totals, k == 0)
        print(*lines[-3:], sep="\n", flush=True)
    head = [
        f"The virtual scanner, {pixels[0]} x {pixels[1]} pixels, 8 bits, exposures 1, 4, 16, 6 steps of 50 and "
        f"51 periods, layups "
        f"{', '.join(map(str, given.seeds))}.",
        "",
        "Fringe orders, of the pixels that the projector lights:",
    ]
    for name, (wrong, decoded, lit) in ((n, totals[n]) for n in ("with", "exposure 1", "exposure 2", "exposure 3")):
        title = "all three exposures (HDR)" if name == "with" else f"{name} alone"
        head.append(
            f"  {title}: {wrong} wrong = {wrong / max(lit, 1):.1e}; {100 * decoded / max(lit, 1):.2f} % have a phase"
        )
    head += [
        f"Grey values read: {totals['read'][0] / totals['read'][1]:.3f} of all (without the checks' sample)",
        f"Depth noise over the predicted: {min(totals['ratio']):.3f} to {max(totals['ratio']):.3f} (wanted: 0.8 "
        f"to 1.2)",
        f"Mean error over the noise: {max(totals['bias']):.4f} at most (wanted: below 0.2)",
        f"Verdicts as from the true cloud: {totals['same'][0]} of {totals['same'][1]}",
        "",
    ]
    given.output.write_text("\n".join([*head, *lines]) + "\n")
    print(given.output.read_text())


if __name__ == "__main__":
    main()
