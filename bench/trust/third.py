"""Inspect a third family of layups: python bench/trust/third.py [--scenes 1000] [--first 0] [--out FILE] [--case N].

The family is `lab.third`, written from the laws of the model without a look at the other two. False CEASE: fibres that
are held at both ends make a ridge above the limit. False alarm: INVALID on a right layup. Outcomes are kept in a CSV
under build/trust as they come, and scenes that stand in it are not inspected again.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import debulk
from lab.third.scene import CLASSES, RIGHT, Scene, scene

LIMIT_MM = 0.6
FIELDS = ("case", "kind", "mold", "what", "thickness_mm", "held_mm", "any_mm", "verdict", "check", "named", "cpu_s",
          "reason")  # fmt: skip
VERDICTS = ("cease", "crease", "undecided", "invalid", "refused")


def inspected(given: Scene) -> debulk.Report:
    """Inspect a scene with the ply's thickness and the recipe's other defaults."""
    recipe = debulk.Recipe(material={"thickness_mm": given.thickness_mm})
    angles = (given.fibre_deg, given.fibre_deg + 90)
    return debulk.inspect(given.scan, given.reference, recipe, given.outline, angles, given.mold_from_scanner)


def outcome(number: int) -> dict[str, str]:
    """Return a row for the scene of this number."""
    given = scene(number)
    began, check, named = time.process_time(), "", ""
    try:
        report = inspected(given)
        verdict, reason = report.verdict.value, report.reason
        named = " ".join(f.check for f in report.findings if f.check == "reference_humps")
        check = next((f.check for f in report.findings if f.at_best is report.verdict), "")
    except debulk.InputError as error:
        verdict, reason = "refused", str(error)
    cpu_s = f"{time.process_time() - began:.2f}"
    held_mm, any_mm = f"{given.truth.held_mm:.2f}", f"{given.truth.any_mm:.2f}"
    values = (number, given.kind, given.mold, given.what, given.thickness_mm, held_mm, any_mm, verdict, check, named,
              cpu_s, " ".join(reason.split()))  # fmt: skip
    return dict(zip(FIELDS, map(str, values), strict=True))


def false_cease(row: dict[str, str]) -> bool:
    """Return whether a layup passed whose held fibres make a ridge above the limit, and no hump below it was named."""
    return row["verdict"] == "cease" and float(row["held_mm"]) > LIMIT_MM and not row["named"]


def false_alarm(row: dict[str, str]) -> bool:
    """Return whether a layup without a mistake was INVALID or refused."""
    return row["kind"] in RIGHT and row["verdict"] in ("invalid", "refused")


def table(rows: list[dict[str, str]]) -> str:
    """Return the table by class, and every outcome that is wrong."""
    right = [row for row in rows if row["kind"] in RIGHT]
    wrong = [row for row in rows if false_cease(row)]
    alarms = [row for row in rows if false_alarm(row)]
    hinted = sum(false_cease(row | {"named": ""}) for row in rows) - len(wrong)
    needless = [row for row in right if row["verdict"] == "crease" and float(row["any_mm"]) < LIMIT_MM]
    numbers = [int(row["case"]) for row in rows]
    seconds, share = sum(float(row["cpu_s"]) for row in rows), 100 * len(alarms) / max(len(right), 1)
    lines = [
        f"A third family of layups (lab.third), debulk {debulk.__version__}: {len(rows)} scenes of seed 33, numbers "
        f"between {min(numbers)} and {max(numbers)}, inspected in {seconds:.0f} s of processor time",
        "",
        f"false CEASE (ridge of held fibres above {LIMIT_MM:.2f} mm): {len(wrong)}; "
        f"with the reference's hump named: {hinted}",
        f"INVALID or refused although right: {len(alarms)} of {len(right)} ({share:.1f} %)",
        f"CREASE although right and below the limit: {len(needless)}",
        "",
        _row("class", "scenes", VERDICTS, "false CEASE", "false INVALID"),
    ]
    for kind in CLASSES:
        own = [row for row in rows if row["kind"] == kind]
        counts = Counter(row["verdict"] for row in own)
        found = [str(counts[verdict] or "-") for verdict in VERDICTS]
        lines.append(_row(kind, len(own), found, sum(map(false_cease, own)), sum(map(false_alarm, own))))
    for title, some in (("false CEASE", wrong), ("false INVALID", alarms), ("false CREASE", needless)):
        lines += ["", f"{title}: case, class, mold, t, ridge of held fibres and of all, reason"] if some else []
        for row in some:
            facts = ", ".join(row[name] for name in ("kind", "mold", "what", "thickness_mm", "held_mm", "any_mm"))
            lines.append(f"  {row['case']:>5} {facts}: {row['reason']}"[:230])
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _row(name: str, scenes: object, verdicts: Sequence[str], *wrong: object) -> str:
    return (
        f"{name:26}{scenes:>8}" + "".join(f"{one:>11}" for one in verdicts) + "".join(f"{n or '-':>15}" for n in wrong)
    )


@contextmanager
def kept(path: Path, fields: Sequence[str]) -> Iterator[tuple[list[dict[str, str]], Callable[[dict[str, str]], None]]]:
    """Open a CSV of outcomes for more: its rows, and what adds one to them and to the file at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = []
    if path.exists():
        with path.open(newline="") as known:
            rows = list(csv.DictReader(known))
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, fields)
        if not rows:
            writer.writeheader()

        def keep(row: dict[str, str]) -> None:
            rows.append(row)
            writer.writerow(row)
            file.flush()

        yield rows, keep


def main() -> None:
    """Inspect the scenes that are missing, and print the table of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kept", type=Path, default=Path("build/trust/third.csv"))
    parser.add_argument("--out", type=Path)
    parser.add_argument("--case", type=int, help="inspect one scene, and print its outcome")
    args = parser.parse_args()
    if args.case is not None:
        print("\n".join(f"{name:14}{value}" for name, value in outcome(args.case).items()))
        return
    with kept(args.kept, FIELDS) as (rows, keep):
        done = {int(row["case"]) for row in rows}
        for number in range(args.first, args.first + args.scenes):
            if number not in done:
                keep(outcome(number))
    text = table(sorted(rows, key=lambda row: int(row["case"])))
    print(text, end="")
    if args.out:
        args.out.write_text(text)


if __name__ == "__main__":
    main()
