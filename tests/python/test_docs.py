"""The pages: every citation of one in the code, every link and every name in one points at something that exists."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from debulk import Verdict
from debulk.cli import app
from debulk.cli.support import EXIT_CODES
from debulk.recipe import Recipe

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("*.hpp", "*.cpp", "*.inl", "*.py", "*.pyi", "*.txt", "*.cmake", "*.sh")
DOCS = sorted((ROOT / "docs").rglob("*.md"))
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
FOLDERS = ("cpp", "python", "tests", "bench", "cmake")

FENCE = re.compile(r"^ *(```|~~~).*?^ *\1 *$", re.MULTILINE | re.DOTALL)
CITATION = re.compile(
    r"(?P<path>[\w./-]*\w\.md)\b"
    r"(?:\W{0,2} sections? (?P<numbers>[\d.]*\d(?:(?:,| and) [\d.]*\d)*)"
    r'|, "(?P<title>[^"]+)"|, eq\. \((?P<eq>[\d.]+)\))?'
)


def pages(root: Path) -> list[Path]:
    return sorted([*root.glob("*.md"), *(root / "docs").rglob("*.md"), *(root / "bench").rglob("*.md")])


def prose(page: Path) -> str:
    """The page without its blocks of code."""
    return FENCE.sub("", page.read_text())


def example(page: Path) -> str:
    """The Python on a page, block after block: they share their names."""
    return "\n".join(re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL))


def headings(page: Path) -> list[str]:
    return [match[1].strip() for match in re.finditer(r"^#{1,6} +(.+)$", prose(page), re.MULTILINE)]


def anchor(heading: str) -> str:
    """As GitHub and MyST make it: lower case, no punctuation, hyphens for spaces."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def broken_links(page: Path) -> Iterator[str]:
    for match in re.finditer(r"\]\(<?([^)>\s]+)>?(?: [^)]*)?\)", re.sub(r"`[^`\n]*`", "", prose(page))):
        target, _, fragment = match[1].partition("#")
        if re.match(r"[a-z]+:", match[1]):
            continue
        other = page.parent / target if target else page
        if not other.exists():
            yield f"{page.name}: no file {match[1]}"
        elif fragment and fragment not in map(anchor, headings(other)):
            yield f"{page.name}: no heading for {match[1]}"


def broken_citations(path: Path, root: Path) -> Iterator[str]:
    """Pages that a source names, from the root of the repository, and what it says of their sections."""
    text = path.read_text()
    # A comment goes on in the next line behind its sign, and what is cited may, too.
    joined = re.sub(r"\n[ \t]*(?://+|#)?[ \t]*", lambda found: " " + "\0" * (len(found[0]) - 1), text)
    for match in CITATION.finditer(re.sub("\0+", "", joined)):
        where = f"{path.relative_to(root)}: {match[0]}"
        page = root / match["path"]
        if not page.is_file():
            yield f"{where}: no such page"
            continue
        for number in re.findall(r"[\d.]*\d", match["numbers"] or ""):
            if not any(re.match(rf"{re.escape(number)}\.? ", heading) for heading in headings(page)):
                yield f"{where}: no section {number}"
        if match["title"] and match["title"] not in headings(page):
            yield f"{where}: no such heading"
        if match["eq"] and f"\\tag{{{match['eq']}}}" not in page.read_text():
            yield f"{where}: no such equation"


def all_broken_citations(root: Path) -> list[str]:
    found = []
    for folder in FOLDERS:
        for pattern in SOURCES:
            for path in sorted((root / folder).rglob(pattern)):
                if path != Path(__file__):  # which plants broken ones
                    found += broken_citations(path, root)
    return found


def unknown_names(page: Path, root: Path) -> Iterator[str]:
    """Settings, files and public names between backticks that are not there (any more)."""
    for name in re.findall(r"`([^`\n]+)`", prose(page)):
        section, _, setting = name.partition(".")
        if section in Recipe.model_fields and re.fullmatch(r"\w+", setting):
            model = type(getattr(Recipe(), section))
            if setting not in model.model_fields:
                yield f"{page.name}: the recipe has no {name}"
        elif re.fullmatch(r"(\w+_test\.cpp|test_\w+\.py)", name):
            if not any((root / "tests").rglob(name)):
                yield f"{page.name}: no test {name}"
        elif re.fullmatch(r"[\w./-]+/[\w./-]*", name):
            if not any((root / base / name).exists() for base in ("", "cpp/debulk", "python/debulk")):
                yield f"{page.name}: no file {name}"
        elif (match := re.match(r"debulk((?:\.\w+)+)", name)) and not importable(match[1].split(".")[1:]):
            yield f"{page.name}: no {name}"


def importable(path: list[str]) -> bool:
    found = importlib.import_module("debulk")
    for name in path:
        if not hasattr(found, name):
            try:
                importlib.import_module(f"{found.__name__}.{name}")
            except (ImportError, AttributeError):
                return False
        found = getattr(found, name)
    return True


def test_every_page_that_the_code_cites_exists_with_what_is_cited() -> None:
    assert "\n".join(all_broken_citations(ROOT)) == ""


def test_every_link_between_pages_leads_somewhere() -> None:
    assert "\n".join(wrong for page in pages(ROOT) for wrong in broken_links(page)) == ""


def test_every_name_on_a_page_is_one_of_the_project() -> None:
    assert len(DOCS) >= 3
    assert "\n".join(wrong for page in DOCS for wrong in unknown_names(page, ROOT)) == ""


def run(code: str, folder: Path) -> str:
    """What a program prints in an interpreter of its own: this one has imported what a reader's has not."""
    ran = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stderr[-2000:]
    return ran.stdout


@pytest.mark.program
@pytest.mark.parametrize("page", [page for page in DOCS if example(page)], ids=lambda page: page.stem)
def test_the_examples_on_a_page_run(page: Path, tmp_path: Path) -> None:
    run(example(page), tmp_path)


@pytest.mark.program
@pytest.mark.parametrize("program", EXAMPLES, ids=lambda program: program.stem)
def test_an_example_runs_as_it_stands_and_is_on_the_page_with_its_picture(program: Path, tmp_path: Path) -> None:
    assert run(program.read_text(), tmp_path)
    page = (ROOT / "docs" / "examples.md").read_text()
    assert f"examples/{program.name}" in page and f"pictures/example_{program.stem}.png" in page


@pytest.mark.program
def test_the_example_of_the_readme_runs_on_what_the_demo_leaves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = re.search(r"`debulk (demo [^`]*)`", (ROOT / "README.md").read_text())
    assert command is not None
    assert CliRunner().invoke(app, [*command[1].split(), "--pixels", "640x480", "-q"]).exit_code == 0
    first, *pockets = run(example(ROOT / "README.md"), tmp_path).splitlines()
    assert first == "CREASE False" and len(pockets) > 10
    assert Path("layup.html").stat().st_size > 100_000


def test_the_exit_codes_on_the_page_are_those_of_the_command_line() -> None:
    page = (ROOT / "docs" / "integration.md").read_text()
    told = {Verdict[name]: int(code) for code, name in re.findall(r"^\| (\d+) \| ([A-Z]+)\b", page, re.MULTILINE)}
    assert told == EXIT_CODES


def test_sphinx_leaves_the_equations_alone() -> None:
    """It wraps one that holds a line break into an environment in which MathJax refuses its number."""
    for page in DOCS:
        for equation in re.findall(r"\$\$(.+?)\$\$", prose(page), re.DOTALL):
            assert "\\\\" not in equation, f"{page.name}: write \\cr for the line break in {equation}"
        # Without an empty line before it, MyST takes an equation in a list for a part of the sentence.
        lines = prose(page).splitlines()
        opened = [at for at, line in enumerate(lines) if line.strip() == "$$"][::2]
        assert not [lines[at - 1] for at in opened if lines[at - 1].strip()], page.name


# Each kind of fault is planted, to see that it is found.


@pytest.fixture
def house(tmp_path: Path) -> Path:
    (tmp_path / "docs").mkdir()
    (tmp_path / "cpp").mkdir()
    (tmp_path / "docs" / "page.md").write_text(
        "# A page\n\n## 2. Two things\n\n### 2.1 One\n\n$$ a \\tag{2.1} $$\n\n```\n# no heading\n[no](link)\n```\n"
    )
    return tmp_path


@pytest.mark.parametrize(
    ("comment", "broken"),
    [
        ("// see docs/page.md", ""),
        ("// (docs/page.md, section 2)", ""),
        ("// (docs/page.md,\n// section 2.1)", ""),
        ('// docs/page.md, "2. Two things"', ""),
        ("// docs/page.md, eq. (2.1)", ""),
        ("// see page.md", "no such page"),
        ("// docs/page.md, section 3", "no section 3"),
        ("// docs/page.md, sections 2 and 4", "no section 4"),
        ("// as in docs/page.md,\n//   section 2.2: many", "no section 2.2"),
        ('// docs/page.md, "no heading"', "no such heading"),
        ("// docs/page.md, eq. (2.2)", "no such equation"),
    ],
)
def test_a_citation_is_checked(house: Path, comment: str, broken: str) -> None:
    (house / "cpp" / "a.hpp").write_text(f"int a;\n{comment}\nint b;\n")
    found = all_broken_citations(house)
    assert len(found) == (broken != "")
    assert all(broken in wrong for wrong in found)


@pytest.mark.parametrize(
    ("link", "broken"),
    [
        ("[it](page.md)", ""),
        ("[it](page.md#2-two-things)", ""),
        ("[it](https://example.org/no#way)", ""),
        ("`[it](away.md)`", ""),
        ("[it](away.md)", "no file away.md"),
        ("![it](away.png)", "no file away.png"),
        ("[it](page.md#no-heading)", "no heading"),
        ("[it](#3-three)", "no heading"),
    ],
)
def test_a_link_is_checked(house: Path, link: str, broken: str) -> None:
    page = house / "docs" / "other.md"
    page.write_text(f"# Other\n\nSee {link}.\n")
    found = list(broken_links(page))
    assert len(found) == (broken != "")
    assert all(broken in wrong for wrong in found)


@pytest.mark.parametrize(
    ("name", "broken"),
    [
        ("net.node_target", ""),
        ("debulk.section.fold(1.0)", ""),
        ("test_docs.py", ""),
        ("docs/page.md", ""),
        ("net.nodes_wanted", "no net.nodes_wanted"),
        ("debulk.section.unfold", "no debulk.section.unfold"),
        ("unwritten_test.cpp", "no test"),
        ("cpp/a.hpp", "no file"),
    ],
)
def test_a_name_is_checked(house: Path, name: str, broken: str) -> None:
    (house / "tests").mkdir()
    (house / "tests" / "test_docs.py").write_text("")
    page = house / "docs" / "other.md"
    page.write_text(f"# Other\n\nThe `{name}` is here.\n")
    found = list(unknown_names(page, house))
    assert len(found) == (broken != "")
    assert all(broken in wrong for wrong in found)
