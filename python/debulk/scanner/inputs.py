"""The argument checks that the scanner's public functions share."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.arguments import of_type, whole

InputError = _core.InputError
Image = NDArray[np.uint8] | NDArray[np.uint16]

MOST_IMAGES = 64  # most images per exposure
_SAMPLED = 40_000  # pixels


def one_of(name: str, value: object, known: Sequence[str]) -> None:
    """Check a name."""
    if value not in known:
        raise InputError(f"{name}: expected one of {', '.join(map(repr, known))}, but got {value!r}")


def checked_pixels(pixels: Any) -> tuple[int, int]:
    """Check a width and a height."""
    if not isinstance(pixels, tuple | list) or len(pixels) != 2:
        raise InputError(f"pixels: expected (width, height), but got {pixels!r}")
    return whole("pixels", pixels[0], 32, 32000), whole("pixels", pixels[1], 8, 32000)


def checked_periods(periods: Any) -> tuple[int, ...]:
    """Check the numbers of periods; the core decides whether they can be unwrapped."""
    try:
        numbers = tuple(operator.index(n) for n in periods)
    except TypeError:
        raise InputError(f"periods: expected two to six whole numbers, but got {periods!r}") from None
    _core.scanner.unwrap_stages(list(numbers))
    return numbers


def checked_steps(steps: Any, periods: Sequence[int]) -> int:
    """Check the number of steps."""
    return whole("steps", steps, 3, MOST_IMAGES // len(periods))


@dataclass(frozen=True, eq=False)
class Stack:
    """The images of one camera for each exposure, all of one shape and type."""

    images: list[Image]  # exposure by exposure
    exposures: int
    name: str
    white: int  # the greatest grey value
    sampled: Sequence[Image] = ()
    """`sample_of` the first images, where these were there before the others."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width."""
        return self.images[0].shape[0], self.images[0].shape[1]

    @cached_property
    def sample(self) -> NDArray[Any]:
        """(E, n, M) grey values of a sample of the pixels."""
        flat = np.stack([*self.sampled, *map(sample_of, self.images[len(self.sampled) :])])
        return flat.reshape((self.exposures, -1, flat.shape[1]))

    def exposure(self, e: int) -> list[Image]:
        """Return the images of one exposure."""
        each = len(self.images) // self.exposures
        return self.images[e * each : (e + 1) * each]

    def brightness(self) -> tuple[float, ...]:
        """Return the brightness of each exposure relative to the shortest, by its first three images.

        It is read from pixels that are bright in the longer of two exposures, and not saturated.
        """
        step = max(1, round(np.sqrt(np.prod(self.shape) / (_SAMPLED / 2))))
        out = [1.0]
        for e in range(1, self.exposures):
            before, here = (
                np.stack([image[::step, ::step] for image in self.exposure(k)[:3]]).astype(np.float64)
                for k in (e - 1, e)
            )
            fine = (here < self.white) & (here > 0.3 * self.white)
            out.append(out[-1] * (float(here[fine].sum() / max(before[fine].sum(), 1.0)) if fine.any() else 1.0))
        return tuple(out)


def sample_of(image: Image) -> Image:
    """Return grey values of a sample of the pixels.

    Its columns are close together, because it must contain every phase of the fringes.
    """
    step = max(1, round((image.size / _SAMPLED) ** 0.5))
    return image[step // 2 :: step, ::step].ravel()


def checked_stack(
    images: Any, wanted: int, name: str = "images", bits: int | None = None, sampled: Sequence[Image] = ()
) -> Stack:
    """Take (n, H, W) or (E, n, H, W), an array or sequences of (H, W) arrays; valid arrays are not copied."""
    if not isinstance(images, np.ndarray | list | tuple) or len(images) == 0:
        raise InputError(f"{name}: expected images of shape (n, H, W) or (E, n, H, W), but got {_what(images)}")
    first = images[0]
    several = len(first) > 0 and _is_image(first[0]) if isinstance(first, list | tuple | np.ndarray) else False
    exposures = list(images) if several else [images]
    flat: list[Image] = []
    for e, exposure in enumerate(exposures):
        which = f" of exposure {e + 1}" if several else ""
        if len(exposure) != wanted:
            raise InputError(
                f"{name}: expected {wanted} images{which} (steps times numbers of periods), but got {len(exposure)}: "
                "an image is missing or too many, or steps or periods are not those of the projector"
            )
        flat += [checked_image(image, f"{name}, image {k + 1}{which}") for k, image in enumerate(exposure)]
    if flat[0].dtype.kind == "f":
        flat, bits = _whole_numbers(flat, name, bits)
    shape, kind = flat[0].shape, flat[0].dtype
    for k, image in enumerate(flat):
        if image.shape != shape or image.dtype != kind:
            raise InputError(
                f"{name}: expected images of one shape and type, but image {k % wanted + 1} is {image.shape} "
                f"{image.dtype} and the first {shape} {kind}"
            )
    if min(shape) < 8 or shape[1] < 32:
        raise InputError(f"{name}: expected images of at least 32 x 8 pixels, but got {shape[1]} x {shape[0]}")
    stack = Stack(flat, len(exposures), name, greatest_grey(kind, bits), sampled)
    return stack if kind == np.uint8 else replace(stack, white=_white(stack, bits))


def greatest_grey(kind: np.dtype[Any], bits: int | None) -> int:
    """Return the greatest grey value of a sensor of so many bits; None: 8, or 12 in 16."""
    depth = (8 if kind == np.uint8 else 12) if bits is None else whole("bits", bits, 2, 8 * kind.itemsize)
    return (1 << depth) - 1


def _white(stack: Stack, bits: int | None) -> int:
    """Return the greatest grey value of 16-bit images, which sensors of 8 to 14 bits store low or high in the word."""
    greatest, used = int(stack.sample.max()), int(np.bitwise_or.reduce(stack.sample, axis=None))
    empty = (used & -used).bit_length() - 1 if used else 0  # low bits that are 0 in every image
    if greatest > stack.white or bits == 16:
        low = empty if bits in (None, 16) and empty in (2, 4, 6, 8) else 16 - (bits or 16)
        if 0 < low <= empty:
            return (0xFFFF >> low) << low
    if bits is None and greatest in (255, 1023):
        peak, below = (int(np.count_nonzero(stack.sample == value)) for value in (greatest, greatest - 1))
        if peak > 20 + 3 * below:  # many grey values end there
            raise InputError(
                f"{stack.name}: expected grey values of 12 bits in 16, but they saturate at {greatest}: give "
                f"bits={greatest.bit_length()}"
            )
    return stack.white


def _is_image(image: Any) -> bool:
    """Whether this is one image, grey (H, W) or with its colours last."""
    shape = np.shape(image)
    return (len(shape) == 2 and shape[1] > 4) or (len(shape) == 3 and shape[2] <= 4)


def checked_image(image: Any, name: str) -> Image:
    """Take one image, which may be of floats; a valid array is not copied."""
    array = grey_of(np.asarray(image), name)
    if array.ndim != 2 or array.dtype.newbyteorder("=") not in (np.uint8, np.uint16, np.float32, np.float64):
        raise InputError(f"{name}: expected an (H, W) array of uint8 or uint16, but got {_what(array)}")
    return np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))


def grey_of(image: NDArray[Any], name: str) -> NDArray[Any]:
    """Take the grey values of an image that was stored with colours, if these are alike."""
    if image.ndim != 3 or image.shape[2] not in (1, 3, 4):
        return image
    if image.shape[2] > 1 and not all(np.array_equal(image[..., 0], image[..., k]) for k in (1, 2)):
        raise InputError(
            f"{name}: expected a grey image, but it has {image.shape[2]} colours that differ; give one of them, such "
            f"as the green one, image[..., 1]"
        )
    return image[..., 0]


def _whole_numbers(images: list[Any], name: str, bits: int | None) -> tuple[list[Image], int]:
    """Convert floats that hold a sensor's grey values, as they are or divided by the greatest."""
    greatest = max(float(image.max()) for image in images)
    least = min(float(image.min()) for image in images)
    if least >= 0 and greatest <= 65535:  # False for NaN
        depths = (8, 10, 12, 14, 16) if bits is None else (whole("bits", bits, 2, 16),)
        for depth in depths:
            white = (1 << depth) - 1
            scale = float(white) if greatest <= 1 else 1.0
            grey = images[0].astype(np.float64) * scale
            if greatest * scale <= white and np.abs(grey - np.rint(grey)).max() < 0.02:
                kind = np.uint8 if depth == 8 else np.uint16
                return [np.rint(image * scale).astype(kind) for image in images], depth
    raise InputError(
        f"{name}: expected uint8 or uint16, or floats that are whole grey values, or these divided by the greatest "
        f"(255, 1023, 4095, 16383 or 65535), but got floats of {least:g} to {greatest:g}; convert them, such as by "
        f"np.rint(images / images.max() * 65535).astype(np.uint16), and give bits=16"
    )


def _what(value: object) -> str:
    if isinstance(value, np.ndarray) and value.ndim:
        return f"shape {value.shape} of {value.dtype}"
    return f"{type(value).__name__} of {len(value)}" if isinstance(value, list | tuple) else of_type(value)
