"""docs/hazards.md: every check stands there, with tests that exist; `make protocol` runs just these."""

from __future__ import annotations

import re
from pathlib import Path

from debulk.results.check_texts import CHECK_TEXTS as CHECKS

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/hazards.md").read_text()
DETECTED, ASSUMED = PAGE.split("## Assumptions that nothing here checks")


def test_every_check_is_named_with_verdicts_that_it_allows() -> None:
    at_best = {check.name: {v.name for v in check.at_best if v} for check in CHECKS}
    named = set()
    for row in (line.split("|") for line in DETECTED.splitlines() if "::" in line):
        checks = set(re.findall(r"`(\w+)`", row[2])) & set(at_best)
        named |= checks
        if checks:
            assert set(re.findall("INVALID|CREASE|UNDECIDED", row[3])) <= set().union(*map(at_best.get, checks)), row[1]
    assert named == set(at_best)


def test_every_row_names_a_test_that_is_there() -> None:
    cited = re.findall(r"`(test_\w+\.py)::(test_\w+)`", DETECTED)
    assert len(cited) >= len(CHECKS)
    for name, test in cited:
        files = (ROOT / "tests" / "python").rglob(name)
        assert sum(f"def {test}(" in path.read_text() for path in files) == 1, f"{name} has no {test}"
