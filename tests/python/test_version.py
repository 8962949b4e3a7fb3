"""One version everywhere, and a line in the changelog for it."""

import re
import tomllib
from pathlib import Path

import debulk

ROOT = Path(__file__).resolve().parents[2]


def test_the_version_is_the_same_everywhere():
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == debulk.__version__
    assert f"project(debulk VERSION {debulk.__version__} " in (ROOT / "CMakeLists.txt").read_text()
    newest = re.search(r"^## (.*)$", (ROOT / "docs/changelog.md").read_text(), re.MULTILINE)[1]
    assert re.fullmatch(rf"{re.escape(debulk.__version__)}, \d{{4}}-\d\d-\d\d", newest)
