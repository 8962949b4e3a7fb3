"""How well the C++ tests hold what decides a verdict: the branches that they take, and the small changes they notice.

    python tests/mutants/cpp.py coverage BUILD
    python tests/mutants/cpp.py mutants BUILD [--only judge.cpp]

BUILD holds the rooms as static libraries (build/test, or what -DDEBULK_TESTS=ON made). Only the sources of `UNITS` are
compiled again, with counters or with one change each, and linked before these libraries. A change that makes no test
fail is a survivor: it is printed, and tests/mutants/survivors.md says why it may live. The exit code is 1 if a branch
is not taken, or if less than nine tenths of the changes are noticed.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
ROOMS = [
    "verdict",
    "ridge",
    "fibre",
    "section",
    "sheet",
    "solve",
    "net",
    "pocket",
    "surface",
    "cloud",
    "scanner",
    "core",
]
FLAGS = ["-std=c++17", "-O0", "-w", "-march=x86-64-v2", "-ffp-contract=off", f"-I{ROOT}/cpp", f"-I{ROOT}/tests/cpp"]
ENOUGH = 0.9  # of the changes
PATIENCE_S = 120


class Unit(NamedTuple):
    """A source and the tests that are to notice its changes."""

    source: str
    tests: tuple[str, ...]


UNITS = (
    Unit("cpp/debulk/verdict/judge.cpp", ("tests/cpp/verdict/judge_test.cpp",)),
    Unit("cpp/debulk/verdict/excess_bounds.cpp", ("tests/cpp/verdict/excess_bounds_test.cpp",)),
    Unit("cpp/debulk/solve/certificate.cpp", ("tests/cpp/solve/certificate_test.cpp",)),
)

# What is changed into what. Signs with blanks round them are operators, those of templates have none.
SWAPS = (
    (r" <= ", " < "), (r" >= ", " > "), (r" < ", " <= "), (r" > ", " >= "), (r" == ", " != "), (r" != ", " == "),
    (r" && ", " || "), (r" \|\| ", " && "), (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "),
    (r"(?<![\w)])!(?=[\w(])", ""), (r"\bstd::max\b", "std::min"), (r"\bstd::min\b", "std::max"),
    (r"\btrue\b", "false"), (r"\bfalse\b", "true"), (r"\bmax_element\b", "min_element"),
    (r"Verdict::cease\b", "Verdict::crease"), (r"Verdict::crease\b", "Verdict::undecided"),
    (r"Verdict::undecided\b", "Verdict::cease"), (r"Verdict::invalid\b", "Verdict::undecided"),
    (r"Criterion::excess\b", "Criterion::paper"), (r"Criterion::paper\b", "Criterion::excess"),
    (r"(?<![\w.])(\d+)(?![\w.>])", lambda found: str(int(found[1]) + 1)),
    (r"(?<![\w.])(\d+\.\d+)(?![\w.])", lambda found: str(float(found[1]) + 1)),
    (r"^ +(?:require|require_positive|check_range|criteria\.check|figures\.push_back|add)\(.*;$", "  ;"),
)  # fmt: skip


class Change(NamedTuple):
    """One small change of a source."""

    line: int
    before: str
    after: str
    text: str  # the whole source with it


def changes(text: str) -> Iterator[Change]:
    """Yield every change of a source, outside comments, strings and includes."""
    for number, line in enumerate(text.splitlines(keepends=True), start=1):
        code = re.sub(r'"(?:[^"\\]|\\.)*"', lambda found: '"' + "~" * (len(found[0]) - 2) + '"', line)
        code = re.sub(r"//.*", lambda found: "~" * len(found[0]), code)
        if code.lstrip().startswith(("#", "namespace", "std::array", "switch", "case", "constexpr")):
            continue
        start = sum(len(other) for other in text.splitlines(keepends=True)[: number - 1])
        for pattern, into in SWAPS:
            for found in re.finditer(pattern, code.rstrip("\n")):
                new = found.expand(into) if isinstance(into, str) else into(found)
                at = start + found.start()
                yield Change(
                    number, line.strip(), (line[: found.start()] + new + line[found.end() :]).strip(),
                    text[:at] + new + text[start + found.end() :],
                )  # fmt: skip


class Bench:
    """Compiles and links one source with its tests against the libraries of a build."""

    def __init__(self, build: Path, work: Path) -> None:
        self.work = work
        libraries = [str(build / "cpp" / "debulk" / room / f"libdebulk_{room}.a") for room in ROOMS]
        self.libraries = [
            "-Wl,--start-group",
            *libraries,
            "-Wl,--end-group",
            *self._others(build),
            "-lgtest_main",
            "-lgtest",
        ]
        self.includes = self._includes(build)

    @staticmethod
    def _others(build: Path) -> list[str]:
        """Return the libraries of others that a test program of the build is linked with."""
        rules = (build / "build.ninja").read_text()
        found = re.findall(r"LINK_LIBRARIES = (.*)", rules)
        words = max(found, key=len).split()
        return [
            word
            for word in dict.fromkeys(words)
            if "debulk" not in word and "gtest" not in word and "python" not in word
        ]

    @staticmethod
    def _includes(build: Path) -> list[str]:
        command = json.loads((build / "compile_commands.json").read_text())[0]["command"]
        return re.findall(r"-isystem \S+", command)

    def compile(self, source: Path, target: str, *flags: str) -> Path | None:
        """Return the object, or None if it does not compile."""
        out = self.work / target
        includes = " ".join(self.includes).split()
        done = subprocess.run(
            ["c++", *FLAGS, *flags, *includes, "-c", str(source), "-o", str(out)], capture_output=True
        )
        return out if done.returncode == 0 else None

    def link(self, objects: list[Path], *flags: str) -> Path:
        """Return the test program."""
        out = self.work / "tests"
        subprocess.run(["c++", *flags, *map(str, objects), *self.libraries, "-o", str(out)], check=True)
        return out

    def objects_of(self, unit: Unit) -> list[Path]:
        """Compile the tests of a unit."""
        made = [self.compile(ROOT / test, f"{Path(test).stem}.o") for test in unit.tests]
        assert None not in made, f"the tests of {unit.source} do not compile"
        return [one for one in made if one is not None]


def passes(program: Path) -> bool:
    """Return whether all tests pass, in time."""
    try:
        return subprocess.run([str(program)], capture_output=True, timeout=PATIENCE_S).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def coverage(bench: Bench, units: list[Unit]) -> bool:
    """Print the share of branches that the tests take, those of exceptions left out; return whether it is all."""
    for unit in units:
        made = bench.compile(ROOT / unit.source, f"{Path(unit.source).stem}.o", "--coverage", "-O1")
        assert made is not None
        assert passes(bench.link([made, *bench.objects_of(unit)], "--coverage")), f"{unit.source}: a test fails"
    done = subprocess.run(
        [sys.executable, "-m", "gcovr", "--root", str(ROOT), "--object-directory", str(bench.work), str(bench.work),
         "--filter", f"{ROOT}/cpp/debulk/", "--exclude", r".*\.hpp", "--exclude-throw-branches",
         "--exclude-unreachable-branches",
         "--txt-metric", "branch", "--fail-under-branch", "100"],
    )  # fmt: skip
    return done.returncode == 0


def mutants(bench: Bench, units: list[Unit]) -> bool:
    """Print the survivors and the share of the changes that the tests notice; return whether it is enough."""
    enough = True
    for unit in units:
        tests, text = bench.objects_of(unit), (ROOT / unit.source).read_text()
        assert passes(bench.link([bench.compile(ROOT / unit.source, "unit.o"), *tests])), f"{unit.source}: a test fails"
        tried = noticed = 0
        for change in changes(text):
            (bench.work / "changed.cpp").write_text(change.text)
            made = bench.compile(bench.work / "changed.cpp", "unit.o")
            if made is None:
                continue
            tried += 1
            if passes(bench.link([made, *tests])):
                print(f"survives: {unit.source}:{change.line}\n  - {change.before}\n  + {change.after}", flush=True)
            else:
                noticed += 1
        share = noticed / max(1, tried)
        print(f"{unit.source}: {noticed} of {tried} changes are noticed, {100 * share:.1f} %", flush=True)
        enough &= noticed >= ENOUGH * tried
    return enough


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("coverage", "mutants"))
    parser.add_argument("build", type=Path)
    parser.add_argument("--only", default="", help="part of a source's name")
    options = parser.parse_args()
    units = [unit for unit in UNITS if options.only in unit.source]
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(options.build, Path(folder))
        return 0 if (coverage if options.what == "coverage" else mutants)(bench, units) else 1


if __name__ == "__main__":
    raise SystemExit(main())
