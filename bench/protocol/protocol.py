"""The validation protocol of this build, as one page: python bench/protocol/protocol.py [--out build/protocol.html].

The page says which build it is, on which machine; runs every test that docs/hazards.md names, and gives each result;
runs the self test; and repeats the figures of docs/figures.md with exact 95 % intervals where they are counts, and with
the number of commits to the package since each was recorded. An auditor repeats it by the same command.
"""

from __future__ import annotations

import argparse
import platform
import re
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

from markdown_it import MarkdownIt

import debulk
from debulk.build import build_id
from debulk.comparison import agreement
from debulk.doctor import self_test

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ("python", "cpp")
STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem }
table { border-collapse: collapse; width: 100%; margin: 1rem 0 } th { text-align: left }
td, th { border-bottom: 1px solid #bbb; padding: .25rem .5rem; vertical-align: top }
code { font-size: 90%; overflow-wrap: break-word } tr { break-inside: avoid } .scroll { overflow-x: auto }
@media print {
  body { font-size: 9pt; margin: 0; max-width: none } .scroll { overflow: visible } @page { size: A4; margin: 15mm }
}
"""


def rows_of(page: str, heading: str) -> list[list[str]]:
    """Return the cells of the first table after a heading; without one, of the page's first table."""
    table = re.search(r"^\|.*?(?=\n\n|\Z)", page[page.find(heading) :], re.MULTILINE | re.DOTALL)
    lines = table[0].splitlines()[2:] if table else []
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def outcomes(cited: set[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """Run the cited tests, and return by file and name whether they passed, failed, or were skipped."""
    files = sorted((ROOT / "tests" / "python").rglob("test_*.py"))
    asked = [f"{p}::{t}" for p in files for f, t in sorted(cited) if f == p.name and f"def {t}(" in p.read_text()]
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "tests.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-n", "2", f"--junitxml={result}", *asked]
        subprocess.run(command, cwd=ROOT, check=False)
        cases = ElementTree.parse(result).iter("testcase")
        said: dict[tuple[str, str], list[str]] = {}
        for case in cases:
            worst = next((kind for kind in ("failure", "error", "skipped") if case.find(kind) is not None), "passed")
            file, name = case.get("classname", "").split(".")[-1] + ".py", case.get("name", "").split("[")[0]
            said.setdefault((file, name), []).append(worst)
    return {key: ", ".join(f"{kinds.count(k)} {k}" for k in sorted(set(kinds))) for key, kinds in said.items()}


def hazards() -> list[str]:
    """Return the table of the hazards with the results of their tests."""
    rows = rows_of((ROOT / "docs/hazards.md").read_text(), "## Hazards that are detected")
    cited = {row[3]: re.findall(r"(test_\w+\.py)::(test_\w+)", row[3]) for row in rows}
    said = outcomes({test for tests in cited.values() for test in tests})
    lines = ["| hazard | noticed by | verdict | test | result |", "|---|---|---|---|---|"]
    for row in rows:
        results = [said.get(test, "not run") for test in cited[row[3]]]
        told = "; ".join(one if shows(one) else f"**{one}**" for one in results)
        lines.append(f"| {' | '.join(row)} | {told} |")
    return lines


def shows(result: str) -> bool:
    """Return whether a test's outcomes show anything: it ran, and nothing failed; skipped, it shows nothing."""
    return "passed" in result and "failure" not in result and "error" not in result


def interval(what: str, figure: str) -> str:
    """Return the exact 95 % interval of a count "of N"; empty for any other figure."""
    totals = [n for word in ("among", "of") for n in re.findall(rf"\b{word} (?:the )?(\d[\d ]*)(?![\d.])", what)]
    if not totals or not re.fullmatch(r"[\d ]+", figure):
        return ""
    many, count = (int(number.replace(" ", "")) for number in (totals[-1], figure))
    if count > many:
        return ""
    rate = agreement(count, many)
    return f"{100 * rate.low:.3g} to {100 * rate.high:.3g} %"


def since(commit: str) -> str:
    """Return how many commits have changed the package since one."""
    if not re.fullmatch(r"[0-9a-f]{7,}", commit):
        return commit
    ran = subprocess.run(
        ["git", "rev-list", "--count", f"{commit}..HEAD", "--", *PACKAGE],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return f"{commit}, {ran.stdout.strip()} commits to the package since" if ran.returncode == 0 else commit


def figures() -> list[str]:
    """Return what was measured, subject by subject, each figure with its interval and its age."""
    about, *subjects = (ROOT / "docs/figures.md").read_text().split("\n## ")
    lines = [about.partition("\n")[2]]
    for subject in subjects:
        heading, _, text = subject.partition("\n")
        lines += [f"\n### {heading}\n", text.partition("\n|")[0], ""]
        lines += ["| what | figure | 95 % interval | command | result | recorded in |", "|---|---|---|---|---|---|"]
        for what, figure, command, result, commit in rows_of(subject, ""):
            lines.append(f"| {what} | {figure} | {interval(what, figure)} | {command} | {result} | {since(commit)} |")
    return lines


def html(text: str) -> str:
    """Return the page: tables that are too wide for a screen move by themselves, and names break between words."""
    text = re.sub(r"\]\((?!http)[^)]*\)", "]", text)  # it stands alone: no links to the documentation
    text = re.sub(r"\[([^\]]*)\](?!\()", r"\1", text)
    body = MarkdownIt().enable("table").render(text)
    body = body.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")
    body = re.sub(r"<code>[^<]*", lambda name: re.sub(r"(::|[_/])", r"\1<wbr>", name[0]), body)
    title = f"<title>debulk {debulk.__version__}: validation protocol</title>"
    view = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    return f'<!doctype html><html lang="en"><meta charset="utf-8">{view}{title}<style>{STYLE}</style>{body}</html>'


def protocol() -> str:
    """Run what is to be run, and return the page as Markdown."""
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.strip()
    now = datetime.now(UTC).isoformat(timespec="seconds")
    assumed = rows_of((ROOT / "docs/hazards.md").read_text(), "## Assumptions")
    tests = [f"| {one.name} | {'passed' if one.passed else '**failed**'} | {one.detail} |" for one in self_test()]
    return "\n".join(
        [
            f"# Validation protocol of debulk {debulk.__version__}",
            f"Build `{build_id()}`, commit `{commit}`, CPython {platform.python_version()}, {platform.machine()}, "
            f"{platform.system()}; made {now} by `make protocol`. No figure on this page is of a real layup.",
            "\n## Self test\n", "| what | result | figures |", "|---|---|---|", *tests,
            "\n## Hazards, and the tests that show how each is detected\n", *hazards(),
            "\n## Assumptions that nothing checks\n", "| assumption | if it is wrong | what to do |", "|---|---|---|",
            *(f"| {' | '.join(row)} |" for row in assumed),
            "\n## What was measured\n",
            "Counts have the exact 95 % interval of their rate (Clopper and Pearson 1934). A figure that is older than "
            "the build says by how many commits to the package; its command measures it again.\n", *figures(),
            "\n## Signature\n", "| read by | date | signature |", "|---|---|---|", "| &nbsp; | | |",
        ]
    )  # fmt: skip


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "protocol.html")
    args = parser.parse_args()
    text = protocol()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_text(html(text))
    print(args.out)
    if re.search(r"^\|.*\*\*", text, re.MULTILINE):
        sys.exit("debulk: a test failed or was not run; see the page")


if __name__ == "__main__":
    main()
