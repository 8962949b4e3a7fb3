"""How far a verdict can be trusted: python bench/trust/trust.py [--scenes 2000] [--seed 0] [--jobs 1] [--out FOLDER].

The scenes are random virtual layups of both families, every second one spoiled by a random mistake. Each is inspected
in a process of its own with limits on time and memory. The outcomes are added to a CSV under build/trust whose name
depends on the package's contents, so that an interrupted run continues where it ended and never mixes two states of the
code. trust.txt and trust.png are made from it at the end. `--case N` runs one case and prints its outcome.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import multiprocessing
import resource
import signal
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, fields
from multiprocessing.connection import Connection
from pathlib import Path

from cases import Case, Outcome, draw, run

import debulk

CPU_LIMIT_S = 30  # making the layup and its truth takes 3 to 5 s of this, a right inspection 1 to 3
WALL_LIMIT_S = 900  # even a machine that others use is not slower than this
MEMORY_LIMIT = 8 << 30


def work(number: int, seed: int, pixels: tuple[int, int], answer: Connection) -> None:
    """Run a case within limits of time and memory; past the limit of CPU time the kernel ends this process."""
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT_S, CPU_LIMIT_S + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answer.send(run(draw(number, seed), pixels))


def in_process(case: Case, pixels: tuple[int, int]) -> Outcome:
    """Run a case in a process of its own, forked from one that has imported everything."""
    context = multiprocessing.get_context("forkserver")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(case.number, case.seed, pixels, there))
    process.start()
    there.close()
    try:
        if here.poll(WALL_LIMIT_S):
            return here.recv()
        process.kill()
        return _lost(case, "hang", f"more than {WALL_LIMIT_S} s")
    except EOFError:  # the process ended without an answer
        process.join()
        if process.exitcode in (-signal.SIGXCPU, -signal.SIGKILL):
            return _lost(case, "hang", f"more than {CPU_LIMIT_S} s of CPU time")
        return _lost(case, "crash", f"exit code {process.exitcode}")
    finally:
        process.join()


def _lost(case: Case, said: str, reason: str) -> Outcome:
    mistake = "" if case.mistake is None else case.mistake.name
    blind = case.mistake is not None and case.mistake.blind
    nan = float("nan")
    return Outcome(
        case.number,
        case.family,
        case.layup_seed,
        mistake,
        "",
        "",
        said,
        reason,
        False,
        nan,
        "",
        nan,
        False,
        blind,
        0,
        0,
        "",
        nan,
    )


def fingerprint() -> str:
    """Return eight digits that change with any file of the package."""
    folder = Path(debulk.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(p for p in folder.rglob("*") if p.suffix in (".py", ".so")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:8]


def read(path: Path) -> list[Outcome]:
    """Return the outcomes in the CSV of an earlier run; none if there is no such file."""
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
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder of trust.txt and trust.png")
    parser.add_argument("--work", type=Path, default=Path("build/trust"), help="folder of the CSV")
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    if args.case is not None:
        for name, value in asdict(run(draw(args.case, args.seed), (width, height))).items():
            print(f"{name:>14} {value}")
        return
    args.work.mkdir(parents=True, exist_ok=True)
    path = args.work / f"trust-{args.pixels}-{args.seed}-{fingerprint()}.csv"
    done = {o.number for o in read(path)}
    new = not done
    todo = [draw(n, args.seed) for n in range(args.scenes) if n not in done]
    multiprocessing.get_context("forkserver").set_forkserver_preload(["cases", "debulk.inspection"])
    with path.open("a", newline="") as file, ThreadPoolExecutor(args.jobs) as pool:
        writer = csv.DictWriter(file, [f.name for f in fields(Outcome)], lineterminator="\n")
        if new:
            writer.writeheader()
            file.flush()
        for future in as_completed([pool.submit(in_process, case, (width, height)) for case in todo]):
            writer.writerow(asdict(future.result()))
            file.flush()
    from summary import picture, text

    args.out.mkdir(parents=True, exist_ok=True)
    outcomes = sorted(read(path), key=lambda o: o.number)[: args.scenes]
    said = text(outcomes, args.seed, args.pixels)
    (args.out / "trust.txt").write_text(said)
    picture(outcomes, args.out / "trust.png")
    print(said)


if __name__ == "__main__":
    main()
