"""The order of the rooms: includes and imports go downhill, nothing goes in a circle, and no file grows out of hand.

The checks themselves are in house.py; here each of them is also given faults that it must find.
"""

from pathlib import Path

import pytest

from house import (
    BEFORE,
    CHECKS,
    PYTHON_ABOVE,
    PYTHON_BELOW,
    PYTHON_ROOMS,
    bound_to_a_locale,
    circles,
    modules_of,
    page_with,
    picture,
    too_long,
    wrong_imports,
    wrong_includes,
    wrong_links,
)

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("check", CHECKS)
def test_the_house_is_in_order(check):
    assert check(ROOT) == []


def test_the_house_was_read():
    assert len(list((ROOT / "cpp" / "debulk").rglob("*.hpp"))) > 5
    assert {path.name for path in (ROOT / "cpp" / "debulk").iterdir() if path.is_dir()} <= set(BEFORE)
    modules = modules_of(ROOT)
    assert len(modules) > 50
    parts = {name.split(".")[1] for name in modules if "." in name}
    assert parts <= {*PYTHON_BELOW, *PYTHON_ROOMS, *PYTHON_ABOVE}


def test_the_picture_on_the_page_is_of_this_house():
    page = (ROOT / "docs/house.md").read_text()
    assert picture(ROOT) in page, "make house draws it anew"
    assert page_with(page.replace("  core", "  attic"), picture(ROOT)) == page


def test_the_lines_join():
    assert BEFORE["core"] == set()
    assert BEFORE["solve"] == BEFORE["files"] == {"core"}
    assert BEFORE["net"] == {"core", "scanner", "cloud", "surface", "pocket"}
    assert BEFORE["section"] == {"core", "solve"}
    assert BEFORE["verdict"] == set(BEFORE) - {"verdict", "files"}


def plant(root: Path, name: str, text: str) -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


FAULTS = [
    (
        "cpp/debulk/net/a.cpp",
        '#include <vector>\n#include "debulk/core/error.hpp"\n#include "debulk/sheet/sheet.hpp"\n',
        wrong_includes,
        "cpp/debulk/net/a.cpp:3: net may not include debulk/sheet/sheet.hpp",
    ),
    ("cpp/debulk/solve/a.hpp", '# include "debulk/net/net.hpp"\n', wrong_includes, "solve may not include"),
    ("cpp/debulk/solve/a.inl", '#include "debulk/net/net.hpp"\n', wrong_includes, "a.inl:1: solve may not include"),
    ("cpp/debulk/solve/a.hpp", "#include <debulk/net/net.hpp>\n", wrong_includes, "solve may not include"),
    ("cpp/debulk/section/a.hpp", '#include "debulk/sheet/a.hpp"\n', wrong_includes, "section may not include"),
    ("cpp/debulk/pocket/a.hpp", '#include "debulk/fibre/a.hpp"\n', wrong_includes, "pocket may not include"),
    ("cpp/debulk/files/a.hpp", '#include "debulk/cloud/a.hpp"\n', wrong_includes, "files may not include"),
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
    ("cpp/debulk/core/error.hpp", '#include "debulk/core/error.hpp"\n', circles, "debulk/core/error.hpp"),
    ("python/debulk/net.py", "import debulk.sheet\n", wrong_imports, "debulk/net.py:1: net may not import sheet"),
    ("python/debulk/net.py", "\nfrom debulk import _core, sheet\n", wrong_imports, "net.py:2: net may not import"),
    ("python/debulk/net.py", "from .sheet import Sheet\n", wrong_imports, "net may not import sheet"),
    ("python/debulk/net.py", "from . import sheet\n", wrong_imports, "net may not import sheet"),
    ("python/debulk/net.py", "def f():\n    from debulk.report import R\n", wrong_imports, "net may not import report"),
    ("python/debulk/net.py", "if X:\n    from debulk.cli import main\n", wrong_imports, "net may not import cli"),
    (
        "python/debulk/net.py",
        "if TYPE_CHECKING:\n    pass\nelse:\n    import debulk.cli\n",
        wrong_imports,
        "net may not import cli",
    ),
    ("python/debulk/recipe/a.py", "from debulk.sheet import Sheet\n", wrong_imports, "recipe may not import sheet"),
    ("python/debulk/results/a.py", "from debulk.page.map import A\n", wrong_imports, "results may not import page"),
    ("python/debulk/results/a.py", "from ..page import map\n", wrong_imports, "a.py:1: results may not import page"),
    (
        "python/debulk/page/deep/a.py",
        "def f():\n    from debulk.inspection.inspector import I\n",
        wrong_imports,
        "python/debulk/page/deep/a.py:2: page may not import inspection",
    ),
    (
        "python/debulk/inspection/find/a.py",
        "from debulk.inspection.inspector import I\n",
        wrong_imports,
        "find/a.py:1: debulk.inspection.find.a may not import debulk.inspection.inspector",
    ),
    ("python/debulk/report.py", "from debulk import cli\n", wrong_imports, "report may not import cli"),
    ("python/debulk/net.py", "from debulk import Recipe\n", wrong_imports, "Recipe is to be imported from the module"),
    ("python/debulk/recipe/b.py", "def f():\n    from debulk.recipe import c\n", circles, "recipe.b, debulk.recipe.c"),
    ("python/debulk/recipe/b.py", "from .c import f\n", circles, "recipe.b, debulk.recipe.c"),
    (
        "python/debulk/recipe/b.py",
        "if TYPE_CHECKING:\n    from debulk.recipe.c import f\n",
        circles,
        "recipe.b, debulk.recipe.c",
    ),
    (
        "python/debulk/net.py",
        "if TYPE_CHECKING:\n    from debulk.cli import main\n",
        wrong_imports,
        "may not import cli",
    ),
    ("cpp/debulk/core/a.hpp", "\n" * 121, too_long, "cpp/debulk/core/a.hpp: 121 lines"),
    ("cpp/debulk/core/a.cpp", "\n" * 351, too_long, "cpp/debulk/core/a.cpp: 351 lines"),
    (
        "cpp/debulk/core/a.cpp",
        "\nstd::snprintf(a, 9, b);\n",
        bound_to_a_locale,
        "a.cpp:2: snprintf( follows the locale",
    ),
]


@pytest.mark.parametrize(("name", "text", "check", "expected"), FAULTS)
def test_a_planted_fault_is_found(tmp_path, name, text, check, expected):
    for module in ("__init__", "net", "sheet", "report", "page/map", "recipe/__init__", "cli/__init__"):
        plant(tmp_path, f"python/debulk/{module}.py", "")
    plant(tmp_path, "python/debulk/inspection/inspector.py", "")
    plant(tmp_path, "python/debulk/recipe/c.py", "from debulk.recipe import b\n")
    plant(tmp_path, "python/debulk/recipe/b.py", "")
    plant(tmp_path, "cpp/debulk/core/error.hpp", "")
    assert [fault for one in CHECKS for fault in one(tmp_path)] == []
    plant(tmp_path, name, text)
    faults = check(tmp_path)
    assert len(faults) == 1
    assert expected in faults[0]
    assert [fault for one in CHECKS if one is not check for fault in one(tmp_path)] == []


def test_what_goes_downhill_is_fine(tmp_path):
    plant(tmp_path, "cpp/debulk/sheet/a.cpp", '#include "debulk/solve/problem.hpp"\n#include "debulk/net/net.hpp"\n')
    plant(tmp_path, "cpp/debulk/ridge/a.inl", '#include "debulk/section/a.hpp"\n')
    plant(tmp_path, "cpp/debulk/fibre/a.hpp", '#include "debulk/pocket/a.hpp"\n')
    plant(tmp_path, "cpp/bindings/bind_sheet.cpp", '#include "bindings/bind.hpp"\n#include "debulk/sheet/a.hpp"\n')
    plant(tmp_path, "cpp/bindings/sheet_arrays.hpp", '#include "debulk/sheet/a.hpp"\n')
    plant(tmp_path, "cpp/bindings/module.cpp", '#include "debulk/core/error.hpp"\n')
    plant(tmp_path, "python/debulk/__init__.py", "from debulk._core import InputError\n__version__ = '1'\n")
    plant(tmp_path, "python/debulk/solve.py", "if TYPE_CHECKING:\n    from debulk.sheet import Sheet\n")
    plant(tmp_path, "python/debulk/recipe/__init__.py", "from debulk.recipe.model import Recipe\n")
    plant(tmp_path, "python/debulk/recipe/model.py", "def f():\n    from debulk.recipe.toml import toml\n")
    plant(
        tmp_path, "python/debulk/sheet.py", "from debulk import _core, InputError\nfrom debulk.recipe import Recipe\n"
    )
    plant(tmp_path, "python/debulk/view.py", "import debulk.sheet\nfrom debulk.report import R\nimport numpy\n")
    plant(tmp_path, "python/debulk/report.py", "from debulk import __version__\n")
    assert [fault for check in CHECKS for fault in check(tmp_path)] == []


def test_the_rooms_that_the_sanitizers_try_are_there():
    # The C++ room that went away was still in this list, which nothing but the sanitizers' own run reads.
    makefile = (ROOT / "Makefile").read_text()
    rooms = makefile.split("\nrooms ?= ")[1].split("\n")[0].split()
    assert [room for room in rooms if not any((ROOT / "tests/cpp" / room).glob("*_test.cpp"))] == []
