"""Fringe images that are taken in while they arrive, so that little is left to do after the last one."""

from __future__ import annotations

import weakref
import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.scanner.decode import Planes
from debulk.scanner.inputs import Image, InputError, checked_image, greatest_grey, sample_of
from debulk.scanner.triangulate import Scan

Complete = Callable[..., Scan]


class Camera:
    """The images of one camera so far, and what was taken of them."""

    def __init__(
        self,
        name: str,
        shape: tuple[int, int],
        periods: tuple[int, ...],
        steps: int,
        exposures: int,
        bits: int | None,
        kept: list[Planes],
    ) -> None:
        self.name, self.shape, self.periods, self.steps, self.exposures = name, shape, periods, steps, exposures
        self.bits, self.kept = bits, kept
        self.images: list[Image] = []
        self.marks: list[int] = []  # of each image as it came
        self.sampled: list[Image] = []  # of each image but the last
        self.planes: Planes | None = None

    @property
    def each(self) -> int:
        """Number of images of an exposure."""
        return self.steps * len(self.periods)

    def named(self, number: int) -> str:
        """Return what an image is called in a message."""
        e, k = divmod(number, self.each)
        return f"{self.name}, image {k + 1}" + (f" of exposure {e + 1}" if self.exposures > 1 else "")

    def checked(self, image: ArrayLike) -> Image:
        """Check the next image."""
        if len(self.images) == self.each * self.exposures:
            raise InputError(f"{self.name}: expected {len(self.images)} images, but got another one")
        which = self.named(len(self.images))
        found = checked_image(image, which)
        if found.shape != self.shape:
            raise InputError(
                f"{which}: expected an image of shape {self.shape}, the calibration's, but got {found.shape}"
            )
        if self.images and found.dtype != self.images[0].dtype:
            raise InputError(f"{which}: expected {self.images[0].dtype} like the first image, but got {found.dtype}")
        return found

    def add(self, image: Image, threads: int) -> None:
        """Keep an image; sample all but the last, and take in those of each number of periods that is complete."""
        e, k = divmod(len(self.images), self.each)
        self.images.append(image)
        self.marks.append(_mark(image))
        if image.dtype.kind == "f" or len(self.images) == self.each * self.exposures:
            return
        self.sampled.append(sample_of(image))
        if (k + 1) % self.steps:
            return
        if self.planes is None:
            planes = self.kept.pop() if self.kept else self._new_planes()
            weakref.finalize(self, self.kept.append, planes)  # for the next scan
            self.planes = replace(planes, white=greatest_grey(image.dtype, self.bits))
        _core.scanner.take_in(
            self.images[-self.steps :],
            e,
            k // self.steps,
            periods=self.periods,
            saturated=float(self.planes.white),
            planes=self.planes.arrays,
            threads=threads,
            widest=4,
            stop=_core.Stop(),
        )

    def _new_planes(self) -> Planes:
        pixels, count = -(-self.shape[0] * self.shape[1] // 16) * 16, len(self.periods)
        return Planes(
            np.empty((2 + count, pixels), np.float32),
            np.empty((1 + count, pixels), np.float32) if self.exposures > 1 else None,
            np.empty(pixels, np.uint8),
            white=0,
        )

    def stack(self) -> list[list[Image]]:
        """Return all images, exposure by exposure, and refuse those that somebody wrote into."""
        for number, (image, mark) in enumerate(zip(self.images, self.marks, strict=True)):
            if _mark(image) != mark:
                raise InputError(f"{self.named(number)}: expected memory that keeps the image, but it was written into")
        return [self.images[e * self.each : (e + 1) * self.each] for e in range(self.exposures)]


def _mark(image: Image) -> int:
    """Return a checksum of the middle row, in which another image of fringes differs."""
    return zlib.crc32(image[len(image) // 2])


class Arriving:
    """A scan whose images arrive one after the other; `Scanner.arriving` begins it.

    No thread belongs to it: `add` does its work before it returns. A scan that is given up needs no end.
    """

    def __init__(self, cameras: tuple[Camera, Camera], complete: Complete, threads: int) -> None:
        self._cameras, self._complete, self._threads = cameras, complete, threads

    @property
    def missing(self) -> int:
        """Number of images of each camera that have not arrived yet."""
        camera = self._cameras[0]
        return camera.each * camera.exposures - len(camera.images)

    def add(self, left_image: ArrayLike, right_image: ArrayLike) -> None:
        """Take in the next image of both cameras.

        The shortest exposure comes first, and in each all steps of the first number of periods, then those of the
        second, and so on. An image that is refused does not count.

        Parameters
        ----------
        left_image, right_image
            (H, W) as in `debulk.scanner.decode`. They are kept, and not copied: nobody may write into them until the
            cloud is there; give copies where the camera's driver does.

        Raises
        ------
        debulk.InputError
            If an image has another shape than the calibration's, or another type than the one before, or is one too
            many. Images out of their order have to be seen together: `cloud` names them.
        """
        both = [camera.checked(image) for camera, image in zip(self._cameras, (left_image, right_image), strict=True)]
        for camera, image in zip(self._cameras, both, strict=True):
            camera.add(image, self._threads)

    def cloud(
        self,
        deadline_s: float | None = None,
        progress: Callable[[str, float], None] | None = None,
        *,
        out: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None,
    ) -> Scan:
        """Return the cloud of all images, with the bits of `Scanner.scan`, which has the same arguments and errors.

        The deadline counts from this call. `Scanner.cancel` ends it.

        Raises
        ------
        debulk.InputError
            Also if images are missing, or somebody wrote into the memory of one, as drivers that use it again do.
        """
        if self.missing:
            came = len(self._cameras[0].images)
            raise InputError(f"images: expected {came + self.missing} of each camera, but only {came} have arrived")
        stacks: list[Any] = [camera.stack() for camera in self._cameras]
        before = [(camera.planes, camera.sampled) for camera in self._cameras]
        return self._complete(*stacks, deadline_s, progress, out, before)
