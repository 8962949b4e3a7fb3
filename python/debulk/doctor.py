"""What is installed, on what machine, and whether it works: the first thing to send with a question."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.metadata
import json
import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk import _core, cloud, net, sheet, solve, surface
from debulk.build import build_id
from debulk.results.report_text import fold

__all__ = ["DoctorReport", "Licence", "SelfTest", "doctor", "licences", "memory_bandwidth", "self_test"]

_PACKAGES = ("numpy", "pydantic", "opencv-python-headless", "typer", "rich", "jinja2")
_EXTRAS = ("open3d-cpu", "open3d")
_NOTES = "third_party_notes.md"
_BANDWIDTH_BYTES = 1 << 28  # far above any cache


@dataclass(frozen=True)
class SelfTest:
    """A fixed pocket, inspected step by step."""

    name: str
    passed: bool
    detail: str
    """`name`, `passed`, `detail`: what was tried, whether it passed, and the figures."""


@dataclass(frozen=True)
class Licence:
    """A row of the third-party notes."""

    what: str
    version: str
    licence: str
    linked: str


@dataclass(frozen=True)
class DoctorReport:
    """The findings of `doctor`."""

    versions: dict[str, str]
    """Versions by name: debulk, Python, what the compiled module was built with, and the packages it imports."""
    system: str
    processor: str
    instruction_set: str
    """`system`, `processor`, `instruction_set`: the level of the instruction set selects the wide loops; the package
    needs no more than x86-64-v2."""
    cores: int
    threads: int
    """`cores`, `threads`: cores of the machine; threads that an inspection uses (the process may be limited to fewer
    cores)."""
    memory_gb: float | None
    bandwidth_gb_s: float
    """`memory_gb`, `bandwidth_gb_s`: memory of the machine (None if it is not known); bytes read and written by one
    thread's copy, which limit the front end."""
    bundled: tuple[str, ...]
    """Shared libraries inside the wheel; empty where those of the system are used."""
    licences: tuple[Licence, ...]
    """Licences of everything that is linked or imported; their texts are in `licence_folder`."""
    licence_folder: Path | None
    """None if the package was not installed from a wheel."""
    tests: tuple[SelfTest, ...]
    """The parts of the self-test."""

    @property
    def passed(self) -> bool:
        """Whether every part of the self-test passed."""
        return all(test.passed for test in self.tests)

    def text(self, width: int | None = None) -> str:
        """Everything as plain text, one fact per line, folded if a width is given."""
        memory = "unknown" if self.memory_gb is None else f"{self.memory_gb:.1f} GB"
        lines = ["versions", *(f"  {name:<22} {version}" for name, version in self.versions.items())]
        lines += ["machine"]
        lines += [
            f"  {name:<22} {value}"
            for name, value in (
                ("system", self.system),
                ("processor", f"{self.processor}, {self.instruction_set}"),
                ("cores, threads used", f"{self.cores}, {self.threads}"),
                ("memory", f"{memory}, copied at {self.bandwidth_gb_s:.1f} GB/s by one thread"),
            )
        ]
        lines += [f"bundled libraries: {len(self.bundled) or 'none, the system has them'}"]
        lines += [f"  {name}" for name in self.bundled]
        lines += ["licences" if self.licences else "licences: the notes are not installed"]
        lines += [f"  {entry.what} {entry.version}: {entry.licence} ({entry.linked})" for entry in self.licences]
        if self.licence_folder is not None:
            lines += [f"  their texts: {self.licence_folder}"]
        lines += [f"self-test: {'passed' if self.passed else 'FAILED'}"]
        lines += [f"  {'ok    ' if test.passed else 'FAILED'} {test.name}: {test.detail}" for test in self.tests]
        return "\n".join(fold(line, width) for line in lines)

    def json(self) -> str:
        """Everything as JSON, one object per class, and whether the self-test passed."""
        return json.dumps({"passed": self.passed, **dataclasses.asdict(self)}, default=str, indent=1)

    def __str__(self) -> str:
        return self.text()


def doctor() -> DoctorReport:
    """Examine the installation and the machine, and run the self-test; takes a few seconds at most.

    Examples
    --------
    >>> from debulk.doctor import doctor
    >>> doctor().passed
    True
    """
    folder = _licence_folder()
    libraries = Path(__file__).resolve().parent.parent / "debulk.libs"
    return DoctorReport(
        versions=_versions(),
        system=f"{platform.system()} {platform.release()}, {platform.libc_ver()[0]} {platform.libc_ver()[1]}",
        processor=_processor(),
        instruction_set=_core.instruction_set(),
        cores=os.cpu_count() or 1,
        threads=_core.default_threads(),
        memory_gb=_memory_gb(),
        bandwidth_gb_s=memory_bandwidth(),
        bundled=tuple(sorted(path.name for path in libraries.glob("*.so*"))),
        licences=licences(),
        licence_folder=folder,
        tests=self_test(),
    )


def memory_bandwidth(size: int = _BANDWIDTH_BYTES, repeats: int = 4) -> float:
    """Bytes that one thread's copy in memory reads and writes, GB/s: the best of several repeats."""
    source = np.ones(size // 8)
    target = np.zeros_like(source)
    best = min(_seconds(source, target) for _ in range(repeats))
    return 2e-9 * source.nbytes / best


def _seconds(source: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    began = time.perf_counter()
    np.copyto(target, source)
    return max(time.perf_counter() - began, 1e-9)


def self_test() -> tuple[SelfTest, ...]:
    """Take a fixed pocket, 8 mm high on a dome, through the parts of the compiled module."""
    return tuple(_tried(name, part) for name, part in _PARTS.items())


def _tried(name: str, part: Callable[[], tuple[bool, str]]) -> SelfTest:
    try:
        passed, detail = part()
    except Exception as error:  # whatever the error is, the reader has to know it
        return SelfTest(name, False, f"{type(error).__name__}: {error}")
    return SelfTest(name, passed, detail)


def _pocket_sheet() -> sheet.Sheet:
    ticks = np.arange(-60.0, 61.0, 2.0)
    x, y = np.meshgrid(ticks, ticks)
    dome = np.sqrt(2000.0**2 - x**2 - y**2) - 2000.0
    bell = 8.0 * np.cos(0.5 * np.pi * np.minimum(np.hypot(x / 45.0, y / 35.0), 1.0)) ** 2
    mold, ply = (surface.Reference(heights, (-60.0, -60.0), 2.0) for heights in (dome, dome + bell))
    turn = np.linspace(0.0, 2 * np.pi, 120, endpoint=False)
    outline = np.column_stack([45.0 * np.cos(turn), 35.0 * np.sin(turn)])
    laid = net.fibre_net(ply, mold, (0.0, 0.0), (0.0, 90.0), outline_mm=outline, node_target=100)
    return sheet.Sheet(laid.nodes_mm, laid.neighbours, laid.kinds, laid.spacing_mm, laid.area_mm2, mold)


def _certified(method: str) -> tuple[bool, str]:
    began = time.perf_counter()
    ply = _pocket_sheet()
    found = solve.minimise(ply, method)
    elapsed = 1e3 * (time.perf_counter() - began)
    digest = hashlib.sha256(found.nodes_mm.tobytes()).hexdigest()[:12]
    certificate = found.certificate
    figures = (
        f"{found.status}, {'certified' if found.certified else certificate.failure}: residual force "
        f"{certificate.kkt_error:.0e} of a node's load, length error {certificate.length_error:.0e}, penetration "
        f"{certificate.penetration_mm:.1g} mm; energy {found.energy_mj:.3f} mJ, {found.evaluations} evaluations, "
        f"{elapsed:.0f} ms, bits {digest}"
    )
    return found.certified, figures


def _ipopt() -> tuple[bool, str]:
    # Ipopt may find another local minimum, and its own certificate may fail near a saddle: only that it solves is
    # tested.
    _, figures = _certified("ipopt")
    return figures.startswith("converged"), figures


def _unorganised() -> tuple[bool, str]:
    """PCL's tree search over unordered points, one of them off the surface."""
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]).astype(np.float32)
    points[777, 2] = 9.0
    removed = np.flatnonzero(~cloud.remove_outliers(points, least_ratio=2.0))
    return removed.tolist() == [777], f"{len(removed)} of {len(points)} points removed"


_PARTS: dict[str, Callable[[], tuple[bool, str]]] = {
    "net, sheet, solver": lambda: _certified("auto"),
    "Ipopt, the referee": _ipopt,
    "unorganised cloud": _unorganised,
}


def _versions() -> dict[str, str]:
    from debulk import __version__

    found = {"debulk": __version__, "build": build_id(), "Python": platform.python_version(), **_core.build_versions()}
    for name in (*_PACKAGES, *_EXTRAS):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            if name in _PACKAGES:
                found[name] = "missing"
    return found


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _memory_gb() -> float | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    except (ValueError, OSError):
        return None


def _licence_folder() -> Path | None:
    try:
        files = importlib.metadata.files("debulk") or []
    except importlib.metadata.PackageNotFoundError:
        return None
    for file in files:
        if file.name == _NOTES:
            return Path(str(file.locate())).parent
    return None


def licences() -> tuple[Licence, ...]:
    """Return what is compiled in, linked or imported: the third-party notes' rows; none if they are not installed."""
    folder = _licence_folder()
    if folder is None:
        return ()
    text = (folder / _NOTES).read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    return tuple(
        Licence(*row[:4]) for row in rows[2:] if "only" not in row[3]
    )  # not those of build and tests, and not what for
