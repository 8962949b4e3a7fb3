"""The order of the rooms: every `#include` and every Python import goes downhill, and no file grows out of hand."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# The lines on which the data walks; a room may use what stands before it.
LINES = (
    ("core", "scanner", "cloud", "surface", "pocket", "net", "sheet", "ridge", "verdict"),
    ("core", "solve", "sheet"),
    ("core", "solve", "section", "ridge"),
    ("pocket", "region"),
    ("core", "files"),
)
# In Python the core is what any room may import: the compiled module, its plain types, and the recipe.
PYTHON_CORE = ("_core", "grid", "recipe")

# A kernel is a source in all but name: its file is included once for every instruction set.
MOST_LINES = {".hpp": 120, ".cpp": 350, "_kernel.hpp": 350}


def rooms_before() -> dict[str, set[str]]:
    before: dict[str, set[str]] = {room: set() for line in LINES for room in line}
    for _ in LINES:  # once more for each line that may join another
        for line in LINES:
            for k, room in enumerate(line):
                before[room] |= set(line[:k]).union(*(before[earlier] for earlier in line[:k]))
    return before


BEFORE = rooms_before()


def may_use(room: str, other: str) -> bool:
    return other == room or other in BEFORE[room]


def wrong_includes(root: Path) -> list[str]:
    """Each `#include "..."` in cpp/debulk and cpp/bindings that goes against the order, with its line."""
    wrong = []
    for path in sorted((root / "cpp").rglob("*.[hc]pp")):
        place = path.relative_to(root / "cpp").parts
        bindings = place[0] == "bindings"
        room = place[1]
        if bindings:  # bind_<room>.cpp and <room>_*.hpp belong to their room, the rest to the core
            room = room_of(path.stem.removeprefix("bind_")) or "core"
        for number, line in enumerate(path.read_text().splitlines(), start=1):
            found = re.match(r'\s*#\s*include\s*"([^"]+)"', line)
            if not found:
                continue
            included = found[1].split("/")
            if bindings and included[0] == "bindings":
                continue
            fine = included[0] == "debulk" and len(included) == 3 and room in BEFORE and may_use(room, included[1])
            if not fine:
                wrong.append(f"{path.relative_to(root)}:{number}: {room} may not include {found[1]}")
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
                if room not in BEFORE or not may_use(room, other)
            ]
    return wrong


def imported(node: ast.AST, package: str, modules: set[str]) -> list[str]:
    """Modules of the package, by their first name, that an import statement asks for."""
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        base = node.module or ""
        if node.level:
            base = f"{package}.{base}".rstrip(".")
        names = [f"{package}.{alias.name}" for alias in node.names] if base == package else [base]
    else:
        return []
    found = [name.split(".")[1] for name in names if name.startswith(f"{package}.")]
    return [name for name in found if name in modules]


def room_of(module: str) -> str | None:
    """A module's room; `ridge_plot` is in the room of `ridge`. None: it stands on top of the rooms."""
    for room in BEFORE:
        if module == room or module.startswith(f"{room}_"):
            return room
    return "core" if any(module == m or module.startswith(f"{m}_") for m in PYTHON_CORE) else None


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Every node of a module, but for `if TYPE_CHECKING:`: a name in an annotation binds nothing when the code runs."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            continue
        yield node
        yield from statements(node)


def wrong_imports(root: Path) -> list[str]:
    """Each import in python/debulk, also inside functions, of a room or module that stands further down."""
    package = root / "python" / "debulk"
    modules = {path.stem for path in package.glob("*.py")} | {path.name for path in package.iterdir() if path.is_dir()}
    modules |= {"_core"}
    wrong = []
    for path in sorted(package.rglob("*.py")):
        module = Path(path.relative_to(package).parts[0]).stem
        room = room_of(module)
        if module == "__init__":
            continue
        for node in statements(ast.parse(path.read_text())):
            for other in imported(node, package.name, modules):
                other_room = room_of(other)
                on_top = room is None and other != "cli"
                if other == module or on_top or (room and other_room and may_use(room, other_room)):
                    continue
                assert isinstance(node, ast.Import | ast.ImportFrom)
                wrong.append(f"{path.relative_to(root)}:{node.lineno}: {module} may not import {other}")
    return wrong


def too_long(root: Path) -> list[str]:
    """Each C++ file that has more lines than its kind may have."""
    lengths = [(path, len(path.read_text().splitlines())) for path in sorted((root / "cpp").rglob("*.[hc]pp"))]

    def most(path: Path) -> int:
        return MOST_LINES["_kernel.hpp" if path.name.endswith("_kernel.hpp") else path.suffix]

    return [
        f"{path.relative_to(root)}: {lines} lines, at most {most(path)} are wanted"
        for path, lines in lengths
        if lines > most(path)
    ]


CHECKS = (wrong_includes, wrong_links, wrong_imports, too_long)


@pytest.mark.parametrize("check", CHECKS)
def test_the_house_is_in_order(check):
    assert check(ROOT) == []


def test_the_house_was_read():
    assert len(list((ROOT / "cpp" / "debulk").rglob("*.hpp"))) > 5
    assert {path.name for path in (ROOT / "cpp" / "debulk").iterdir() if path.is_dir()} <= set(BEFORE)


def test_the_two_lines_meet_in_the_sheet():
    assert BEFORE["core"] == set()
    assert BEFORE["solve"] == {"core"}
    assert BEFORE["net"] == {"core", "scanner", "cloud", "surface", "pocket"}
    assert BEFORE["region"] == {"core", "scanner", "cloud", "surface", "pocket"}
    assert BEFORE["files"] == {"core"}
    assert BEFORE["section"] == {"core", "solve"}
    assert BEFORE["verdict"] == set(BEFORE) - {"verdict", "region", "files"}


def plant(root: Path, name: str, text: str) -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.mark.parametrize(
    ("name", "text", "check", "expected"),
    [
        (
            "cpp/debulk/net/a.cpp",
            '#include <vector>\n#include "debulk/core/error.hpp"\n#include "debulk/sheet/sheet.hpp"\n',
            wrong_includes,
            "cpp/debulk/net/a.cpp:3: net may not include debulk/sheet/sheet.hpp",
        ),
        ("cpp/debulk/solve/a.hpp", '# include "debulk/net/net.hpp"\n', wrong_includes, "solve may not include"),
        ("cpp/debulk/core/a.hpp", '#include "bindings/bind.hpp"\n', wrong_includes, "core may not include bindings"),
        ("cpp/debulk/core/a.hpp", '#include "error.hpp"\n', wrong_includes, "core may not include error.hpp"),
        ("cpp/debulk/attic/a.hpp", '#include "debulk/core/grid.hpp"\n', wrong_includes, "attic may not include"),
        ("cpp/bindings/bind_net.cpp", '#include "debulk/sheet/sheet.hpp"\n', wrong_includes, "net may not include"),
        ("cpp/bindings/convert.hpp", '#include "debulk/net/net.hpp"\n', wrong_includes, "core may not include"),
        (
            "cpp/debulk/cloud/CMakeLists.txt",
            "debulk_room(cloud SOURCES a.cpp USES core surface LINKS debulk::pcl)",
            wrong_links,
            "cpp/debulk/cloud/CMakeLists.txt: cloud may not use surface",
        ),
        ("python/debulk/net.py", "import debulk.sheet\n", wrong_imports, "debulk/net.py:1: net may not import sheet"),
        ("python/debulk/net.py", "\nfrom debulk import _core, sheet\n", wrong_imports, "net.py:2: net may not import"),
        ("python/debulk/net.py", "from .sheet import Sheet\n", wrong_imports, "net may not import sheet"),
        ("python/debulk/net.py", "from . import sheet\n", wrong_imports, "net may not import sheet"),
        (
            "python/debulk/net.py",
            "def f():\n    from debulk.report import R\n",
            wrong_imports,
            "net may not import report",
        ),
        ("python/debulk/net.py", "if X:\n    from debulk.cli import main\n", wrong_imports, "net may not import cli"),
        ("python/debulk/recipe.py", "from debulk.sheet import Sheet\n", wrong_imports, "recipe may not import sheet"),
        ("python/debulk/report.py", "from debulk import cli\n", wrong_imports, "report may not import cli"),
        ("cpp/debulk/core/a.hpp", "\n" * 121, too_long, "cpp/debulk/core/a.hpp: 121 lines"),
        ("cpp/debulk/core/a.cpp", "\n" * 351, too_long, "cpp/debulk/core/a.cpp: 351 lines"),
    ],
)
def test_a_planted_fault_is_found(tmp_path, name, text, check, expected):
    for module in ("cli", "net", "recipe", "report", "sheet"):
        plant(tmp_path, f"python/debulk/{module}.py", "")
    plant(tmp_path, "cpp/debulk/core/error.hpp", "")
    assert check(tmp_path) == []
    plant(tmp_path, name, text)
    faults = check(tmp_path)
    assert len(faults) == 1
    assert expected in faults[0]


def test_what_goes_downhill_is_fine(tmp_path):
    plant(tmp_path, "cpp/debulk/sheet/a.cpp", '#include "debulk/solve/problem.hpp"\n#include "debulk/net/net.hpp"\n')
    plant(tmp_path, "cpp/bindings/bind_sheet.cpp", '#include "bindings/bind.hpp"\n#include "debulk/sheet/a.hpp"\n')
    plant(tmp_path, "cpp/bindings/sheet_arrays.hpp", '#include "debulk/sheet/a.hpp"\n')
    plant(tmp_path, "python/debulk/solve.py", "if TYPE_CHECKING:\n    from debulk.sheet import Sheet\n")
    plant(tmp_path, "cpp/bindings/module.cpp", '#include "debulk/core/error.hpp"\n')
    plant(tmp_path, "python/debulk/recipe.py", "from debulk.recipe_text import toml\n")
    plant(tmp_path, "python/debulk/recipe_text.py", "from debulk.recipe import Recipe\n")
    plant(
        tmp_path, "python/debulk/sheet.py", "from debulk import _core, InputError\nfrom debulk.recipe import Recipe\n"
    )
    plant(tmp_path, "python/debulk/report.py", "import debulk.sheet\nfrom debulk.view import show\nimport numpy\n")
    plant(tmp_path, "python/debulk/view.py", "")
    assert [fault for check in CHECKS for fault in check(tmp_path)] == []
