"""The images of fringes and of a Gray code that belong together, and the grey values of some of their pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Singles
from debulk.scanner.decode import NO_EXPOSURE
from debulk.scanner.gray_code import Code, read_code
from debulk.scanner.gray_patterns import code_images
from debulk.scanner.inputs import InputError, Stack, checked_stack

C64 = NDArray[np.complex64]


@dataclass(eq=False)
class GrayLight:
    """Grey values of some pixels in the exposure that was chosen for each, (n, ...)."""

    fringes: Singles
    code: Singles
    inverted: Singles | None
    white_black: Singles | None
    exposure: NDArray[np.uint8]
    """255 where every exposure is saturated."""

    def first_harmonic(self) -> C64:
        """Modulation times exp(i phase)."""
        return self.harmonic(1)

    def harmonic(self, order: int) -> C64:
        """Harmonic of the grey values over the steps."""
        steps = len(self.fringes)
        weight = 1 / steps if 2 * order == steps else 2 / steps
        turn = weight * np.exp(-2j * np.pi * order * np.arange(steps) / steps)
        return np.tensordot(turn.astype(np.complex64), self.fringes, 1)

    def read_code(self, modulation: Singles, offset: Singles) -> Code:
        """Read the bits by the inverted images, by white and black, or by the fringes."""
        if self.inverted is not None:
            return read_code(self.code - self.inverted, -2 * modulation, 2 * modulation)
        if self.white_black is not None:
            return read_code(self.code, self.white_black[1], self.white_black[0])
        return read_code(self.code, offset - modulation, offset + modulation)


@dataclass(frozen=True, eq=False)
class GrayStacks:
    """All images of one camera; every stack has the same exposures."""

    fringes: Stack
    code: Stack
    inverted: Stack | None
    white_black: Stack | None
    cells: int
    """Cells of the code in each period: 2 in a complementary code, otherwise 1."""

    def light(self, select: Any) -> GrayLight:
        """Take the brightest exposure in which no step is saturated, for each pixel of a part of the image."""
        stacks = self.fringes, self.code, self.inverted, self.white_black
        chosen: list[Singles | None] = []
        exposure = np.empty(0, np.uint8)
        for e in range(self.fringes.exposures - 1, -1, -1):
            here = [
                None if s is None else np.stack([i[select] for i in s.exposure(e)]).astype(np.float32) for s in stacks
            ]
            assert here[0] is not None
            fine = here[0].max(axis=0) < self.fringes.white
            if not chosen:
                chosen, exposure = here, np.where(fine, e, NO_EXPOSURE).astype(np.uint8)
                continue
            take = fine & (exposure == NO_EXPOSURE)
            exposure[take] = e
            for into, new in zip(chosen, here, strict=True):
                if into is not None and new is not None:
                    np.copyto(into, new, where=take)
        fringes, code, inverted, white_black = chosen
        assert fringes is not None and code is not None
        return GrayLight(fringes, code, inverted, white_black, exposure)


def checked_gray_stacks(
    images: Any, gray_images: Any, inverted: Any, white_black: Any, periods: int, steps: int, bits: int | None
) -> GrayStacks:
    """Check all images; their number says whether the code is complementary."""
    if inverted is not None and white_black is not None:
        raise InputError("inverted, white_black: expected one of the two, but got both")
    fringes = checked_stack(images, steps, "images", bits)
    plain, complementary = (code_images(periods, cells) for cells in (1, 2))
    given = _count(gray_images)
    if given not in (plain, complementary):
        raise InputError(
            f"gray_images: expected {complementary} images for {periods} periods, or {plain} without a complementary "
            f"one, but got {given}: an image is missing or too many, or periods are not those of the projector"
        )

    def like_fringes(value: Any, count: int, name: str) -> Stack:
        if _count(value) != count:
            raise InputError(f"{name}: expected {count} images, but got {_count(value)}")
        stack = checked_stack(value, count, name, bits)
        got, wanted = ((s.exposures, *s.shape, str(s.images[0].dtype)) for s in (stack, fringes))
        if got != wanted:
            raise InputError(
                f"{name}: expected images like those of the fringes, (exposures, height, width, type) = {wanted}, but "
                f"got {got}"
            )
        return stack

    return GrayStacks(
        fringes,
        like_fringes(gray_images, given, "gray_images"),
        None if inverted is None else like_fringes(inverted, given, "inverted"),
        None if white_black is None else like_fringes(white_black, 2, "white_black"),
        1 if given == plain else 2,
    )


def _count(images: Any) -> int:
    """Count the images of an exposure; 0 for what is no sequence of images."""
    if not isinstance(images, np.ndarray | list | tuple) or len(images) == 0:
        return 0
    first = images[0]
    if isinstance(first, np.ndarray):
        return len(first) if first.ndim == 3 else len(images)
    return len(first) if isinstance(first, list | tuple) else len(images)
