"""Write front.txt and front.png from the front end's benchmark: report.py BENCH.json [OPEN3D.json]."""

import json
import sys
from pathlib import Path

STAGES = ("clean", "grid", "fill", "spikes", "median", "segment")
WHOLE_SCAN = "5120x3840"
HERE = Path(__file__).parent
PAPER = """\
The paper gives no times for scan, cleaning or segmentation; its model takes 13.5 s a pocket on average (5.7 to 47.5 s).
"""
LIMITS = """\
Times are the best of several cycles, in ms; "busy" is the processors' time divided by the two threads, which other
programs disturb less, "reads" busy over the time of reading the cloud once (what memory allows), "ns" busy for a point.
"memory" is what front end and segmentation keep, in sizes of the cloud: maps count for more where pixels are as coarse
as the grid.
"""


def main():
    measured = {b["name"].split("/")[1]: b for b in json.loads(Path(sys.argv[1]).read_text())["benchmarks"]}
    peer = json.loads(Path(sys.argv[2]).read_text()) if len(sys.argv) > 2 and Path(sys.argv[2]).exists() else None
    text = (
        table(measured)
        + "\n"
        + LIMITS
        + "\n"
        + short_cuts(measured)
        + "\n"
        + PAPER
        + (open3d(peer, measured) if peer else "")
    )
    (HERE / "front.txt").write_text(text)
    print(text)
    draw(measured)


def table(measured):
    head = f"{'image':<12}{'Mpx':>6}{'read':>8}" + "".join(f"{s:>9}" for s in STAGES)
    lines = [head + f"{'all':>9}{'busy':>8}{'reads':>7}{'ns':>7}{'memory':>8}{'pockets':>9}"]
    for name, b in measured.items():
        width, height = map(int, name.split("x"))
        lines.append(
            f"{name:<12}{width * height / 1e6:>6.1f}{b['read_ms']:>8.2f}"
            + "".join(f"{b[f'{s}_ms']:>9.2f}" for s in STAGES)
            + f"{b['best_ms']:>9.2f}{b['busy_ms']:>8.1f}{b['busy_ms'] / b['read_ms']:>7.1f}"
            + f"{b['busy_ms'] * 1e6 / width / height:>7.2f}{b['memory']:>8.2f}{b['pockets']:>9.0f}"
        )
    return "\n".join(lines) + "\n"


def short_cuts(measured):
    lines = ["Short cut: the four nearest of the pixels round a point, without a certificate (busy ms, decisions)"]
    for name, b in measured.items():
        lines.append(
            f"{name:<12} exact {b['certified_busy_ms']:7.1f}  short cut {b['window_busy_ms']:7.1f}"
            f"  wrong {b['window_wrong']:.0f} of {b['removed']:.0f} removed or missing"
        )
    return "\n".join(lines) + "\n"


def open3d(peer, measured):
    ours = measured.get(WHOLE_SCAN)
    clean = f"; ours {ours['clean_ms']:.0f} ms" if ours else ""
    return (
        f"\nOpen3D {peer['version']}, remove_statistical_outlier(nb_neighbors=5), {peer['points'] / 1e6:.1f} million"
        f" points: {peer['seconds']:.1f} s{clean}.\nOf its {peer['removed']} removed points and ours"
        f" {peer['different']} differ. It counts a point among its own neighbours,\nso that 5 of its are 4 of ours, and"
        " its mean and threshold are four fifths of ours; a point with four copies or more,\nat the distance 0, it"
        " removes, and we keep it.\n"
    )


def draw(measured):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), width_ratios=(1.25, 1))
    names = list(measured)
    bottom = [0.0] * len(names)
    for stage in STAGES:
        share = [
            measured[n][f"{stage}_ms"] * 1e6 / measured[n]["points"] if "points" in measured[n] else 0 for n in names
        ]
        left.bar(names, share, bottom=bottom, label=stage, width=0.7)
        bottom = [b + s for b, s in zip(bottom, share, strict=True)]
    left.plot(
        names, [measured[n]["read_ms"] * 1e6 / measured[n]["points"] for n in names], "k_", ms=26, label="read once"
    )
    left.set_ylabel("ns a point, wall, 2 threads")
    left.legend(fontsize=8, ncols=2)
    left.tick_params(axis="x", labelsize=8)
    left.set_title("Stages", fontsize=10)
    points = [measured[n]["points"] / 1e6 for n in names]
    right.loglog(points, [measured[n]["best_ms"] for n in names], "o-", label="front end and segmentation")
    right.loglog(points, [measured[n]["busy_ms"] for n in names], "o--", label="processors' time / 2")
    right.loglog(points, [measured[n]["read_ms"] for n in names], "s-", color="0.4", label="reading the cloud once")
    right.set_xlabel("million points")
    right.set_ylabel("ms")
    right.legend(fontsize=8)
    right.grid(alpha=0.3)
    right.set_title("Cost against size", fontsize=10)
    figure.tight_layout()
    figure.savefig(HERE / "front.png", dpi=110)


if __name__ == "__main__":
    main()
