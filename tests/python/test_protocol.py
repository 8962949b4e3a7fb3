"""`make protocol`: which outcomes show something, and which total a count belongs to."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

pytest.importorskip("markdown_it")
PROGRAM = runpy.run_path(str(Path(__file__).resolve().parents[2] / "bench" / "protocol" / "protocol.py"))


@pytest.mark.parametrize(
    ("what", "figure", "interval"),
    [
        ("plies that pass, of 84 of the open benchmark", "0", "0 to 4.3 %"),
        ("false CEASE among 102 pockets", "0", "0 to 3.55 %"),
        ("the same, of 27 that are judged among 30", "27", "87.2 to 100 %"),
        ("records that writers lost, of 3 525", "0", "0 to 0.105 %"),
        ("largest of 120", "27 ms", ""),
        ("false CEASE among the same", "0", ""),
    ],
)
def test_a_count_has_the_interval_of_its_own_total(what: str, figure: str, interval: str) -> None:
    assert PROGRAM["interval"](what, figure) == interval


@pytest.mark.parametrize(
    ("result", "shows"),
    [("3 passed", True), ("1 passed, 2 skipped", True), ("2 skipped", False), ("1 failure, 2 passed", False)],
)
def test_a_test_that_was_skipped_shows_nothing(result: str, shows: bool) -> None:
    assert PROGRAM["shows"](result) is shows
    assert PROGRAM["shows"]("not run") is PROGRAM["shows"]("1 error, 1 passed") is False


def test_a_page_stands_alone_and_names_break_between_words() -> None:
    page = PROGRAM["html"]("[Verdicts](docs/verdicts.md)\n\n| a |\n|---|\n| `test_a.py::test_b` |\n")
    assert "href" not in page and "<p>Verdicts</p>" in page
    assert "<code>test_<wbr>a.py::<wbr>test_<wbr>b</code>" in page
    assert page.count('<div class="scroll"><table>') == page.count("</table></div>") == 1
