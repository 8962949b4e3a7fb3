"""The file of a prepared inspector: a .npz of plain arrays, without pickled objects."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.files import replacing
from debulk.grid import Grid
from debulk.inspection.clouds.camera import PinholeImage
from debulk.inspection.clouds.far_place import NEAR, FarPlace
from debulk.inspection.reference.prepared import Prepared
from debulk.inspection.tracing import Given
from debulk.results.record import fits
from debulk.results.trace import ArrayTrace
from debulk.surface import Reference

FORMAT = "debulk inspector 1"
_SPARE_BYTES = 1 << 16  # allowed for headers of the archive


def _of_grid(grid: Grid | Reference | None) -> list[float] | None:
    """Return x and y of the first point, and the spacing."""
    return None if grid is None else [*map(float, grid.origin_mm), float(grid.spacing_mm)]


def _field(given: Given) -> Grid | None:
    return given.fibre_angles_deg if isinstance(given.fibre_angles_deg, Grid) else None


def _values(grid: Grid | None) -> NDArray[np.float64] | None:
    return None if grid is None else np.asarray(grid.values, dtype=np.float64)


def _far(place: FarPlace) -> list[float] | None:
    """Return the shift, and to how many mm the reference had been rounded."""
    return None if place.shift_mm is None else [*place.shift_mm, place.rounded_mm]


class _Stored(NamedTuple):
    """How an array is stored: the kind of its values, its shape with None for any length, and what is stored."""

    kind: str
    shape: tuple[int | None, ...]
    of: Callable[[Given], Any]


# A question mark marks an optional array.
_ARRAYS = {
    "recipe": _Stored("U", (), lambda given: json.dumps(given.recipe.model_dump())),
    "reference": _Stored("f", (None, None), lambda given: given.reference.reference.heights_mm),
    "reference_grid": _Stored("f", (3,), lambda given: _of_grid(given.reference.reference)),
    "seen": _Stored("f", (None, None), lambda given: given.reference.seen.values),
    "seen_grid": _Stored("f", (3,), lambda given: _of_grid(given.reference.seen)),
    "hidden?": _Stored("f", (None, None), lambda given: given.reference.hidden and given.reference.hidden.values),
    "ply_outline?": _Stored("f", (None, 2), lambda given: given.ply_outline),
    "fibre_angles_deg?": _Stored("f", (2,), lambda given: None if _field(given) else given.fibre_angles_deg),
    "fibre_angles?": _Stored("f", (None, None, 2), lambda given: _values(_field(given))),
    "fibre_angles_grid?": _Stored("f", (3,), lambda given: _of_grid(_field(given))),
    "nominal_angles?": _Stored("f", (None, None, 2), lambda given: _values(given.nominal_angles_deg)),
    "mold_from_scanner?": _Stored("f", (4, 4), lambda given: given.mold_from_scanner),
    "camera?": _Stored("f", (3,), lambda given: given.camera),
    "image?": _Stored("f", (5,), lambda given: given.reference.image and np.array(given.reference.image, np.float64)),
    "mask?": _Stored("b", (None, None), lambda given: given.mask),
    "sample?": _Stored("f", (None, 3), lambda given: given.reference.sample),
    "far_place?": _Stored("f", (4,), lambda given: _far(given.reference.place)),
    "cloud_shape?": _Stored("i", (None,), lambda given: given.reference.cloud and given.reference.cloud.shape),
    "cloud_sha256?": _Stored("U", (), lambda given: given.reference.cloud and given.reference.cloud.sha256),
    "cloud_xxh3?": _Stored("U", (), lambda given: given.reference.cloud and given.reference.cloud.xxh3),
}


def write(given: Given, path: Path) -> None:
    """Write what an inspector was given, with its reference prepared."""
    arrays = {name.removesuffix("?"): stored.of(given) for name, stored in _ARRAYS.items()}
    arrays |= {"format": FORMAT, "grid_spacing_mm": given.reference.grid_spacing_mm}  # asked for before 0.10
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **{name: value for name, value in arrays.items() if value is not None})


def read(path: Path) -> dict[str, Any]:
    """Read the keyword arguments of `Inspector`, with the recipe as a dictionary."""
    a = _arrays(path)
    try:
        recipe = json.loads(str(a["recipe"]))
    except (ValueError, RecursionError):
        _fail(path, "its recipe is not JSON")
    if not isinstance(recipe, dict):
        _fail(path, "its recipe is not JSON")
    try:
        x, y, spacing = a["reference_grid"].tolist()
        prepared = Prepared(
            Reference(a["reference"], (x, y), spacing),
            _on_grid(a, "seen"),
            _image(path, a.get("image")),
            a.get("sample"),
            _cloud(a),
            _place(a.get("far_place")),
            _on_grid(a, "hidden", "seen") if "hidden" in a else None,
        )
        if prepared.hidden is not None and prepared.hidden.values.shape != prepared.seen.values.shape:
            raise InputError(f"hidden has the shape {prepared.hidden.values.shape}, seen {prepared.seen.values.shape}")
    except InputError as error:
        _fail(path, str(error))
    camera = a.get("camera")
    return {
        "recipe": recipe,
        "reference": prepared,
        "ply_outline": a.get("ply_outline"),
        "fibre_angles_deg": _on_grid(a, "fibre_angles") if "fibre_angles" in a else a.get("fibre_angles_deg"),
        "mold_from_scanner": a.get("mold_from_scanner"),
        "camera": None if camera is None else tuple(camera.tolist()),
        "mask": a.get("mask"),
        "nominal_angles_deg": _on_grid(a, "nominal_angles", "fibre_angles") if "nominal_angles" in a else None,
    }


def _image(path: Path, values: NDArray[Any] | None) -> PinholeImage | None:
    if values is None:
        return None
    height, width, f, cx, cy = values.tolist()
    if not (np.isfinite(values).all() and 2 <= height < 1 << 16 and 2 <= width < 1 << 16 and f > 0):
        _fail(path, f"image is {values.tolist()}")
    return PinholeImage(int(height), int(width), f, cx, cy)


def _place(values: NDArray[Any] | None) -> FarPlace:
    if values is None:
        return NEAR
    if not np.isfinite(values).all():
        raise InputError(f"far_place is {values.tolist()}")
    return FarPlace(values[:3], float(values[3]))


def _cloud(arrays: dict[str, NDArray[Any]]) -> ArrayTrace | None:
    if "cloud_shape" not in arrays:
        return None
    hashes = {kind: str(arrays[f"cloud_{kind}"]) for kind in ("sha256", "xxh3") if f"cloud_{kind}" in arrays}
    return ArrayTrace(shape=tuple(arrays["cloud_shape"].tolist()), **hashes)


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read the file's arrays, and check that each has the kind and shape that it must have."""
    try:
        size = path.stat().st_size
        with zipfile.ZipFile(path) as archive:  # sizes first, so that a small file cannot unpack to huge arrays
            if sum(info.file_size for info in archive.infolist()) > size + _SPARE_BYTES:
                _fail(path, "its arrays are larger than the file")
        with np.load(path, allow_pickle=False) as archive:
            found = {name: archive[name] for name in archive.files}
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except Exception as error:  # a damaged archive causes errors of zipfile, zlib or NumPy, which all mean the same
        _fail(path, " ".join(str(error).split())[:120])
    if str(found.pop("format", "")) != FORMAT:
        _fail(path, f"expected the format {FORMAT!r}")
    for name, (kind, shape, _) in _ARRAYS.items():
        plain = name.removesuffix("?")
        if plain not in found:
            if plain == name:
                _fail(path, f"{plain} is missing")
            continue
        value = found[plain]
        if value.dtype.kind != kind or not fits(value.shape, shape):
            _fail(path, f"{plain} is {value.dtype} {value.shape}")
    if ("fibre_angles" in found) != ("fibre_angles_grid" in found) or ("fibre_angles" in found) == (
        "fibre_angles_deg" in found
    ):
        _fail(path, "expected fibre_angles_deg, or fibre_angles and fibre_angles_grid")
    if "nominal_angles" in found and found["nominal_angles"].shape != found.get("fibre_angles", np.empty(0)).shape:
        _fail(path, "expected nominal_angles on the grid of fibre_angles")
    return found


def _on_grid(arrays: dict[str, NDArray[Any]], name: str, grid: str = "") -> Grid:
    x, y, spacing = arrays[f"{grid or name}_grid"].tolist()
    if not (np.isfinite([x, y]).all() and 0 < spacing < np.inf):
        raise InputError(f"{name}_grid is {x:g}, {y:g}, {spacing:g}")
    return Grid(arrays[name], np.array([x, y]), spacing)


def _fail(path: Path, problem: str) -> NoReturn:
    raise InputError(f"{path}: not a prepared inspector: {problem}; save it again with Inspector.save")
