"""A picture of a scan: the quality of each pixel's phase, and the depth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.scanner.decode import NO_EXPOSURE, Phase
from debulk.scanner.inputs import InputError
from debulk.scanner.triangulate import Scan

_GREY = (60, 60, 60)
_TITLE_PIXELS = 26


def picture(scan: Scan, left: Phase, width: int = 1400) -> NDArray[np.uint8]:
    """Draw modulation, chosen exposure, order residual and depth of a scan, two by two.

    Parameters
    ----------
    scan, left
        Results of a `debulk.scanner.Scanner` with ``details``.
    width
        Width of the picture in pixels.

    Returns
    -------
    NDArray[np.uint8]
        (height, width, 3), blue, green, red as OpenCV writes them. Grey means that nothing is known.

    Raises
    ------
    debulk.InputError
        If the phase has no order residual.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=1, pixels=(64, 48))
    >>> images = debulk.scenes.fringe_images(layup, pixels=(320, 240))
    >>> scanner = debulk.scanner.Scanner(images.calibration, details=True)
    >>> scan = scanner.scan(images.left, images.right)
    >>> picture(scan, scanner.left, 800).shape
    (652, 800, 3)
    """
    if left.order_residual is None:
        raise InputError("left: expected a phase with its order residual: make the scanner with details=True")
    light = left.modulation / np.asarray([*left.brightness, *[1.0] * 256])[:256].astype(np.float32)[left.exposure]
    chosen = np.where(left.exposure == NO_EXPOSURE, np.nan, left.exposure).astype(np.float32)
    depth = scan.points_mm[..., 2]
    low, high = (float(v) for v in np.nanpercentile(depth, [1, 99])) if np.isfinite(depth).any() else (0.0, 1.0)
    last = max(1, len(left.brightness) - 1)
    parts = [
        _part(np.log10(np.maximum(light, 1e-3)), None, None, "modulation at the shortest exposure, log", width // 2),
        _part(
            chosen, 0, last, f"exposure, 1 to {last + 1 if len(left.brightness) > 1 else 1}, longest bright", width // 2
        ),
        _part(left.order_residual, 0, 0.5, "fringe order's distance to a whole number, 0 to 0.5", width // 2),
        _part(depth, low, high, f"depth, {low:.0f} to {high:.0f} mm", width // 2),
    ]
    # The depths are on the rectified image, which can have another shape than the camera's.
    tall = max(part.shape[0] for part in parts)
    parts = [np.pad(part, ((0, tall - part.shape[0]), (0, 0), (0, 0)), constant_values=255) for part in parts]
    return np.vstack([np.hstack(parts[:2]), np.hstack(parts[2:])])


def _part(values: NDArray[Any], low: float | None, high: float | None, title: str, width: int) -> NDArray[np.uint8]:
    import cv2

    size = width, round(values.shape[0] * width / values.shape[1])
    small = cv2.resize(values.astype(np.float32), size, interpolation=cv2.INTER_NEAREST)
    known = np.isfinite(small)
    if low is None or high is None:
        low, high = (float(v) for v in np.nanpercentile(small, [1, 99])) if known.any() else (0.0, 1.0)
    grey = np.clip((np.where(known, small, low) - low) / max(high - low, 1e-9) * 255, 0, 255).astype(np.uint8)
    colour = cv2.applyColorMap(grey, cv2.COLORMAP_VIRIDIS)
    colour[~known] = _GREY
    head = np.full((_TITLE_PIXELS, width, 3), 255, np.uint8)
    cv2.putText(head, title, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1, cv2.LINE_AA)
    return np.asarray(np.vstack([head, colour]), np.uint8)
