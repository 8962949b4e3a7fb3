"""Reads the house: what includes and imports what, against the order of the rooms.

A room uses only rooms that stand before it on a line. In C++ every `#include` is read, in Python every import, also
those inside functions and under `if TYPE_CHECKING`; `FOR_TYPES_ONLY` lists the few of the latter that go uphill.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

# The lines on which the data walks (design, "Layout"). A room that does not exist yet does no harm.
LINES = tuple(
    line.split()
    for line in (
        "core scanner cloud surface pocket net sheet ridge verdict",
        "core solve sheet",
        "core solve section ridge",
        "pocket fibre verdict",
        "core files",
    )
)
# The package from below to above; between the public rooms the order is that of LINES. Inside a folder only circles are
# forbidden; the inspection's folders have an order of their own. The package itself, "debulk", is its `__init__.py`.
PYTHON_BELOW = (
    "_core",
    "arguments",
    "forking",
    "workers",
    "words",
    "toml_text",
    "grid",
    "build",
    "debulk",
    "arrays",
    "rings",
    "foreign",
    "origin",
    "stopping",
    "recipe",
    "files",
)
PYTHON_ROOMS = (
    "cloud",
    "surface",
    "pocket",
    "fibre",
    "net",
    "sheet",
    "solve",
    "ridge",
    "section",
    "verdict",
    "scanner",
)
PYTHON_ABOVE = (
    "rework", "results", "risk", "page", "report", "comparison", "history", "learning", "inspection", "stack",
    "batch", "chain", "scenes", "view", "doctor", "serve", "cli", "__main__", "pyinstaller",
)  # fmt: skip

# The rooms of the inspection, from below to above; its own modules stand above them all.
INSPECTION_ROOMS = (
    "running", "clouds", "reference", "ply", "evidence", "find", "lines", "minima", "holes", "evaluate",
    "place", "rawscan", "checks",
)  # fmt: skip

# Imports under `if TYPE_CHECKING` that go uphill or close a circle; no new ones are wanted. Those of the package's own
# `__init__`, which names everything lazily, are not counted.
FOR_TYPES_ONLY = {
    ("debulk.solve", "debulk.sheet"),
    ("debulk.chain.recognise", "debulk.chain.record"),
    ("debulk.chain.page", "debulk.chain.record"),
    ("debulk.inspection.calls", "debulk.chain.record"),
    ("debulk.inspection.inspector", "debulk.chain.record"),
    ("debulk.inspection.repeating", "debulk.chain.record"),
    *((f"debulk.results.{name}", "debulk.results.report")
      for name in ("advice", "deciding", "notebook", "report_text", "rework")),
}  # fmt: skip

# A kernel or an .inl is a source in all but name: its file is included by others.
MOST_LINES = {".hpp": 120, ".cpp": 350, ".inl": 350, "_kernel.hpp": 350}


def _rooms_before() -> dict[str, set[str]]:
    before: dict[str, set[str]] = {room: set() for line in LINES for room in line}
    for _ in LINES:  # once more for each line that may join another
        for line in LINES:
            for k, room in enumerate(line):
                before[room] |= set(line[:k]).union(*(before[earlier] for earlier in line[:k]))
    return before


BEFORE = _rooms_before()


def may_include(room: str, other: str) -> bool:
    """Whether a C++ room may use another."""
    return room in BEFORE and (other == room or other in BEFORE[room])


def may_import(part: str, other: str) -> bool:
    """Whether a part of the Python package, a module or a folder of its top level, may use another."""
    if part == other:
        return True
    if part in PYTHON_ROOMS and other in PYTHON_ROOMS:
        return other in BEFORE[part]
    order = [*PYTHON_BELOW, "the rooms", *PYTHON_ABOVE]
    here, there = ("the rooms" if name in PYTHON_ROOMS else name for name in (part, other))
    return here in order and there in order and order.index(there) < order.index(here)


# --- C++ ---


def _cpp_files(root: Path) -> list[Path]:
    return sorted(path for path in (root / "cpp").rglob("*") if path.suffix in (".hpp", ".cpp", ".inl"))


def _includes(path: Path) -> Iterator[tuple[int, str]]:
    """Yield line and name of each file of the house that a C++ file includes, in quotes or in angle brackets."""
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        found = re.match(r'\s*#\s*include\s*(?:"([^"]+)"|<((?:debulk|bindings)/[^>]+)>)', line)
        if found:
            yield number, found[1] or found[2]


def _binding_room(stem: str) -> str:
    """Tell the room of a binding: bind_<room>.cpp and <room>_*.hpp belong to their room, the rest to the core."""
    stem = stem.removeprefix("bind_")
    return next((room for room in BEFORE if stem == room or stem.startswith(f"{room}_")), "core")


def wrong_includes(root: Path) -> list[str]:
    """Each `#include` in cpp/debulk and cpp/bindings that goes against the order, with its line."""
    wrong = []
    for path in _cpp_files(root):
        place = path.relative_to(root / "cpp").parts
        bindings = place[0] == "bindings"
        room = _binding_room(path.stem) if bindings else place[1]
        for number, name in _includes(path):
            included = name.split("/")
            if bindings and included[0] == "bindings":
                continue
            if included[0] != "debulk" or len(included) != 3 or not may_include(room, included[1]):
                wrong.append(f"{path.relative_to(root)}:{number}: {room} may not include {name}")
    return wrong


def wrong_links(root: Path) -> list[str]:
    """Each room that a cpp/debulk/<room>/CMakeLists.txt uses against the order."""
    wrong = []
    for path in sorted((root / "cpp" / "debulk").glob("*/CMakeLists.txt")):
        room = path.parent.name
        for used in re.findall(r"\bUSES((?:\s+[a-z]\w*)+)", path.read_text()):
            wrong += [
                f"{path.relative_to(root)}: {room} may not use {other}"
                for other in used.split()
                if not may_include(room, other)
            ]
    return wrong


def too_long(root: Path) -> list[str]:
    """Each C++ file that has more lines than its kind may have."""
    lengths = [(path, len(path.read_text().splitlines())) for path in _cpp_files(root)]

    def most(path: Path) -> int:
        return MOST_LINES["_kernel.hpp" if path.name.endswith("_kernel.hpp") else path.suffix]

    return [
        f"{path.relative_to(root)}: {lines} lines, at most {most(path)} are wanted"
        for path, lines in lengths
        if lines > most(path)
    ]


def bound_to_a_locale(root: Path) -> list[str]:
    """Each use of a function that writes or reads numbers with a decimal comma once a program has set such a locale."""
    bound = re.compile(r"\b(?:v?f?s?n?printf|s?scanf|strto(?:d|f|ld)|ato[fi]|sto(?:d|f|ld))\s*\(")
    return [
        f"{path.relative_to(root)}:{number}: {found[0]} follows the locale; use std::to_chars or std::from_chars"
        for path in _cpp_files(root)
        for number, line in enumerate(path.read_text().splitlines(), start=1)
        if (found := bound.search(line))
    ]


# --- Python ---


def modules_of(root: Path) -> dict[str, Path]:
    """Return every module of python/debulk by its dotted name; a folder's `__init__.py` by the folder's."""
    package = root / "python" / "debulk"
    named = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        named[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return named


def _statements(tree: ast.AST, only_types: bool = False) -> Iterator[tuple[ast.AST, bool]]:
    """Yield every node of a module, and whether it stands under `if TYPE_CHECKING:`."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in (
            getattr(node.test, "id", ""),
            getattr(node.test, "attr", ""),
        ):
            for part, types in ((node.body, True), (node.orelse, only_types)):
                for other in part:
                    yield other, types
                    yield from _statements(other, types)
            continue
        yield node, only_types
        yield from _statements(node, only_types)


def imports_of(name: str, path: Path, modules: dict[str, Path]) -> list[tuple[int, str, str]]:
    """Return line, module and, if it is none, the name asked of that module, of each import from the package."""
    known = modules.keys() | {"debulk._core"}
    folder = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = []
    for node, only_types in _statements(ast.parse(path.read_text())):
        before = len(found)
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = folder.split(".")[: len(folder.split(".")) - node.level + 1]
                base = ".".join([*above, *([base] if base else [])])
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                found.append((node.lineno, inner, "") if inner in known else (node.lineno, base, alias.name))
        if only_types:
            spared = [entry for entry in found[before:] if name == "debulk" or (name, entry[1]) in FOR_TYPES_ONLY]
            found[before:] = [entry for entry in found[before:] if entry not in spared]
    return [entry for entry in found if entry[1].partition(".")[0] == "debulk"]


def _own_names(path: Path) -> set[str]:
    """Return the names that a module binds at its top level."""
    names = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ImportFrom):
            names |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Assign):
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return names


def _downhill_in_inspection(name: str, other: str) -> bool:
    """Whether a module of the inspection stands in the room of the other or above it; others are not asked."""
    if not (name.startswith("debulk.inspection.") and other.startswith("debulk.inspection.")):
        return True
    order = [*INSPECTION_ROOMS, ""]
    here, there = (
        order.index(room) if (room := one.split(".")[2]) in order else len(order) - 1 for one in (name, other)
    )
    return there <= here


def wrong_imports(root: Path) -> list[str]:
    """Each import in python/debulk of a part that stands further up, and each detour by the package's lazy names."""
    modules = modules_of(root)
    own = _own_names(modules["debulk"]) if "debulk" in modules else set()
    wrong = []
    for name, path in modules.items():
        part = name.split(".")[1] if "." in name else "debulk"
        for line, other, asked in imports_of(name, path, modules):
            other_part = other.split(".")[1] if "." in other else "debulk"
            where = f"{path.relative_to(root)}:{line}"
            if not may_import(part, other_part):
                wrong.append(f"{where}: {part} may not import {other_part}")
            elif not _downhill_in_inspection(name, other):
                wrong.append(f"{where}: {name} may not import {other}")
            elif other == "debulk" and asked not in own:
                wrong.append(f"{where}: {asked or 'debulk'} is to be imported from the module that defines it")
    return wrong


# --- circles ---


def _circles(uses: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of names that use one another, by Tarjan's strongly connected components."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    groups = []

    def visit(name: str) -> None:
        number[name] = lowest[name] = len(number)
        stack.append(name)
        for other in sorted(uses.get(name, ())):
            if other not in number:
                visit(other)
            if other in stack:
                lowest[name] = min(lowest[name], lowest[other])
        if lowest[name] == number[name]:
            at = stack.index(name)
            group, stack[at:] = stack[at:], []
            if len(group) > 1 or name in uses.get(name, ()):
                groups.append(sorted(group))

    for name in sorted(uses):
        if name not in number:
            visit(name)
    return groups


def circles(root: Path) -> list[str]:
    """Each circle of C++ files by their includes, and of Python modules by their imports, lazy ones too."""
    modules = modules_of(root)
    includes = {str(path.relative_to(root / "cpp")): {name for _, name in _includes(path)} for path in _cpp_files(root)}
    imports = {name: {other for _, other, _ in imports_of(name, path, modules)} for name, path in modules.items()}
    return [f"a circle: {', '.join(group)}" for uses in (includes, imports) for group in _circles(uses)]


CHECKS = (wrong_includes, wrong_links, wrong_imports, circles, too_long, bound_to_a_locale)


# --- the picture ---


def _uses(root: Path, room: str) -> list[str]:
    """Return the rooms that a C++ room uses itself, in the order in which the data walks."""
    found = re.search(r"\bUSES((?:\s+[a-z]\w*)+)", (root / "cpp" / "debulk" / room / "CMakeLists.txt").read_text())
    used = found[1].split() if found else []
    return sorted(used, key=lambda other: (len(BEFORE[other]), other))


def _told(path: Path) -> str:
    """Return the beginning of a module's docstring, as far as its first comma, colon or full stop."""
    text = " ".join((ast.get_docstring(ast.parse(path.read_text())) or "").split())
    return re.split(r"[.:;,](?:\s|$)", text)[0]


def picture(root: Path) -> str:
    """Draw the house: every room of the core with those that it uses, every part of the package above those it may."""
    rooms = sorted(path.parent.name for path in (root / "cpp" / "debulk").glob("*/CMakeLists.txt"))
    rooms.sort(key=lambda room: (len(BEFORE[room]), room))
    lines = ["C++ (cpp/debulk), a room on those that it uses", ""]
    lines += [
        f"  {room:10}{'<- ' + ' '.join(_uses(root, room)) if _uses(root, room) else ''}".rstrip() for room in rooms
    ]
    lines += ["", "Python (python/debulk), from below to above", ""]
    parts = {name.split(".")[1]: path for name, path in modules_of(root).items() if name.count(".") == 1}
    parts |= {"debulk": modules_of(root)["debulk"]}
    order = [*PYTHON_BELOW, *PYTHON_ROOMS, *PYTHON_ABOVE]
    lines += [f"  {part:12} {_told(parts[part])}" for part in order if part in parts]
    return "\n".join(lines)


def page_with(page: str, drawn: str) -> str:
    """Return the page with the picture in its block of text."""
    return re.sub(r"(?s)(?<=```text\n)C\+\+ .*?(?=\n```)", lambda _: drawn, page)


if __name__ == "__main__":
    house = Path(__file__).resolve().parents[2]
    where = house / "docs/house.md"
    where.write_text(page_with(where.read_text(), picture(house)))
    print(picture(house))
