"""Inputs that a fuzzer found to end in anything but a result or an InputError (`make fuzz`), replayed."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).resolve().parents[1] / "fuzz"
sys.path.insert(0, str(FUZZ))

from targets import TARGETS, one_input  # noqa: E402

FOUND = sorted(path for path in (FUZZ / "found").rglob("*") if path.is_file() and path.name != ".gitkeep")


@pytest.mark.parametrize("path", FOUND, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_what_was_found_is_a_result_or_an_error(path: Path) -> None:
    one_input(path.parent.name, path.read_bytes())


@pytest.mark.parametrize("target", TARGETS)
def test_an_empty_file_is_refused(target: str) -> None:
    for ending in range(len(TARGETS[target][0])):
        accepted = one_input(target, bytes([ending]))
        assert accepted == (target == "recipe"), f"{target}, ending {ending}"
