"""A scanner that scans cycle after cycle, with everything prepared once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from numpy.typing import ArrayLike

from debulk import _core
from debulk.arguments import typed, whole
from debulk.arrays import Singles
from debulk.forking import Guard
from debulk.scanner.arriving import Arriving, Camera
from debulk.scanner.calibration import Calibration
from debulk.scanner.decode import Phase, Planes, checked_blur, checked_start, decode_into, empty_maps, noise_of
from debulk.scanner.faults import ClearPixels, clear_pixels
from debulk.scanner.inputs import Image, InputError, Stack, checked_periods, checked_stack, checked_steps
from debulk.scanner.triangulate import Scan, empty_cloud, triangulate_into
from debulk.stopping import Running, stop_after
from debulk.workers import Workers

Progress = Callable[[str, float], None]
# What was taken of a camera's images while they arrived, and samples of them.
Before = tuple[Planes | None, Sequence[Image]]
_NOTHING: Before = None, ()
_AT_ONCE = 4  # steps on threads of their own: both cameras are decoded and judged


class ScanCancelled(RuntimeError):
    """The scan was cancelled from another thread; there is no cloud."""


class ScanTooLate(RuntimeError):
    """The deadline passed before the cloud was complete."""


class Scanner:
    """Two cameras and a projector: from their fringe images to the organised cloud, cycle after cycle.

    Rectification maps and memory are prepared here and kept. One object scans one scene at a time.

    Parameters
    ----------
    calibration
        Calibration of the two cameras.
    periods, steps, bits, sensor_noise, blur_px, start_phase_rad
        As in `debulk.scanner.decode`. The right camera takes the start phase that was estimated for the left one.
    details
        Whether to keep the data for a picture of the scan, the left camera's order residual. It takes 4 bytes per
        pixel, in addition to 26 for the phases of both cameras and 16 for the positions of their rectified pixels.
    threads
        Number of threads; 0 means as many as the process may use. The result does not depend on it.

    Raises
    ------
    debulk.InputError
        If an argument is out of its range.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=1, pixels=(64, 48))
    >>> images = debulk.scenes.fringe_images(layup, pixels=(320, 240))
    >>> scanner = Scanner(images.calibration)
    >>> scan = scanner.scan(images.left, images.right)
    >>> scan.points_mm.shape
    (240, 320, 3)
    """

    @typed
    def __init__(
        self,
        calibration: Calibration,
        periods: Sequence[int] = (50, 51),
        steps: int = 6,
        *,
        bits: int | None = None,
        sensor_noise: tuple[float, float] | None = None,
        blur_px: float | None = None,
        start_phase_rad: float | None = None,
        details: bool = False,
        threads: int = 0,
    ) -> None:
        self.calibration = calibration
        self.periods = checked_periods(periods)
        self.steps = checked_steps(steps, self.periods)
        self.bits = bits
        self.sensor_noise = sensor_noise
        self.blur_px = checked_blur(blur_px)
        self.start = checked_start(start_phase_rad)
        self.threads = whole("threads", threads, 0, 1024)
        self.left: Phase | None = None
        """The left camera's phase of the last scan, in memory that the next scan overwrites."""
        self.right: Phase | None = None
        calibration.rectified  # noqa: B018  prepared now, not in the first cycle
        shape = calibration.pixels[1], calibration.pixels[0]
        self._maps = empty_maps(shape, *(("residual",) if details else ())), empty_maps(shape)
        self._planes: tuple[list[Planes], list[Planes]] = [], []  # kept from scans of one exposure, and of several
        self._running = Running()
        self._busy = Guard()

    def __getstate__(self) -> NoReturn:
        raise TypeError("a Scanner cannot be pickled or copied: make one in each process, from the calibration's file")

    def scan(
        self,
        left_images: ArrayLike | Sequence[Any],
        right_images: ArrayLike | Sequence[Any],
        deadline_s: float | None = None,
        progress: Progress | None = None,
        *,
        out: tuple[Singles, Singles] | None = None,
    ) -> Scan:
        """Decode both cameras' images and triangulate.

        Parameters
        ----------
        left_images, right_images
            Images as in `debulk.scanner.decode`, of the calibration's size.
        deadline_s
            Seconds from now after which the scan ends with `ScanTooLate`; None means no deadline.
        progress
            Function that is called from the calling thread with the name of the stage and the share of the work that is
            done.
        out
            Memory for the points, (H, W, 3), and the uncertainty, (H, W), float32 and C-contiguous, so that a cycle
            allocates nothing large; ``calibration.rectified.pixels`` are W and H. None: new arrays.

        Returns
        -------
        Scan
            The cloud. The scanner's `left` and `right` hold the phases from which it was made.

        Raises
        ------
        debulk.InputError
            If images are wrong, or a camera was moved; the message says which, and there is no cloud.
        ScanCancelled
            If `cancel` was called.
        ScanTooLate
            If the deadline passed.
        """
        return self._scanned(left_images, right_images, deadline_s, progress, out)

    @typed
    def arriving(self, exposures: int = 1) -> Arriving:
        """Begin a scan whose images are taken in while they arrive.

        As soon as all steps of a number of periods are there, their phases are computed; a longer exposure takes the
        place of a shorter one where no step is saturated. The cloud has the bits of `scan`. With the default patterns
        it takes 17 bytes per pixel and camera more than `scan`, and with several exposures 29; when the scan is let go,
        the scanner keeps them for the next one.

        Parameters
        ----------
        exposures
            Number of exposures of each image.

        Examples
        --------
        >>> import debulk
        >>> layup = debulk.scenes.layup(seed=1, pixels=(64, 48))
        >>> images = debulk.scenes.fringe_images(layup, pixels=(320, 240), exposures=(1.0,))
        >>> scanner = Scanner(images.calibration)
        >>> arriving = scanner.arriving()
        >>> for left, right in zip(images.left[0], images.right[0]):
        ...     arriving.add(left, right)
        >>> arriving.cloud().points_mm.shape
        (240, 320, 3)
        """
        count = whole("exposures", exposures, 1, 254)
        shape = self.calibration.pixels[1], self.calibration.pixels[0]
        given = shape, self.periods, self.steps, count, self.bits, self._planes[count > 1]
        cameras = Camera("left_images", *given), Camera("right_images", *given)
        return Arriving(cameras, self._scanned, self.threads)

    def _scanned(
        self,
        left_images: Any,
        right_images: Any,
        deadline_s: float | None,
        progress: Progress | None,
        out: tuple[Singles, Singles] | None,
        before: Sequence[Before] = (_NOTHING, _NOTHING),
    ) -> Scan:
        stop = stop_after(deadline_s)
        report = progress or (lambda stage, done: None)
        with self._busy.held(), self._running.holding(stop):
            try:
                with Workers(1 if self.threads == 1 else _AT_ONCE, stop) as pool:
                    return self._scan(left_images, right_images, out, report, stop, pool, before)
            except _core.Stopped:
                if stop.cancelled:
                    raise ScanCancelled("the scan was cancelled") from None
                raise ScanTooLate(f"the deadline of {deadline_s:g} s passed before the cloud was there") from None

    def cancel(self) -> None:
        """End the running scan, from any thread; it raises `ScanCancelled` after some milliseconds."""
        self._running.cancel()

    def _scan(
        self,
        left_images: Any,
        right_images: Any,
        out: tuple[Singles, Singles] | None,
        report: Progress,
        stop: _core.Stop,
        pool: Workers,
        before: Sequence[Before],
    ) -> Scan:
        """Run each stage in the pool's threads, so that Ctrl-C reaches this thread while the core computes."""
        count = len(self.periods) * self.steps
        report("checking images", 0.0)
        shape = self.calibration.pixels[1], self.calibration.pixels[0]
        stacks = [
            checked_stack(images, count, name, self.bits, sampled)
            for images, name, (_, sampled) in zip(
                (left_images, right_images), ("left_images", "right_images"), before, strict=True
            )
        ]
        for stack in stacks:
            if stack.shape != shape:
                raise InputError(
                    f"{stack.name}: expected images of shape {shape}, the calibration's, but got {stack.shape}"
                )

        # Each camera has half of the threads, so that what one does on a single thread leaves no core idle. The images
        # are judged beside the decoding, which needs only the start phase before.
        half = ((self.threads or _core.default_threads()) + 1) // 2
        fringes = self.periods, self.steps

        def looked_at(stack: Stack) -> tuple[tuple[float, float], ClearPixels]:
            noise = noise_of(stack, self.steps, self.sensor_noise, half, stop)
            return noise, clear_pixels(stack, *fringes, noise)

        looks = [pool.submit(looked_at, stack) for stack in stacks]
        clear = looks[0].result()[1]
        start = pool.submit(clear.start).result() if self.start is None else self.start
        decoding = []
        for maps, stack, look, (kept, _) in zip(self._maps, stacks, looks, before, strict=True):
            given = maps, stack, *fringes, look.result()[0], start, self.blur_px, half, stop
            decoding.append(pool.submit(decode_into, *given, planes=kept))
        judged = [pool.submit(look.result()[1].refuse_faults, start) for look in looks]
        report("decoding left", 0.1)
        left = decoding[0].result()
        report("decoding right", 0.4)
        right = decoding[1].result()
        report("triangulating", 0.7)
        points, uncertainty = out or empty_cloud(self.calibration)
        triangulating = pool.submit(
            triangulate_into, points, uncertainty, left, right, self.calibration, self.threads, stop
        )
        for one in judged:
            one.result()
        self.left, self.right = left, right
        scan = triangulating.result()
        report("triangulating", 1.0)
        return scan
