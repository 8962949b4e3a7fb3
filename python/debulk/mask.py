"""Masks: images that are white where a clamp or a tool hides the ply."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError

__all__ = ["load_mask"]

_IMAGES = (".png", ".bmp", ".pgm", ".tif", ".tiff")
_MAX_BYTES = 1 << 30


def load_mask(path: str | PathLike[str]) -> NDArray[np.bool_]:
    """Read a mask as `debulk.Inspector` takes it.

    Parameters
    ----------
    path
        A .png, .bmp, .pgm or .tif image, white where the ply is hidden and black elsewhere, of the scan's own size; or
        a .npy of bool, or of uint8 as such an image.

    Returns
    -------
    ndarray
        (H, W) bool, True where the ply is hidden.

    Raises
    ------
    InputError
        Names the file and what is wrong with it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile(suffix=".npy") as file:
    ...     np.save(file.name, np.array([[0, 255], [0, 0]], np.uint8))
    ...     load_mask(file.name).tolist()
    [[False, True], [False, False]]
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (*_IMAGES, ".npy"):
        raise InputError(f"{path}: expected a mask ending in {', '.join(_IMAGES)} or .npy, got {path.suffix!r}")
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise InputError(f"{path}: expected a mask of at most {_MAX_BYTES >> 20} MB")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    if kind == ".npy":
        return _array(path, data)
    return np.asarray(_image(path, data) > 127)


def _array(path: Path, data: bytes) -> NDArray[np.bool_]:
    import io

    try:
        values = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise InputError(f"{path}: not a .npy array: {error}") from None
    if not isinstance(values, np.ndarray) or values.ndim != 2 or values.dtype not in (np.bool_, np.uint8):
        found = f"{values.dtype} of shape {values.shape}" if isinstance(values, np.ndarray) else "an archive"
        raise InputError(f"{path}: expected (H, W) of bool or uint8, got {found}")
    return np.asarray(values if values.dtype == np.bool_ else values > 127)


def _image(path: Path, data: bytes) -> NDArray[np.uint8]:
    import cv2

    try:
        values = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE) if data else None
    except cv2.error as error:
        raise InputError(f"{path}: not an image that can be read: {error.err}") from None
    if values is None:
        raise InputError(
            f"{path}: not an image that can be read: damaged, cut off, or of another kind than its name says"
        )
    return np.asarray(values, dtype=np.uint8)
