"""Measure the way from images in memory to a cloud, and compare it with NumPy and OpenCV; writes speed.txt.

    .venv/bin/python bench/scanner/speed.py [--pixels 5120x3840] [--threads 2] [--no-numpy]

It measures time, memory, how often the images are read, and what is left after the last pair of images if the others
are taken in while they arrive. The images show one synthetic plane, drawn row by row: 2 x 12 images of three exposures,
with 8 bits and with 12 bits in 16.
"""

import argparse
import resource
import sys
import time
from pathlib import Path

import cv2
import numpy as np

from debulk import scanner

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "front"))
from pipeline import after_last, handed_over  # noqa: E402

PERIODS, STEPS = (50, 51), 6


def cameras(width, height):
    f = 1.1 * width
    matrix = np.array([[f, 0, (width - 1) / 2], [0, f, (height - 1) / 2], [0, 0, 1]])
    turn = cv2.Rodrigues(np.array([0.002, 0.17, 0.003]))[0]
    return scanner.Calibration(
        [matrix, matrix], [[-0.09, 0.06, 4e-4, -3e-4, 0.0]] * 2, turn, turn @ [-420.0, 0, 0], (width, height)
    )


def images(calibration, bits, rng):
    """Return images, with noise, of a plane at 2.4 m whose reflectance spans the range of three exposures."""
    width, height = calibration.pixels
    white, kind = (255, np.uint8) if bits == 8 else (4095, np.uint16)
    out = []
    noise = rng.normal(0, white / 255, (height // 8, width)).astype(np.float32)
    for k in range(2):
        # Every fourth pixel: OpenCV's resize takes each value to be in the middle of four pixels.
        column, row = np.meshgrid(np.arange(1.5, width, 4.0), np.arange(1.5, height, 4.0))
        at = np.stack([column.ravel(), row.ravel()], 1)[:, None]
        exact = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-10)
        lens = calibration.camera_matrices[k], calibration.distortions[k]
        seen = cv2.undistortPoints(at, *lens, criteria=exact).reshape(-1, 2)
        rays = np.column_stack([seen, np.ones(len(seen))])
        turn = np.eye(3) if k == 0 else calibration.rotation
        origin = np.zeros(3) if k == 0 else -turn.T @ calibration.translation_mm
        way = rays @ turn  # in the left camera's frame
        depth = (2400 - origin[2]) / way[:, 2]
        points = origin + depth[:, None] * way
        u = ((points[:, 0] - 210) / 2800 + 0.5).reshape(column.shape).astype(np.float32)
        u = cv2.resize(u, (width, height))  # linear, because OpenCV's cubics bend straight lines
        v = points[:, 1].reshape(column.shape).astype(np.float32)
        bright = cv2.resize(
            0.04 + 0.6 * (0.5 + 0.5 * np.sin(v / 90 + points[:, 0].reshape(column.shape) / 130)) ** 4, (width, height)
        ).astype(np.float32)
        across = points[:, 0].reshape(column.shape)
        bright *= cv2.resize(1 + 0.1 * np.sin(across / 9 + v / 7) * np.sin(v / 11 - across / 13), (width, height))
        stack = np.empty((3, 12, height, width), kind)
        for e, exposure in enumerate((1.0, 4.0, 16.0)):
            for p, n in enumerate(PERIODS):
                for s in range(STEPS):
                    for j in range(0, height, height // 8):
                        rows = slice(j, min(height, j + height // 8))
                        light = 0.55 + 0.43 * np.cos(2 * np.pi * (n * u[rows] + s / STEPS))
                        grey = (
                            bright[rows] * light * np.float32(exposure * white)
                            + np.roll(noise, 131 * (12 * e + 6 * p + s), axis=1)[: rows.stop - j]
                        )
                        stack[e, 6 * p + s, rows] = np.clip(np.rint(grey), 0, white)
        out.append(stack)
    return out


def by_numpy(stacks, calibration, white):
    """Do the same in a straightforward way: decode every exposure, choose the best, remap the phases and match
    them row by row."""
    rectified = calibration.rectified
    phases = []
    for stack in stacks:
        best = np.full(stack.shape[2:], np.nan, np.float32)
        for exposure in stack:  # a longer exposure overwrites a shorter one
            wrapped = []
            for p in range(2):
                part = exposure[6 * p : 6 * p + 6].astype(np.float32)
                turn = 2 * np.pi * np.arange(6) / 6
                wrapped.append(
                    np.arctan2(-np.tensordot(np.sin(turn), part, 1), np.tensordot(np.cos(turn), part, 1)) / (2 * np.pi)
                )
            beat = (wrapped[1] - wrapped[0]) % 1
            phase = 2 * np.pi * (wrapped[0] + np.rint(50 * beat - wrapped[0]))
            fine = exposure.max(axis=0) < white
            best[fine] = phase[fine]
        phases.append(best)
    left = cv2.remap(phases[0], *rectified.maps[:2], cv2.INTER_LINEAR, borderValue=float("nan"))
    right = cv2.remap(phases[1], *rectified.maps[2:], cv2.INTER_LINEAR, borderValue=float("nan"))
    disparity = np.full(left.shape, np.nan, np.float32)
    for j in range(left.shape[0]):
        fine = np.isfinite(right[j])
        if fine.sum() > 2:
            order = np.argsort(right[j][fine])
            x = np.interp(left[j], right[j][fine][order], np.flatnonzero(fine)[order], left=np.nan, right=np.nan)
            disparity[j] = np.arange(left.shape[1]) - x
    depth = rectified.focal_px * rectified.baseline_mm / (disparity + rectified.right_cx - rectified.left_centre[0])
    column, row = np.meshgrid(np.arange(left.shape[1], dtype=np.float32), np.arange(left.shape[0], dtype=np.float32))
    f, cx, cy = rectified.camera
    return np.dstack([(column - cx) / f * depth, (row - cy) / f * depth, depth])


def held_mb():
    """Return the memory that the process holds now, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pixels", default="5120x3840")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--cycles", type=int, default=5)
    parser.add_argument("--no-numpy", action="store_true")
    given = parser.parse_args()
    width, height = (int(n) for n in given.pixels.split("x"))
    lines = [
        f"Images in memory to cloud, {width} x {height} pixels, 2 x 12 images of 3 exposures, {given.threads} threads."
    ]
    calibration = cameras(width, height)
    for bits in (8, 12):
        instrument = scan = out = plane = other = apart = None  # free the memory of the other bit depth
        left, right = images(calibration, bits, np.random.default_rng(0))
        before = held_mb()
        instrument = scanner.Scanner(calibration, PERIODS, STEPS, threads=given.threads)
        out = np.empty((height, width, 3), np.float32), np.empty((height, width), np.float32)
        times, held, cpu = [], [], []
        for _ in range(given.cycles):
            began, used = time.perf_counter(), time.process_time()
            scan = instrument.scan(left, right, out=out)
            times.append(time.perf_counter() - began)
            cpu.append(time.process_time() - used)
            held.append(held_mb() - before - out[0].nbytes / 1e6 - out[1].nbytes / 1e6)
        read = sum(phase.counts["read"] for phase in (instrument.left, instrument.right)) / (left.size + right.size)
        plane = scan.points_mm[::8, ::8] @ calibration.rectified.rotation  # back to the left camera's frame
        off = plane[..., 2][np.isfinite(plane[..., 2])] - 2400
        lines.append(
            f"{bits} bits: {np.median(times):.2f} s in the median of {given.cycles} cycles, {min(times):.2f} s "
            f"the fastest, CPU {np.median(cpu):.2f} s; "
            f"{read:.3f} of all grey values are read; extra memory {held[0]:.0f} MB after the first cycle, "
            f"{held[-1]:.0f} MB after the last; "
            f"{100 * scan.counts['matched'] / (width * height):.1f} % of the pixels have a point, off the plane "
            f"by {np.median(np.abs(off)):.3f} mm in the median"
        )
        print(lines[-1], flush=True)
        arriving = handed_over(instrument, left, right)
        took = [after_last(arriving, left, right, out)[1:] for _ in range(given.cycles)]
        lines.append("  after the last pair of images {:.2f} s, CPU {:.2f} s".format(*np.median(took, axis=0)))
        arriving = None
        print(lines[-1], flush=True)
        if not given.no_numpy:
            began = time.perf_counter()
            other = by_numpy((left, right), calibration, 255 if bits == 8 else 4095)
            seconds = time.perf_counter() - began
            apart = np.abs(np.linalg.norm(other, axis=-1) - np.linalg.norm(scan.points_mm, axis=-1))
            lines.append(
                f"  NumPy and OpenCV: {seconds:.1f} s, {seconds / np.median(times):.0f} times as long; clouds "
                f"apart by {np.nanmedian(apart):.4f} mm in the median"
            )
            print(lines[-1], flush=True)
    (HERE / "speed.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
