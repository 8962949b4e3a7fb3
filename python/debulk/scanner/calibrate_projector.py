"""Determining the projector from scans that are known to be right."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from debulk.scanner.calibration import Calibration
from debulk.scanner.inputs import InputError
from debulk.scanner.scanner import Scanner
from debulk.scanner.third_view import learn, sampled


def calibrate_projector(
    calibration: Calibration,
    views: Sequence[tuple[Any, Any]],
    periods: Sequence[int] = (50, 51),
    steps: int = 6,
    *,
    bits: int | None = None,
) -> Calibration:
    """Determine where the projector is, so that later scans can detect that a camera was turned.

    The rows of the two images reveal a camera that was tilted, but not one that was turned about the vertical axis:
    0.01 degrees change all depths by a thousandth (2.6 mm at 2.4 m with cameras 420 mm apart). With the projector,
    every scan is checked against a third view. Do this right after `calibrate`, before anything can have moved.

    Parameters
    ----------
    calibration
        Calibration of the two cameras.
    views
        (left images, right images) as `Scanner.scan` takes them, of a plate at three distances, or of one surface with
        relief, such as the mold.
    periods, steps, bits
        As in `debulk.scanner.decode`.

    Returns
    -------
    Calibration
        The same cameras, with the projector.

    Raises
    ------
    debulk.InputError
        If images are not as expected, or all surfaces lie on one plane.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=1, pixels=(64, 48))
    >>> images = debulk.scenes.fringe_images(layup, pixels=(640, 480), bare=True)
    >>> calibration = calibrate_projector(images.calibration, [(images.left, images.right)])
    >>> bool(Scanner(calibration).scan(images.left, images.right).projector_mm < 0.1)
    True
    """
    if not views:
        raise InputError("views: expected images of at least one surface, but got none")
    instrument = Scanner(calibration.with_projector(None), periods, steps, bits=bits)
    seen = []
    for left_images, right_images in views:
        scan = instrument.scan(left_images, right_images)
        assert instrument.left is not None
        seen.append(sampled(scan.points_mm, instrument.left, calibration.rectified))
    return calibration.with_projector(learn(seen))
