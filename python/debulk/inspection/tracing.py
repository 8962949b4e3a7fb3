"""The record of how a report came about: inputs, time, versions and machine."""

from __future__ import annotations

import functools
import math
import os
import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk import __version__, _core
from debulk._core import InputError
from debulk.arguments import of_type
from debulk.build import build_id
from debulk.grid import Grid
from debulk.inspection.clouds import fingerprint
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import Recipe
from debulk.results.trace import Trace


@dataclass(frozen=True, eq=False)
class Given:
    """The arguments of `debulk.Inspector` that its file keeps and its reports name, under the names that it has."""

    recipe: Recipe
    reference: Prepared
    ply_outline: NDArray[np.float64] | None
    fibre_angles_deg: NDArray[np.float64] | Grid
    nominal_angles_deg: Grid | None
    mold_from_scanner: NDArray[np.float64] | None
    camera: NDArray[np.float64] | None
    mask: NDArray[np.bool_] | None


def tracing(given: Given) -> Callable[..., Trace]:
    """Return what makes the record of one inspection from its own part, by the names that `Trace` has."""
    angles, image = given.fibre_angles_deg, given.reference.image
    return functools.partial(
        Trace,
        reference=given.reference.cloud,
        fibre_angles_deg=None if isinstance(angles, Grid) else angles,
        fibre_angles_map=angles if isinstance(angles, Grid) else None,
        nominal_angles_map=given.nominal_angles_deg,
        mold_from_scanner=given.mold_from_scanner,
        camera=given.camera,
        fitted_camera=None if image is None else np.array(image.camera),
        mask=None if given.mask is None else fingerprint.of_mask(given.mask),
        versions=_versions(),
        host=_host() | {"threads used": str(given.recipe.run.threads or _core.default_threads())},
    )


def checked_context(context: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return a copy, in JSON's types, of the context that the caller wants to be kept.

    An `InputError` is raised for what JSON cannot hold: names that are not text, NaN, infinity, arrays, other objects.
    """
    if context is None:
        return {}
    if not isinstance(context, Mapping):
        raise InputError(f"context: expected a dictionary of names and values, but got {of_type(context)}")
    copy: dict[str, Any] = _plain(context, "context")
    return copy


def _plain(value: Any, name: str) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise InputError(f"{name}: expected names that are text, but got {key!r}")
        return {key: _plain(item, f"{name}.{key}") for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item, f"{name}[{k}]") for k, item in enumerate(value)]
    finite = not isinstance(value, float) or math.isfinite(value)
    if value is None or (isinstance(value, (str, bool, int, float)) and finite):
        return value
    what = of_type(value)
    raise InputError(
        f"{name}: expected text, a finite number, true or false, None, or a list or dictionary of these, but got {what}"
    )


@functools.cache
def _versions() -> dict[str, str]:
    return {
        "debulk": __version__,
        "build": build_id(),
        "Python": platform.python_version(),
        "numpy": np.__version__,
        **_core.build_versions(),
    }


@functools.cache
def _host() -> dict[str, str]:
    return {
        "name": platform.node(),
        "system": platform.platform(),
        "machine": platform.machine(),
        "cores": str(os.cpu_count() or 1),
        "instructions": _core.instruction_set(),
    }
