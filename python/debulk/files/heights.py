"""Heights on a regular grid, as line scanners and cameras of Gocator or Keyence write them: a matrix and its pitch."""

from __future__ import annotations

import math
import re
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import arrays
from debulk._core import InputError
from debulk.arguments import typed
from debulk.files import npy
from debulk.files.mask import decode_png
from debulk.files.source import MAX_HEADER_BYTES, Source, open_source
from debulk.files.units import Unit, check_size, factor
from debulk.files.words import SEPARATORS, is_value, split, without_comment

_TEXT = (".csv", ".txt", ".asc", ".xyz")
_MOST_PLACES = 1 << 28
_LONGEST_LINE = 1 << 20
_MANY = 20
_ESRI = re.compile(r"(ncols|nrows|[xy]ll(?:corner|center)|cellsize|nodata_value)\s+(\S+)", re.IGNORECASE)


@typed
def load_heights(
    path: str | PathLike[str],
    pitch_mm: ArrayLike | None = None,
    unit: Unit = "mm",
    *,
    missing: float | None = None,
    scale_mm: float | None = None,
    offset_mm: float = 0.0,
) -> NDArray[np.float32]:
    r"""Read a matrix of heights as an organised cloud.

    Parameters
    ----------
    path
        A table of heights in text (.csv, .txt, .asc), where lines of words may come first; a grey .png of 8 or 16 bits;
        or a .npy of (H, W) floats or whole numbers. Column i and row j become x = i dx and y = j dy.
    pitch_mm
        (dx, dy), the distance of neighbouring columns and rows, mm, whatever the unit of the heights. Where the first
        line is the far edge, as in a picture, dy is negative: otherwise the ply is seen in a mirror. None is allowed
        where the file says it: the cellsize of an ESRI grid, or a first line and first column of coordinates.
    unit
        Unit of heights that are not scaled, and of a pitch in the file.
    missing
        The number that stands for nothing seen, such as -32768 or -99999.99, beside NaN, empty, NA, `---` and the like.
        A number that looks like one is refused; NaN says that there is none.
    scale_mm, offset_mm
        Height = number * scale_mm + offset_mm, mm. Whole numbers of a .png or .npy need a scale.

    Returns
    -------
    (H, W, 3) float32, mm; NaN where nothing was seen.

    Raises
    ------
    InputError
        If the file cannot be read or is no such matrix, or the pitch or scale is missing.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "scan.csv"
    >>> _ = path.write_text("1,5;1,6;---\n1,4;1,5;1,6\n")
    >>> load_heights(path, (10.0, -20.0))[..., 2].round(1).tolist()
    [[1.5, 1.600000023841858, nan], [1.399999976158142, 1.5, 1.600000023841858]]
    """
    path = Path(path)
    mm_per_unit = factor(unit)
    if scale_mm is not None and not (scale_mm != 0 and math.isfinite(scale_mm)):
        raise InputError(f"scale_mm: expected the height of one step in mm, which is not 0, but got {scale_mm:g}")
    said = None
    with open_source(path) as source:
        match path.suffix.lower():
            case ".png":
                values, whole = _of_png(source), True
            case ".npy":
                values, whole = _of_npy(source)
            case ending if ending in _TEXT:
                values, said, code = _of_text(source, scale_mm is not None)
                missing, whole = code if missing is None else missing, False
            case ending:
                listed = ", ".join((*_TEXT, ".png", ".npy"))
                way = "; save it as a 16-bit .png" if ending in (".tif", ".tiff") else ""
                raise InputError(f"{path}: expected heights ending in {listed}, got {ending or 'no ending'!r}{way}")
    if whole and scale_mm is None:
        raise InputError(f"{path}: its heights are whole numbers: give scale_mm, the height of one step")
    if missing is None:
        _refuse_codes(path, values)
    else:
        values[values == missing] = np.nan
    values = values * (mm_per_unit if scale_mm is None else scale_mm) + offset_mm
    if not np.isfinite(values).any():
        raise InputError(f"{path}: no height is a number: nothing was seen")
    x, y = _axes(path, values.shape, pitch_mm, said, mm_per_unit)
    values[~np.isfinite(values)] = np.nan
    points = np.empty((*values.shape, 3), dtype=np.float32)
    points[..., 0], points[..., 1], points[..., 2] = x, y[:, None], values
    check_size(
        path, max(float(np.ptp(x)), float(np.ptp(y)), float(np.nanmax(values) - np.nanmin(values))), "cloud", "mm"
    )
    return points


def _axes(
    path: Path, shape: tuple[int, ...], pitch_mm: ArrayLike | None, said: tuple[float, float] | None, mm_per_unit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x of the columns and y of the rows, mm, from the pitch that was given or that the file says."""
    if pitch_mm is not None:
        pitch = arrays.numbers(pitch_mm, "pitch_mm", (2,), "the distances of columns and of rows in mm")
        if said is not None and not np.allclose(np.abs(pitch), np.abs(said) * mm_per_unit, rtol=0.01):
            listed = " and ".join(f"{abs(step) * mm_per_unit:g}" for step in said)
            raise InputError(
                f"pitch_mm: expected {listed} mm, as {path} says itself, but got {pitch[0]:g}, {pitch[1]:g}"
            )
    elif said is not None:
        pitch = np.array(said) * mm_per_unit
    else:
        raise InputError(
            f"{path}: expected pitch_mm, the distances of columns and of rows in mm, since the file has none"
        )
    if not (pitch != 0).all():
        raise InputError("pitch_mm: expected distances of columns and of rows that are not 0")
    return pitch[0] * np.arange(shape[1]), pitch[1] * np.arange(shape[0]) + 0.0  # no -0


def _refuse_codes(path: Path, values: NDArray[np.float64]) -> None:
    """Refuse a lowest or highest number that occurs often and lies far from all others."""
    seen = values[np.isfinite(values)]
    for sign in (1.0, -1.0):
        code = float((seen * sign).min(initial=math.inf)) * sign
        others = seen[seen != code]
        count = len(seen) - len(others)
        if len(others) < 2:
            continue
        gap = float(others.min() - code if sign > 0 else code - others.max())
        if gap > (0.5 if count > 1 and len(others) >= _MANY else 10.0) * float(np.ptp(others)):
            raise InputError(
                f"{path}: {code:.9g} stands at {count / values.size:.2%} of the places, far from all other heights: if "
                f"it means that nothing was seen, give missing={code:.9g}, otherwise missing=nan"
            )


def _of_png(source: Source) -> NDArray[np.float64]:
    image = decode_png(source)
    if image.ndim != 2:
        source.fail(0, "a coloured .png, whose colours are no heights", "export the heights as grey values of 16 bits")
    return image.astype(np.float64)


def _of_npy(source: Source) -> tuple[NDArray[np.float64], bool]:
    shape, fortran, dtype = npy.read_header(source, source.file, 0)
    if dtype.kind not in "fiu" or dtype.itemsize > 8 or len(shape) != 2 or min(shape) < 1:
        got = f"{str(dtype)[:40]}, shape {str(shape)[:40]}"
        source.fail(
            0, f"expected (H, W) floats or whole numbers, got {got}", "save it with numpy.save as (H, W) float32"
        )
    source.check_size(source.file.tell(), math.prod(shape), dtype.itemsize, exact=True, what="heights")
    values = npy.reshaped(npy.read_values(source, dtype, math.prod(shape)).astype(np.float64), shape, fortran)
    return np.ascontiguousarray(values), dtype.kind != "f"


def _of_text(source: Source, scaled: bool) -> tuple[NDArray[np.float64], tuple[float, float] | None, float | None]:
    """Read a table of heights; return it, the pitch that the file says, and its number for nothing seen."""
    rows: list[NDArray[np.float64]] = []
    esri: dict[str, str] = {}
    separator, signs, number, offset, closed = "", set[str](), 0, 0, True
    labelled = False  # whether the first row begins with a word
    while raw := source.file.readline(_LONGEST_LINE):
        number += 1
        if len(raw) == _LONGEST_LINE:
            source.fail(offset, f"line {number}: a line of more than {_LONGEST_LINE} bytes", "check the file")
        text = without_comment(raw.decode("utf-8-sig", errors="replace").strip("\r\n "))
        if text and labelled and len(rows) == 1:
            words = split(text, separator)
            if len(words) != len(rows[0]) or (words[0] and not is_value(words[0])):
                rows, separator, signs, closed = [], "", set(), True  # it was a heading, such as "pitch, 0.5"
        match = None if rows else _ESRI.fullmatch(text)
        if match:
            esri[match[1].lower()] = match[2]
        elif rows or _is_row(text):
            separator = separator or _separator(text)
            words = split(text, separator) if text else []
            if words:
                signs |= {sign for sign in ".,_" if any(sign in word for word in words)}
                labelled = labelled if rows else bool(words[0]) and not is_value(words[0])
                rows.append(_row(source, offset, number, words, corner=not rows))
                if len(rows[-1]) != len(rows[0]) or len(rows) * len(rows[0]) > _MOST_PLACES:
                    problem = f"line {number}: expected {len(rows[0])} heights, got {len(rows[-1])}"
                    source.fail(offset, problem, "export the whole matrix")
                closed = closed and not words[-1]
        elif re.match(r"[\W_]*\d", text) or offset > MAX_HEADER_BYTES:
            source.fail(offset, f"line {number}: expected heights, got {text[:60]!r}", "export a matrix of numbers")
        offset += len(raw)
    if rows and closed:  # each line ends with a separator
        rows = [row[:-1] for row in rows]
    if not rows or len(rows[0]) < 2 or len(rows) < 2:
        source.fail(
            0, "expected a matrix of heights of two lines and two columns at least", "export a matrix of numbers"
        )
    if len(signs) > 1 or "_" in signs:
        source.fail(0, "expected decimal points or decimal commas in all heights, and nothing else", "export it again")
    values = np.array(rows)
    if separator == "," and not signs and not scaled and np.isfinite(values).any():
        remedy = "export it with decimal points, or give scale_mm if these are whole numbers of steps"
        source.fail(0, "no number has a decimal point, so the commas may be decimal commas", remedy)
    if _has_axes(source, values):
        x, y = values[0, 1:], values[1:, 0]
        pitch = float(x[1] - x[0]), float(y[1] - y[0])
        counted = pitch == (1, 1) and max(x[0], y[0]) <= 1  # numbers of columns and rows, as pandas writes them
        return np.ascontiguousarray(values[1:, 1:]), None if counted else pitch, None
    if "cellsize" not in esri:
        return values, None, None
    if (esri.get("nrows"), esri.get("ncols")) != (str(values.shape[0]), str(values.shape[1])):
        source.fail(0, f"expected nrows and ncols to be {values.shape[0]} and {values.shape[1]}", "export it again")
    try:
        size, code = float(esri["cellsize"]), float(esri.get("nodata_value", "-9999"))
    except ValueError:
        source.fail(0, "expected numbers for cellsize and nodata_value", "export it again")
    return values, (size, -size), code  # its first line is the far edge


def _has_axes(source: Source, values: NDArray[np.float64]) -> bool:
    """Tell whether the first line and column are coordinates; refuse one that is no heights while the other is.

    Both rise evenly. Without an empty corner they must be long, and those beside them must not rise so.
    """
    if min(values.shape) < 3:
        return False
    inner = values[1:, 1:]
    line, column = _even(values[0, 1:]), _even(values[1:, 0])
    if np.isnan(values[0, 0]):
        return line and column
    line = line and inner.shape[1] >= _MANY and not _even(inner[0])
    column = column and len(inner) >= _MANY and not _even(inner[:, 0])
    if line != column:
        which = "line" if line else "column"
        problem = f"its first {which} rises evenly and the next does not, as numbers over or beside heights do"
        source.fail(0, problem, "export the heights alone")
    return line


def _is_row(text: str) -> bool:
    if text and not text.strip(";,|\t "):
        return True  # separators and nothing between them: a line of which nothing was seen
    words = split(text, _separator(text))
    return len(words) > 1 and all(not word or is_value(word) for word in words[1:]) and any(map(is_value, words[1:]))


def _separator(text: str) -> str:
    """Return the first separator that leaves heights, or anything, in at least two columns."""
    columns = {separator: words for separator in SEPARATORS if len(words := split(text, separator)) > 1}
    fits = (s for s, words in columns.items() if all(not word or is_value(word) for word in words[1:]))
    return next(fits, next(iter(columns), " "))


def _row(source: Source, offset: int, number: int, words: list[str], *, corner: bool) -> NDArray[np.float64]:
    try:
        return np.array([float(word.replace(",", ".")) for word in words])
    except ValueError:
        pass
    row = np.full(len(words), np.nan)
    for k, word in enumerate(words):
        try:
            row[k] = float(word.replace(",", "."))
        except ValueError:
            if re.search(r"\d", word.removeprefix("1.#")) or not (not word or is_value(word) or (corner and k == 0)):
                problem = f"line {number}: expected a height in column {k + 1}, got {word[:40]!r}"
                source.fail(offset, problem, "export a matrix of numbers")
    return row


def _even(axis: NDArray[np.float64]) -> bool:
    steps = np.diff(axis)
    return bool(
        np.isfinite(axis).all() and steps[0] != 0 and np.abs(steps - steps.mean()).max() <= 0.01 * abs(steps.mean())
    )
