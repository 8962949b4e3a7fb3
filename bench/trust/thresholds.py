"""What each threshold is worth: python bench/trust/thresholds.py [--scenes 36] [--first 9000] [--out FILE].

Scenes of the third family are inspected with every threshold as it is, at half and at twice its value. A threshold that
changes no verdict is one that these scenes do not need; one that lets a crease pass must not be touched without the
scenes that set it. Outcomes are kept in a CSV under build/trust as they come, and what stands in it is not done again.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import pkgutil
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from third import LIMIT_MM, inspected, kept

import debulk
import debulk.inspection
from lab.third.scene import RIGHT, Scene, scene

FACTORS = (0.5, 2.0)
FIELDS = ("threshold", "factor", "case", "verdict")
AS_IT_IS = "as it is"


def thresholds() -> Iterator[tuple[str, Any, str]]:
    """Yield each threshold of the checks: its name, the frozen record that holds it, and the field."""
    package = debulk.inspection
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        module = importlib.import_module(found.name)
        limits = getattr(module, "LIMITS", None)
        if limits is not None and type(limits).__module__ == module.__name__:
            yield from _fields(module.__name__.removeprefix(package.__name__ + "."), limits)


def _fields(name: str, limits: Any) -> Iterator[tuple[str, Any, str]]:
    for one in dataclasses.fields(limits):
        value = getattr(limits, one.name)
        if dataclasses.is_dataclass(value):
            yield from _fields(f"{name}.{one.name}", value)
        elif not isinstance(value, bool):
            yield f"{name}.{one.name}", limits, one.name


def times(value: Any, factor: float) -> Any:
    """Return a threshold so many times as large; a number of things stays a whole one, at least one."""
    if isinstance(value, tuple):
        return tuple(times(one, factor) for one in value)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


def verdict_of(given: Scene) -> str:
    """Inspect a scene; a thrown error is no verdict, and lets nothing pass."""
    try:
        return inspected(given).verdict.value
    except debulk.InputError:
        return "refused"
    except Exception as error:  # a threshold out of its range
        return type(error).__name__


def table(rows: list[dict[str, str]], scenes: dict[int, Scene]) -> str:
    """Return a row for each threshold: which verdicts change, and which of them for the worse."""
    verdicts: dict[tuple[str, str], dict[int, str]] = defaultdict(dict)
    for row in rows:
        verdicts[row["threshold"], row["factor"]][int(row["case"])] = row["verdict"]
    as_is = verdicts.pop((AS_IT_IS, "1.0"))
    counts = {}
    for (name, factor), found in verdicts.items():
        changed = [n for n, verdict in found.items() if verdict != as_is[n]]
        passes = sum(found[n] == "cease" and scenes[n].truth.held_mm > LIMIT_MM for n in changed)
        needless = sum(scenes[n].kind in RIGHT and as_is[n] in ("cease", "crease") for n in changed)
        counts[name, factor] = len(changed), passes, needless

    def weight(name: str) -> list[int]:
        return [-sum(counts[name, str(factor)][k] for factor in FACTORS) for k in (1, 0)]

    names = sorted(dict.fromkeys(name for name, _ in counts), key=weight)
    idle = [name for name in names if not any(counts[name, str(f)][0] for f in FACTORS)]
    head = "verdicts that change (of these: creases that pass, right layups that lose their verdict)"
    lines = [
        f"Thresholds of the checks at half and at twice their value, debulk {debulk.__version__}: {len(as_is)} scenes "
        f"of the third family, numbers {min(as_is)} to {max(as_is)}",
        f"{len(names)} thresholds, {len(idle)} of which change no verdict of these scenes",
        "",
        f"{'':<42}{head}",
        f"{'threshold':<42}{'half':>16}{'twice':>16}",
    ]
    for name in names:
        if name not in idle:
            cells = ["{} ({}, {})".format(*counts[name, str(f)]) if counts[name, str(f)][0] else "-" for f in FACTORS]
            lines.append(f"{name:<42}" + "".join(f"{cell:>16}" for cell in cells))
    return "\n".join([*lines, "", "no verdict changes:", *(f"  {name}" for name in idle)]) + "\n"


def main() -> None:
    """Inspect what is missing, and print the table of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=36)
    parser.add_argument("--first", type=int, default=9000)
    parser.add_argument("--kept", type=Path, default=Path("build/trust/thresholds.csv"))
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    scenes = {n: scene(n) for n in range(args.first, args.first + args.scenes)}
    with kept(args.kept, FIELDS) as (rows, keep):
        done = {(row["threshold"], row["factor"], int(row["case"])) for row in rows}

        def look(name: str, factor: float) -> None:
            for number, given in scenes.items():
                if (name, str(factor), number) not in done:
                    keep(dict(zip(FIELDS, (name, str(factor), str(number), verdict_of(given)), strict=True)))

        look(AS_IT_IS, 1.0)
        for name, limits, field in thresholds():
            value = getattr(limits, field)
            for factor in FACTORS:
                object.__setattr__(limits, field, times(value, factor))  # all who ask have this one record
                look(name, factor)
            object.__setattr__(limits, field, value)
    text = table(rows, scenes)
    print(text, end="")
    if args.out:
        args.out.write_text(text)


if __name__ == "__main__":
    main()
