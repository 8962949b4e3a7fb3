"""Time the whole Python cycle on a virtual layup, stage by stage: cycle.py SCENES OUTPUT [WIDTH HEIGHT] [CYCLES].

The scenes are written by make_scene.py. The one in SCENES/paper has the paper's pitch; there the mold fills only part
of the image. Wall times are those of the best cycle. The processor time of a cycle, over all threads, divided by the
number of threads is the least time that a quiet machine would take. Writes cycle.txt and cycle.svg.
"""

import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import debulk
from debulk.inspection.clouds import fingerprint
from debulk.inspection.reference import prepared
from debulk.inspection.running.cycle import Cycle

COLOURS = (
    "#4c72b0", "#55a868", "#c44e52", "#8172b2", "#ccb974", "#64b5cd", "#8c8c8c", "#dd8452", "#222222", "#da8bc3",
    "#b07aa1", "#bcbd22", "#7f3b08", "#556b2f",
)  # fmt: skip


def load(stem: str, width: int, height: int):
    """Return the scan, reference, pose and outline of a scene."""
    scan, reference = (
        np.fromfile(f"{stem}.{kind}", np.float32).reshape(height, width, 3) for kind in ("scan", "reference")
    )
    return scan, reference, np.loadtxt(f"{stem}.view")[:16].reshape(4, 4), np.loadtxt(f"{stem}.outline")


def cycles(inspector, scan, count: int):
    """Return (wall ms, processor ms, stages) of the first cycle and of the best of the others, and the last report.

    Only the last report is kept, as by a cell: the next cycle then works in the memory of those before it.
    """
    took = []
    for _ in range(count + 1):
        wall, processor = time.perf_counter(), time.process_time()
        report = inspector.inspect(scan)
        ended = 1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - processor)
        took.append((*ended, report.timings_ms))
    return took[0], min(took[1:], key=lambda t: t[0]), report.as_decided()


def reading_ms(scan) -> float:
    """Return the limit set by memory: the time in which all threads read every byte of the cloud once; best of ten."""
    threads = debulk._core.default_threads()
    words = np.array_split(scan.reshape(-1).view(np.uint64), 8 * threads)
    best = np.inf
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(10):
            began = time.perf_counter()
            list(pool.map(np.bitwise_or.reduce, words))
            best = min(best, 1e3 * (time.perf_counter() - began))
    return best


def hashing_ms(scan, kind: fingerprint.Hash) -> float:
    """Return the processor time of the scan's fingerprint, computed during the inspection; the best of five."""
    best = np.inf
    for _ in range(5):
        began = time.process_time()
        fingerprint.of_cloud(scan, kind=kind)
        best = min(best, 1e3 * (time.process_time() - began))
    return best


def fibres_ms(inspector, scan) -> float:
    """Return the processor time in which the fibre lines are read over what was found in a scan; the best of ten."""
    found, best = inspector.find(scan), np.inf
    for _ in range(10):
        began = time.process_time()
        inspector.ply.fibres.over(*found.part, debulk._core.Stop(), whole=True, threads=0)
        best = min(best, 1e3 * (time.process_time() - began))
    return best


def next_reference(reference, outline, pose) -> list[str]:
    """Return lines with the time from a cloud to the inspector whose reference it is, step by step; the best of three.

    In a layup of several plies it passes between two of them. The cloud is read-only, so it is not copied. In a stack
    it has been cleaned already, by the comparison that let the ply pass.
    """
    below = np.array(reference)
    below.setflags(write=False)
    cleaned = prepared._cleaned(below, pose, None, None, debulk.Recipe(), Cycle())
    return [
        *_steps("the next reference, from its cloud to its inspector", below, outline, pose),
        *_steps("the next reference in a stack", cleaned, outline, pose),
    ]


def _steps(what: str, below, outline, pose) -> list[str]:
    def now() -> tuple[float, float]:
        return time.perf_counter(), time.process_time()

    best = None
    for _ in range(3):
        begins = {"": now()}
        debulk.Inspector(
            None,
            below,
            outline,
            mold_from_scanner=pose,
            progress=lambda name, _, begins=begins: begins.setdefault(name, now()),
        )
        steps = np.diff([*begins.values(), now()], axis=0)
        if best is None or steps[:, 0].sum() < best[1][:, 0].sum():
            best = (list(begins), steps)
    names, steps = best
    wall, processor = steps.sum(axis=0)
    return [
        f"  {what}: {wall:.2f} s, {processor:.2f} s of processor time",
        *(
            f"    {name:<18}{1e3 * wall:8.1f} ms, {1e3 * processor:6.1f} ms of processor time"
            for name, (wall, processor) in zip(names[1:], steps[1:], strict=True)
        ),
    ]


def latencies(inspector, scan, wall_ms: float, cancel: bool) -> list[float]:
    """Return the ms from cancel(), or from a deadline, to the end of inspect(), at moments spread over a cycle."""
    missed = []
    for share in np.linspace(0.05, 0.95, 10):
        after = 1e-3 * wall_ms * share
        if cancel:
            called = []

            def stop(called=called) -> None:
                called.append(time.perf_counter())
                inspector.cancel()

            timer = threading.Timer(after, stop)
            timer.start()
            try:
                inspector.inspect(scan)
            except debulk.Cancelled:
                missed.append(1e3 * (time.perf_counter() - called[0]))
            timer.join()
        else:
            began = time.perf_counter()
            inspector.inspect(scan, deadline_s=after)
            missed.append(max(0.0, 1e3 * (time.perf_counter() - began - after)))
    return missed


def bars(rows) -> str:
    """Return one bar per row, divided into its stages, as SVG."""
    scale = 600 / max(sum(stages.values()) for _, stages in rows)
    names = list(dict.fromkeys(name for _, stages in rows for name in stages))
    out, y = [], 20
    for title, stages in rows:
        x = 380.0
        out.append(f'<text x="370" y="{y + 18}" text-anchor="end">{title}</text>')
        for name, ms in stages.items():
            colour = COLOURS[names.index(name) % len(COLOURS)]
            out.append(f'<rect x="{x:.1f}" y="{y}" width="{scale * ms:.1f}" height="26" fill="{colour}"/>')
            x += scale * ms
        out.append(f'<text x="{x + 6:.1f}" y="{y + 18}">{sum(stages.values()):.0f} ms</text>')
        y += 40
    for k, name in enumerate(names):
        colour = COLOURS[k % len(COLOURS)]
        x, row = 380 + 160 * (k % 4), y + 10 + 22 * (k // 4)
        out.append(f'<rect x="{x}" y="{row}" width="12" height="12" fill="{colour}"/>')
        out.append(f'<text x="{x + 18}" y="{row + 11}">{name}</text>')
    height = y + 40 + 22 * (len(names) // 4)
    style = 'font-family="sans-serif" font-size="14" fill="#222"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="1080" height="{height}" viewBox="-40 0 1080 {height}" {style}>'
        + "".join(out)
        + "</svg>\n"
    )


FRONT = ("clean", "fill", "grid", "spikes", "median")


def case(title: str, stem: str, width: int, height: int, count: int):
    """Return lines and bars of one scene."""
    scan, reference, pose, outline = load(stem, width, height)
    began = time.perf_counter()
    usual = debulk.Inspector(None, reference, outline, mold_from_scanner=pose)
    lines = [title, f"  the first reference prepared in {time.perf_counter() - began:.1f} s, with all imports"]
    lines += next_reference(reference, outline, pose)

    def other(**sections: dict[str, object]) -> debulk.Inspector:
        return debulk.Inspector(debulk.Recipe(**sections), usual.prepared, outline, mold_from_scanner=pose)

    reading = reading_ms(scan)
    lines.append(f"  reading the cloud once, what memory allows: {reading:.1f} ms")
    for name, kind in (("XXH3", "xxh3"), ("SHA-256", "sha256")):
        hashing = hashing_ms(scan, kind)
        lines.append(f"  its {name}: {hashing:.0f} ms of processor time, {1e-6 * scan.nbytes / hashing:.2f} GB/s")
    lines.append("")
    rows = [(f"{title}: read", {"reading the cloud": reading})]
    for name, inspector in (
        ("cycle", usual),
        ("with every net and minimum", other(solve={"when": "always"})),
        ("with SHA-256", other(run={"hash_scan": "sha256"})),
    ):
        first, (wall, processor, stages), report = cycles(inspector, scan, count)
        front = sum(ms for stage, ms in stages.items() if stage in FRONT)
        lines.append(
            f"{name}: {wall:.0f} ms, {processor:.0f} ms of processor time, {len(report.pockets)} pockets; "
            f"the first cycle {first[0]:.0f} ms"
        )
        lines += [f"  {stage:<14}{ms:8.1f} ms" for stage, ms in stages.items()]
        lines.append(f"  front end: {front:.1f} ms, {front / reading:.1f} readings of the cloud")
        fibres = fibres_ms(inspector, scan)
        lines.append(
            f"  fibre lines: {fibres:.1f} ms of processor time, {100 * fibres / processor:.0f} % of the cycle's"
        )
        parts = {
            part: sum(p.runtime_split_ms.get(part, 0.0) for p in report.pockets) for part in ("net", "solve", "ridge")
        }
        lines.append("  in debulk, over its threads: " + ", ".join(f"{part} {ms:.0f} ms" for part, ms in parts.items()))
        took = [p.runtime_ms for p in report.pockets]
        lines.append(f"  judged without a solve: {sum(p.unsolved for p in report.pockets)} pockets")
        starts = max((p.solve.starts for p in report.pockets if p.solve), default=0)
        lines.append(
            f"  a pocket, from its net to its verdict: {np.median(took):.1f} ms median, {max(took):.1f} ms at most "
            f"(up to {starts} starts)"
        )
        for kind, cancel in (("cancel()", True), ("deadline", False)):
            late = latencies(inspector, scan, wall, cancel)
            if late:
                lines.append(f"  {kind} answered after {np.median(late):.0f} ms, {max(late):.0f} ms at most")
        lines.append("")
        rows.append((f"{title}: {name}", stages))
    return [*lines, ""], rows


def main() -> None:
    folder, output, *numbers = sys.argv[1:]
    width, height, count = (*map(int, numbers), *(5120, 3840, 5)[len(numbers) :])
    lines = [f"One inspection of {width} x {height} pixels, {debulk._core.default_threads()} threads", ""]
    rows = []
    for title, place in (("mold fills the image", folder), ("paper's pitch", f"{folder}/paper")):
        if not Path(f"{place}/{width}x{height}.view").exists():
            continue
        more_lines, more_rows = case(title, f"{place}/{width}x{height}", width, height, count)
        lines += more_lines
        rows += more_rows
    text = "\n".join(lines).rstrip() + "\n"
    print(text, end="")
    Path(output).mkdir(parents=True, exist_ok=True)
    Path(output, "cycle.txt").write_text(text)
    Path(output, "cycle.svg").write_text(bars(rows))


if __name__ == "__main__":
    main()
