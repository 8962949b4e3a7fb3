"""Time a cell's second cycle, which overlaps with the first: from the last fringe image to the verdict.

    .venv/bin/python bench/front/pipeline.py [--cycles 3000] [--busy 8] [--images FOLDER] [--captures FOLDER]

Virtual cameras see a layup of 20 megapixels in three exposures. All images but the last pair are handed over once,
before the clock starts; each cycle hands over the last pair, and ends with the verdict. This is repeated alone, beside
busy programs, and beside these with the priority that a cell would give it (round robin in real time, which needs root
or the right CAP_SYS_NICE; of the cycles at equal rights a tenth is enough). That a share of 0.999 of the cycles takes
less than some time is shown, with 95 % confidence, by 2995 cycles of which none takes longer; with fewer the text says
what they show. Ctrl-C ends a series early, and what there is by then is written.

Making the images takes some minutes and 6 GB of memory; --images names a folder that keeps them (2.8 GB) for the next
time. The text also says how long the next ply's inspector takes beside the drape (`Stack.lay_ahead`), and, with the
folder of the real captures (shared/data/two_frequency_fringes), what is left after their last image.
"""

import argparse
import contextlib
import itertools
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import debulk
from debulk import scanner

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scanner"))
from real import camera

from debulk.scanner.triangulate import empty_cloud

LIMIT_S = 1.0
CONFIDENCE = 0.95


@contextlib.contextmanager
def busy(count):
    """Keep so many programs busy while the body runs."""
    programs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


@contextlib.contextmanager
def preferred():
    """Run all threads of this process, and those that they start, before every usual program's; yield what was done."""
    threads = [int(name) for name in os.listdir("/proc/self/task")]
    try:
        for thread in threads:
            os.sched_setscheduler(thread, os.SCHED_RR, os.sched_param(1))
    except PermissionError:
        yield "at equal rights, for another priority was not allowed"
        return
    try:
        yield "in real time"
    finally:
        for thread in threads:
            with contextlib.suppress(ProcessLookupError):
                os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))


def made(folder, layup, pixels):
    """Render the images of the mold and of the layup into a folder, unless they are there."""
    for name, bare in (("mold", True), ("layup", False)):
        if (folder / f"{name}.npy").exists():
            continue
        images = debulk.scenes.fringe_images(layup, pixels=pixels, bare=bare)
        images.calibration.save(folder / "calibration.json")
        np.save(folder / "pose.npy", images.mold_from_scanner)
        np.save(folder / "unfinished.npy", np.stack([images.left, images.right]))
        (folder / "unfinished.npy").rename(folder / f"{name}.npy")
        images = None


def handed_over(instrument, left, right):
    """Return a scan for which all images have arrived but the last pair."""
    arriving = instrument.arriving(exposures=len(left))
    pairs = itertools.chain.from_iterable(zip(*both, strict=True) for both in zip(left, right, strict=True))
    for pair in itertools.islice(pairs, arriving.missing - 1):
        arriving.add(*pair)
    return arriving


def after_last(arriving, left, right, out=None):
    """Return the cloud, and the seconds and the processor seconds from the last pair of images to it.

    The last pair is then taken back, so that the next cycle need not hand over the others again.
    """
    began, used = time.perf_counter(), time.process_time()
    arriving.add(left[-1][-1], right[-1][-1])
    scan = arriving.cloud(out=out)
    took = time.perf_counter() - began, time.process_time() - used
    for one in arriving._cameras:
        one.images.pop(), one.marks.pop()
    return scan, *took


def series(instrument, inspector, left, right, cycles):
    """Return the seconds to the cloud, to the verdict, and of processor time for each cycle, and the last report."""
    took, report = [], None
    out = empty_cloud(instrument.calibration)
    arriving = handed_over(instrument, left, right)
    after_last(arriving, left, right, out)  # its memory's first touch is not the cell's
    with contextlib.suppress(KeyboardInterrupt):
        for _ in range(cycles):
            scan, cloud_s, cloud_cpu_s = after_last(arriving, left, right, out)
            began, used = time.perf_counter(), time.process_time()
            report = inspector.inspect(scan.points_mm)
            inspect_s, inspect_cpu_s = time.perf_counter() - began, time.process_time() - used
            took.append((cloud_s, cloud_s + inspect_s, cloud_cpu_s + inspect_cpu_s))
    return np.array(took), report


def said(took):
    """Return what a series of seconds shows."""
    cloud, verdict, processor = took.T
    late, n = int((verdict > LIMIT_S).sum()), len(verdict)
    text = (
        f"{n} cycles: to the cloud {np.median(cloud):.2f} s, to the verdict {np.median(verdict):.2f} s in the median "
        f"({np.median(processor):.2f} s of processor time), {verdict.min():.2f} s at best, {verdict.max():.2f} s at "
        f"most; {late} took more than {LIMIT_S:g} s"
    )
    if n >= 1000:
        text += f"; 99.9 % took less than {np.quantile(verdict, 0.999, method='higher'):.2f} s"
    if late == 0:
        share = (1 - CONFIDENCE) ** (1 / n)
        text += f": with {100 * CONFIDENCE:g} % confidence at least {100 * share:.2f} % take less"
    return text


def next_ply(reference, layup, pose):
    """Return how long it takes to lay a ply ahead, and until its inspector is there."""
    with debulk.Stack(None, reference, mold_from_scanner=pose) as stack:
        began, used = time.perf_counter(), time.process_time()
        stack.lay_ahead(layup.ply_outline)
        laid = time.perf_counter() - began
        stack._ahead._thread.join()
        ready, processor = time.perf_counter() - began, time.process_time() - used
    return (
        f"the next ply's inspector: lay_ahead() returns after {1e3 * laid:.1f} ms, the inspector is there after "
        f"{ready:.2f} s, {processor:.2f} s of processor time"
    )


def captured(folder):
    """Return what is left after the last image of the real captures, with lenses that give depths without a unit."""
    left, right = (camera(folder, c) for c in (0, 1))
    height, width = left[0].shape
    matrix = [[1800.0, 0, (width - 1) / 2], [0, 1800.0, (height - 1) / 2], [0, 0, 1]]
    lenses = scanner.Calibration([matrix, matrix], np.zeros((2, 5)), np.eye(3), (-200.0, 0, 0), (width, height))
    instrument = scanner.Scanner(lenses, (40, 41), 8)
    took = [after_last(handed_over(instrument, [left], [right]), [left], [right])[1:] for _ in range(20)]
    wall, processor = np.median(took, axis=0)
    return (
        f"real captures, {width} x {height} pixels, 16 images of each camera: from the last image to the cloud "
        f"{wall:.2f} s in the median of {len(took)}, {processor:.2f} s of processor time"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pixels", default="5120x3840")
    parser.add_argument("--cycles", type=int, default=3000)
    parser.add_argument("--busy", type=int, default=8)
    parser.add_argument("--images", type=Path)
    parser.add_argument("--captures", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).with_suffix(".txt"))
    given = parser.parse_args()
    pixels = tuple(int(n) for n in given.pixels.split("x"))

    lines = []

    def say(line):
        print(line, flush=True)
        lines.append(line)

    say(
        f"From the last fringe image to the verdict, {given.pixels} pixels, 2 x 12 images of 3 exposures, "
        f"{debulk._core.default_threads()} threads"
    )
    if given.captures is not None:
        say(captured(given.captures))
    layup = debulk.scenes.layup(seed=3, pixels=(1280, 960))
    with contextlib.ExitStack() as ended:
        folder = given.images or Path(ended.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        made(folder, layup, pixels)
        instrument = scanner.Scanner(scanner.Calibration.load(folder / "calibration.json"))
        reference = instrument.scan(*np.load(folder / "mold.npy"))
        pose = np.load(folder / "pose.npy")
        left, right = np.load(folder / "layup.npy")
    for count in (0, given.busy):
        with busy(count):
            say(f"{count} busy programs beside it: {next_ply(reference.points_mm, layup, pose)}")
    inspector = debulk.Inspector(
        None, reference.points_mm, layup.ply_outline, mold_from_scanner=pose, camera=reference.camera
    )
    whole = instrument.scan(left, right).points_mm
    began = time.perf_counter()
    instrument.scan(left, right)
    say(f"all images decoded after the last one: {time.perf_counter() - began:.2f} s to the cloud")
    arriving = handed_over(instrument, left, right)
    same = after_last(arriving, left, right)[0].points_mm.tobytes() == whole.tobytes()
    arriving = whole = None
    say(f"decoded while they arrive: {'the same bits' if same else 'OTHER BITS'}")
    few = max(1, given.cycles // 10)
    rights = contextlib.nullcontext("at equal rights")
    for count, cycles, right_of in (
        (0, given.cycles, rights),
        (given.busy, few, rights),
        (given.busy, given.cycles, preferred()),
    ):
        before = os.getloadavg()[0]
        with busy(count), right_of as how:
            took, report = series(instrument, inspector, left, right, cycles)
        say(f"{count} busy programs beside it, {how} (load before: {before:.1f}), {said(took)}")
        say(f"  {report.verdict.name}, {len(report.pockets)} pockets: {report.reason}")
        given.output.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
