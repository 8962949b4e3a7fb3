"""A software bill of materials: what an installation consists of, in the form of CycloneDX.

It prints that of the debulk that Python imports; a wheel carries its own under ``sboms``.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import debulk
from debulk import __version__, _core
from debulk._core import InputError
from debulk.build import build_id
from debulk.doctor import Licence, licences

Component = dict[str, Any]
_SPDX = {
    "MIT", "MPL-2.0", "BSL-1.0", "EPL-1.0", "Zlib", "bzip2-1.0.6", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause",
}  # fmt: skip
_OUTSIDE = r"(?![^(]*\))"  # not within parentheses


def bill() -> str:
    """Return the bill of materials of this installation: CycloneDX 1.5, JSON.

    Its components are those of the third-party notes that are compiled in, linked or imported, without extras that are
    not installed, and every shared library that a wheel brings, with its hash. Versions of what was compiled in are
    those that the build saw, versions of Python packages those that are installed.
    """
    rows = licences()
    if not rows:
        raise InputError("the third-party notes are not installed: install debulk from a wheel")
    own = {
        "type": "library",
        "name": "debulk",
        "version": __version__,
        "purl": f"pkg:pypi/debulk@{__version__}",
        "licenses": [{"license": {"id": "Apache-2.0"}}],
        "properties": [{"name": "debulk:build", "value": build_id()}],
    }
    tree = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": own},
        "components": [*(part for row in rows for part in _parts(row)), *_bundled()],
    }
    return json.dumps(tree, indent=1, ensure_ascii=False) + "\n"


def _parts(row: Licence) -> Iterator[Component]:
    """Yield the components of a row, which may name several with a licence and a version each, or one for all."""
    names = re.split(rf",\s*{_OUTSIDE}", row.what)
    built = _core.build_versions()
    for k, whole in enumerate(names):
        name = re.sub(r"\s*\(.*\)", "", whole)
        package = _package(whole, name) if "Python package" in row.linked else None
        if package is None and "extra" in row.linked:
            continue  # not installed
        licence = _own(row.licence, k, len(names))
        component: Component = {
            "type": "library",
            "name": name,
            "version": package[1] if package else built.get(name, _own(row.version, k, len(names))),
            "licenses": [{"license": {"id" if licence in _SPDX else "name": licence}}],
            "properties": [{"name": "debulk:linked", "value": row.linked}],
        }
        if package:
            component["purl"] = f"pkg:pypi/{package[0]}@{package[1]}"
        yield component


def _own(text: str, k: int, count: int) -> str:
    """Return the k-th of several values, or the one value for all."""
    values = re.split(rf",\s*{_OUTSIDE}", text)
    return values[k] if len(values) == count else text


def _package(whole: str, name: str) -> tuple[str, str] | None:
    """Return name and version of an installed Python package; None if it is not installed."""
    quoted = re.search(r"`([\w-]+)`", whole)
    for candidate in ([quoted[1]] if quoted else []) + [name.lower(), f"{name.lower()}-python-headless"]:
        try:
            return candidate, importlib.metadata.version(candidate)
        except importlib.metadata.PackageNotFoundError:
            continue
    return None


def _bundled() -> Iterator[Component]:
    """Yield the shared libraries that lie in the wheel."""
    for path in sorted((Path(debulk.__file__).resolve().parent.parent / "debulk.libs").glob("*.so*")):
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        yield {"type": "file", "name": path.name, "hashes": [{"alg": "SHA-256", "content": digest}]}


if __name__ == "__main__":
    print(bill(), end="")
