"""How far a verdict can be trusted: python bench/trust/trust.py [--scenes 2000] [--seed 0] [--jobs 2] [--out bench/trust].

Random scenes of both families of virtual layups, every second one spoiled by a random mistake, each inspected in a
process of its own with limits on time and memory. Cases are added to trust.csv, so a run that was ended goes on where
it was; trust.txt and trust.png are made from it at the end. `--case N` does one case and prints what became of it.
"""

from __future__ import annotations

import argparse
import csv
import json
import resource
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, fields
from pathlib import Path

from cases import Case, Outcome, draw, run

CPU_LIMIT_S = 60  # making the layup and its truth takes 3 to 5 s of it
WALL_LIMIT_S = 900  # a machine that others use may be slow, but not that slow
MEMORY_LIMIT = 8 << 30


def limited() -> None:
    """Limit the time and memory of this process; past the CPU limit the kernel ends it."""
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT_S, CPU_LIMIT_S + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def in_process(case: Case, pixels: tuple[int, int]) -> Outcome:
    """Run a case in a process of its own."""
    size = f"{pixels[0]}x{pixels[1]}"
    command = [sys.executable, __file__, "--seed", str(case.seed), "--case", str(case.number), "--pixels", size, "--json"]
    try:
        ended = subprocess.run(
            command, capture_output=True, text=True, timeout=WALL_LIMIT_S, preexec_fn=limited, check=False
        )
    except subprocess.TimeoutExpired:
        return _lost(case, "hang", f"more than {WALL_LIMIT_S} s")
    if ended.returncode == 0:
        return Outcome(**json.loads(ended.stdout.splitlines()[-1]))
    if ended.returncode in (-24, -9):  # SIGXCPU, and SIGKILL after it
        return _lost(case, "hang", f"more than {CPU_LIMIT_S} s of CPU time")
    last = (ended.stderr.strip().splitlines() or [""])[-1]
    return _lost(case, "crash", f"exit code {ended.returncode}: {last}"[:300])


def _lost(case: Case, said: str, reason: str) -> Outcome:
    mistake = "" if case.mistake is None else case.mistake.name
    blind = case.mistake is not None and case.mistake.blind
    nan = float("nan")
    return Outcome(
        case.number, case.family, case.layup_seed, mistake, "", "", said, reason, False, nan, "", False, blind, 0, 0, nan
    )


def read(path: Path) -> list[Outcome]:
    """Outcomes of a CSV that `write` began."""
    if not path.exists():
        return []
    kinds = {f.name: f.type for f in fields(Outcome)}
    parse = {"int": int, "float": float, "str": str, "bool": lambda text: text == "True"}
    with path.open(newline="") as file:
        return [Outcome(**{k: parse[str(kinds[k])](v) for k, v in row.items()}) for row in csv.DictReader(file)]


def main() -> None:
    """Run the cases that are missing, then write the summary."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--pixels", default="1280x960")
    parser.add_argument("--case", type=int, help="do only this case, and print what became of it")
    parser.add_argument("--json", action="store_true", help="with --case: as one line of JSON")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    if args.case is not None:
        outcome = run(draw(args.case, args.seed), (width, height))
        if args.json:
            print(json.dumps(asdict(outcome)))
        else:
            for name, value in asdict(outcome).items():
                print(f"{name:>14} {value}")
        return
    path = args.out / "trust.csv"
    done = {o.number for o in read(path)}
    new = not done
    todo = [draw(n, args.seed) for n in range(args.scenes) if n not in done]
    with path.open("a", newline="") as file, ThreadPoolExecutor(args.jobs) as pool:
        writer = csv.DictWriter(file, [f.name for f in fields(Outcome)], lineterminator="\n")
        if new:
            writer.writeheader()
        for future in as_completed([pool.submit(in_process, case, (width, height)) for case in todo]):
            writer.writerow(asdict(future.result()))
            file.flush()
    from summary import picture, text

    outcomes = sorted(read(path), key=lambda o: o.number)[: args.scenes]
    said = text(outcomes, args.seed, args.pixels)
    (args.out / "trust.txt").write_text(said)
    picture(outcomes, args.out / "trust.png")
    print(said)


if __name__ == "__main__":
    main()
