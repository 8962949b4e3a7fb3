"""The file of a prepared inspector: a .npz of plain arrays, without pickled objects."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.files import replacing
from debulk.grid import Grid
from debulk.inspection.clouds.camera import PinholeImage
from debulk.inspection.clouds.far_place import NEAR, FarPlace
from debulk.inspection.reference.prepared import Prepared
from debulk.inspection.tracing import Given
from debulk.results.trace import ArrayTrace
from debulk.surface import Reference

FORMAT = "debulk inspector 1"
_GRID = ("f", (3,))  # x and y of the first point, spacing
# For each name the kind of the values and the shape, with None for any length. A question mark marks an optional array.
_ARRAYS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "recipe": ("U", ()),
    "reference": ("f", (None, None)),
    "reference_grid": _GRID,
    "seen": ("f", (None, None)),
    "seen_grid": _GRID,
    "ply_outline?": ("f", (None, 2)),
    "fibre_angles_deg?": ("f", (2,)),
    "fibre_angles?": ("f", (None, None, 2)),
    "fibre_angles_grid?": _GRID,
    "nominal_angles?": ("f", (None, None, 2)),
    "mold_from_scanner?": ("f", (4, 4)),
    "camera?": ("f", (3,)),
    "image?": ("f", (5,)),
    "mask?": ("b", (None, None)),
    "sample?": ("f", (None, 3)),
    "far_place?": ("f", (4,)),  # the shift, and to how many mm the reference had been rounded
    "cloud_shape?": ("i", (None,)),
    "cloud_sha256?": ("U", ()),
    "cloud_xxh3?": ("U", ()),
}
_SPARE_BYTES = 1 << 16  # allowed for headers of the archive


def write(given: Given, path: Path) -> None:
    """Write what an inspector was given, with its reference prepared."""
    prepared, angles = given.reference, given.fibre_angles_deg
    arrays: dict[str, Any] = {
        "format": FORMAT,
        "recipe": json.dumps(given.recipe.model_dump()),
        "reference": prepared.reference.heights_mm,
        "reference_grid": [*prepared.reference.origin_mm, prepared.reference.spacing_mm],
        "seen": prepared.seen.values,
        "seen_grid": _grid(prepared.seen),
        "grid_spacing_mm": prepared.grid_spacing_mm,  # asked for by versions before 0.10
        "ply_outline": given.ply_outline,
        "mold_from_scanner": given.mold_from_scanner,
        "camera": given.camera,
        "image": None if prepared.image is None else np.array(prepared.image, dtype=np.float64),
        "mask": given.mask,
        "nominal_angles": None if given.nominal_angles_deg is None else given.nominal_angles_deg.values,
        "sample": prepared.sample,
        "far_place": None if prepared.place.shift_mm is None else [*prepared.place.shift_mm, prepared.place.rounded_mm],
        "cloud_shape": None if prepared.cloud is None else prepared.cloud.shape,
        "cloud_sha256": None if prepared.cloud is None else prepared.cloud.sha256,
        "cloud_xxh3": None if prepared.cloud is None else prepared.cloud.xxh3,
    }
    if isinstance(angles, Grid):
        arrays |= {"fibre_angles": angles.values.astype(np.float64), "fibre_angles_grid": _grid(angles)}
    else:
        arrays["fibre_angles_deg"] = angles
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
        )
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
    for name, (kind, shape) in _ARRAYS.items():
        plain = name.removesuffix("?")
        if plain not in found:
            if plain == name:
                _fail(path, f"{plain} is missing")
            continue
        value = found[plain]
        fits = value.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, value.shape, strict=True))
        if value.dtype.kind != kind or not fits:
            _fail(path, f"{plain} is {value.dtype} {value.shape}")
    if ("fibre_angles" in found) != ("fibre_angles_grid" in found) or ("fibre_angles" in found) == (
        "fibre_angles_deg" in found
    ):
        _fail(path, "expected fibre_angles_deg, or fibre_angles and fibre_angles_grid")
    if "nominal_angles" in found and found["nominal_angles"].shape != found.get("fibre_angles", np.empty(0)).shape:
        _fail(path, "expected nominal_angles on the grid of fibre_angles")
    return found


def _grid(grid: Grid) -> list[float]:
    return [*map(float, grid.origin_mm), float(grid.spacing_mm)]


def _on_grid(arrays: dict[str, NDArray[Any]], name: str, grid: str = "") -> Grid:
    x, y, spacing = arrays[f"{grid or name}_grid"].tolist()
    if not (np.isfinite([x, y]).all() and 0 < spacing < np.inf):
        raise InputError(f"{name}_grid is {x:g}, {y:g}, {spacing:g}")
    return Grid(arrays[name], np.array([x, y]), spacing)


def _fail(path: Path, problem: str) -> NoReturn:
    raise InputError(f"{path}: not a prepared inspector: {problem}; save it again with Inspector.save")
