"""Decode and match the real captures of ../shared/data/two_frequency_fringes; writes real.txt and real.png.

.venv/bin/python bench/scanner/real.py FOLDER
"""

import sys
from pathlib import Path

import cv2
import numpy as np

from debulk import scanner

HERE = Path(__file__).resolve().parent


def camera(folder, c):
    first = [folder / f"frames{c}_{i}.png" for i in range(2, 10)]
    second = [folder / f"secondary_cam{c + 1}" / f"frames{c}_{i}.png" for i in range(10, 18)]
    return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in (*first, *second)]


def main():
    folder = Path(sys.argv[1])
    phases = [scanner.decode(camera(folder, c), (40, 41), 8) for c in (0, 1)]
    lines = ["Two cameras, 1850 x 1137, 8 steps of 40 and 41 periods, real."]
    for name, phase in zip(("left", "right"), phases, strict=True):
        residual = phase.order_residual[np.isfinite(phase.order_residual)]
        lines.append(
            f"{name}: {residual.size:,} lit pixels, {100 * (residual < 0.4).mean():.2f} % within 0.4 of a whole "
            f"fringe order, median "
            f"{np.median(residual):.3f}; {phase.counts['repaired']:,} orders decided by the pixels beside, "
            f"{np.isfinite(phase.phase_rad).sum():,} phases, noise {np.nanmedian(phase.noise_rad):.4f} rad"
        )
    disparity, sigma = scanner.match(*phases)
    bend = disparity[:, 2:] - 2 * disparity[:, 1:-1] + disparity[:, :-2]
    bend = np.sort(np.abs(bend[np.isfinite(bend)]))
    lines.append(
        f"matched: {np.isfinite(disparity).sum():,} pixels, {np.nanpercentile(disparity, 0.5):.0f} to "
        f"{np.nanpercentile(disparity, 99.5):.0f} px; "
        f"noise along the rows {1.4826 * np.median(bend) / np.sqrt(6):.3f} px by the median of second differences, "
        f"{np.sqrt(np.mean(bend[: int(0.9 * bend.size)] ** 2) / 6):.3f} px rms without the tenth at folds and "
        f"edges; predicted {np.nanmedian(sigma):.3f} px"
    )
    (HERE / "real.txt").write_text("\n".join(lines) + "\n")
    print(*lines, sep="\n")
    low, high = np.nanpercentile(disparity, [0.2, 99.8])
    known = np.isfinite(disparity)
    grey = np.clip((np.where(known, disparity, low) - low) / (high - low) * 255, 0, 255).astype(np.uint8)
    colour = cv2.applyColorMap(grey, cv2.COLORMAP_VIRIDIS)
    colour[~known] = 40
    rows, columns = np.nonzero(known)
    cv2.imwrite(str(HERE / "real.png"), colour[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1])


if __name__ == "__main__":
    main()
