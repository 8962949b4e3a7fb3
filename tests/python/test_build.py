"""Python files of one commit and a compiled module of another do not work together."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import debulk
from debulk import _core, build

ROOT = Path(__file__).resolve().parents[2]


def test_the_digits_are_those_of_the_sources_and_of_nothing_else(tmp_path):
    (tmp_path / "room").mkdir()
    source = tmp_path / "room" / "a.cpp"
    source.write_text("int a;\n")
    found = {build.sources_id(tmp_path)}
    (tmp_path / "room" / "a.cpp.orig").write_text("int b;\n")
    assert build.sources_id(tmp_path) in found
    for change in (lambda: source.write_text("int a; \n"), lambda: source.rename(tmp_path / "room" / "b.cpp")):
        change()
        found.add(build.sources_id(tmp_path))
    assert len(found) == 3


def test_a_source_tree_wants_the_module_of_its_own_sources(tmp_path):
    (tmp_path / "python").mkdir()
    (tmp_path / "python" / "debulk").symlink_to(Path(debulk.__file__).parent)
    shutil.copytree(ROOT / "cpp", tmp_path / "cpp")
    command = [sys.executable, "-c", "import debulk; print(debulk.__file__)"]
    run = {"env": {"PYTHONPATH": str(tmp_path / "python")}, "capture_output": True, "text": True, "cwd": tmp_path}
    same = subprocess.run(command, **run)
    assert same.stdout.startswith(str(tmp_path)), same.stderr

    changed = tmp_path / "cpp" / "debulk" / "verdict" / "judge.cpp"
    changed.write_text(changed.read_text() + "\n")
    mixed = subprocess.run(command, **run)
    assert mixed.returncode == 1
    last = mixed.stderr.splitlines()[-1]
    assert last.startswith("ImportError: debulk: the compiled module is build ")
    assert _core.build in last and f"{debulk.__version__} {build.sources_id(tmp_path / 'cpp')}" in last
    assert "build it from the sources in this tree" in last


def test_an_installed_package_wants_the_module_that_came_with_it(tmp_path):
    version, sources = _core.build.split()
    assert version == debulk.__version__
    (tmp_path / "core_sources.txt").write_text(f'"{sources}"\n')  # as CMake installs it
    build.check_core(_core.build, version, tmp_path)
    for core, python in ((f"{version} {15 * '0'}1", version), (_core.build, "0.0.1"), ("unknown", version)):
        with pytest.raises(ImportError, match="install the whole package again"):
            build.check_core(core, python, tmp_path)
    (tmp_path / "core_sources.txt").unlink()
    with pytest.raises(ImportError, match=r"Python files are build .* unknown "):
        build.check_core(_core.build, version, tmp_path)
