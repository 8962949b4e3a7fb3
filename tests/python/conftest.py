"""A made-up but lifelike report, so that tests of report, page and command line need no inspection."""

from __future__ import annotations

import os
import signal
from dataclasses import fields

# Before NumPy is imported. Tests multiply whole clouds by small matrices; a second thread of BLAS mostly waits then, in
# a loop that takes a core from the other worker. test_products.py starts two, and shows that no inspection wakes them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest

from browsing import browser  # noqa: F401, a fixture
from debulk import fibre
from debulk.grid import Grid
from debulk.report import Report
from debulk.results.finding import Finding
from debulk.results.report import LeftOut, PocketNet, PocketReport, SolveReport
from debulk.results.ridge import RidgeGeometry
from debulk.results.runs import ExcessRuns
from debulk.results.trace import ArrayTrace, Trace
from debulk.surface import Reference
from debulk.verdict import Verdict
from layers import LAYERS, Layers


def pytest_configure(config: pytest.Config) -> None:
    """Sort the tests into layers."""
    for name, text in LAYERS.items():
        config.addinivalue_line("markers", f"{name}: {text}")
    config.pluginmanager.register(Layers(), "layers")


# Centre x, y, half-axes along and across, turn in degrees, peak: a few of the paper's sizes.
_BELLS = [
    (330.0, 260.0, 160.0, 110.0, 20.0, 15.0),
    (800.0, 300.0, 150.0, 48.0, -35.0, 9.0),
    (560.0, 560.0, 90.0, 60.0, 75.0, 11.0),
    (980.0, 640.0, 70.0, 50.0, 0.0, 7.0),
    (200.0, 640.0, 60.0, 38.0, 50.0, 8.0),
    (760.0, 740.0, 45.0, 30.0, 10.0, 5.0),
    (1060.0, 130.0, 26.0, 15.0, 80.0, 3.6),
]


def _mold(x, y):
    return 40.0 - ((x - 600) ** 2 + 0.5 * (y - 450) ** 2) / 6000.0


def _bell(x, y, bell):
    cx, cy, a, b, turn, peak = bell
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    u, v = (c * (x - cx) + s * (y - cy)) / a, (c * (y - cy) - s * (x - cx)) / b
    return peak * np.cos(0.5 * np.pi * np.clip(np.hypot(u, v), 0, 1)) ** 2


def _net(bell, count):
    cx, cy, a, b, turn, _peak = bell
    spacing = float(np.sqrt(np.pi * a * b / count))
    m = int(np.ceil(max(a, b) / spacing)) + 1
    i, j = np.meshgrid(np.arange(-m, m + 1), np.arange(-m, m + 1))
    x, y = cx + spacing * (i + 0.12 * j).ravel(), cy + spacing * (j - 0.08 * i).ravel()
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    radius = np.hypot((c * (x - cx) + s * (y - cy)) / a, (c * (y - cy) - s * (x - cx)) / b)
    keep = radius < 1 + spacing / min(a, b)
    number = np.full(keep.size, -1)
    number[keep] = np.arange(keep.sum())
    grid = np.pad(number.reshape(i.shape), 1, constant_values=-1)
    shifts = [grid[1:-1, 2:], grid[1:-1, :-2], grid[2:, 1:-1], grid[:-2, 1:-1]]
    neighbours = np.stack([shift.ravel()[keep] for shift in shifts], axis=1)
    x, y, radius = x[keep], y[keep], radius[keep]
    nodes = np.column_stack([x, y, _mold(x, y) + _bell(x, y, bell)])
    kinds = np.where(radius > 1, np.where(x > 1050, 2, 1), 0)
    edges = [(k, n) for k in range(len(x)) for n in neighbours[k, [0, 2]] if n >= 0]
    net = PocketNet(nodes_mm=nodes, neighbours=neighbours, kinds=kinds, edges=edges, inside=radius < 0.85)
    return net, spacing


def _ridge(bell, height, *, mirrored):
    cx, cy, a, b, turn, _peak = bell
    way = np.linspace(-0.6, 0.6, 9) * b

    def line(deg):
        x, y = cx + way * np.cos(np.radians(deg)), cy + way * np.sin(np.radians(deg)) + 0.03 * way**2
        return np.column_stack([x, y, _mold(x, y)])

    return RidgeGeometry(
        polyline_mm=line(turn), direction_deg=turn % 180, mirrored_mm=line(-turn) if mirrored else None,
        mirrored_deg=-turn % 180 if mirrored else None, fibre_angle_deg=35 / 3, length_mm=1.2 * b,
        excess_mm=2 * (height - 0.13), height_mm=height, elastic_mm=2.7 * height, half_width_mm=4 + height / 7,
        slope_deg=39 + height, height_over_thickness=height / 0.3, height_over_half_width=0.6, place_spread_mm=a / 9,
    )  # fmt: skip


def _pocket(k, bell, rng):
    cx, cy, a, b, turn, peak = bell
    angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))

    def ring(share):
        u, v = share * a * np.cos(angle), share * b * np.sin(angle)
        return np.column_stack([cx + c * u - s * v, cy + s * u + c * v])

    cut = 2 / np.pi * np.arccos(np.sqrt(2.0 / peak))
    common = dict(
        id=k + 1, outline_mm=ring(cut), foot_outline_mm=ring(0.97), area_mm2=float(np.pi * a * b * cut**2),
        peak_mm=peak, volume_mm3=float(0.3 * np.pi * a * b * peak), touches_ply_edge=k == 6,
    )  # fmt: skip
    if k == 5:
        return PocketReport(
            verdict=Verdict.INVALID, measured_share=0.61, runtime_ms=1.2,
            reason="the scanner saw 61 % of its area <script>alert('x')</script> & less than 80 %", **common,
        )  # fmt: skip
    net, spacing = _net(bell, 100)
    start = net.nodes_mm[:, 2] - _mold(net.nodes_mm[:, 0], net.nodes_mm[:, 1])
    ridge = np.exp(-(((net.nodes_mm[:, 0] - cx) / spacing) ** 2)) * (0.2 + 0.15 * k) * (net.kinds == 0)
    debulked = net.nodes_mm.copy()
    debulked[:, 2] += ridge - start
    post = 0.25 + 0.6 * ridge
    rms = float(np.sqrt(np.mean(post[net.inside] ** 2)))
    height = 0.25 + 0.12 * k
    verdict = Verdict.UNDECIDED if k == 3 else Verdict.CEASE if max(rms / 0.3, height / 0.6) <= 1 else Verdict.CREASE
    reasons = {
        Verdict.CEASE: f"RMS {rms:.2f} mm and ridge {height:.2f} mm are within their limits",
        Verdict.CREASE: f"ridge {height:.2f} mm exceeds 0.60 mm",
        Verdict.UNDECIDED: "not certified: residual force 3.1e-04 of a node's load",
    }
    terms = {"bending": 4.9, "shear": 91.2, "friction": 3.0 * (k == 6), "gravity": 0.034, "vacuum": 833.1}
    return PocketReport(
        verdict=verdict, reason=reasons[verdict], spacing_mm=spacing, node_count=len(start), rms_mm=rms,
        rms_range_mm=(rms - 0.01, rms + 0.005), ridge_height_mm=height, ridge_length_mm=1.4 * b,
        excess_length_mm=0.05 + 0.2 * k, measured_share=0.97, net=net, initial_gap_mm=start, debulked_mm=debulked,
        debulked_gap_mm=ridge, post_processed_gap_mm=post, energy_mj=-734.2 + k / 3, energy_terms_mj=terms,
        solve=SolveReport(
            method="ipopt", status="converged", certified=k != 3, iterations=60 + k, evaluations=71 + k,
            length_error=2.1e-5, penetration_mm=0.0, kkt_error=3.1e-4 if k == 3 else 4.2e-7,
            curvature=float("nan") if k == 3 else 0.02, doubt="residual force" if k == 3 else "",
        ),
        ridges=() if k == 4 else (_ridge(bell, height, mirrored=k % 2 == 0),),
        runtime_ms=14.0 + 3 * k, runtime_split_ms={"patch": 1.5, "net": 2.0, "solve": 10.5 + 3 * k}, **common,
    )  # fmt: skip


def _runs(heights, outline):
    """The fibre lines over the bells, as on a flat mold, each with the number of the pocket that it crosses."""
    grid = Grid(heights, np.zeros(2), 2.0)
    runs = fibre.measure(
        grid, Reference(np.zeros((4, 4)), (-300.0, -300.0), 600.0), (0, 90), outline, apart_mm=6.0
    ).runs
    centres = np.array([bell[:2] for bell in _BELLS])
    away = np.linalg.norm(runs.top_mm[:, None] - centres, axis=2)
    number = np.where(away.min(axis=1) < 60, away.argmin(axis=1) + 1, 0)
    long = runs.high_mm > 0.8
    kept = np.isin(runs.family + 2 * runs.line, (runs.family + 2 * runs.line)[long])
    columns = {entry.name: getattr(runs, entry.name)[kept] for entry in fields(fibre.FibreRuns)}
    return ExcessRuns(**columns, pocket=number[kept], apart_mm=6.0)


@pytest.fixture(scope="session")
def report() -> Report:
    """Seven pockets of all verdicts, one of them invalid, and a noisy height map with drop-outs."""
    rng = np.random.default_rng(0)
    spacing = 2.0
    x, y = np.meshgrid(np.arange(0, 1200, spacing), np.arange(0, 900, spacing))
    bells = sum(_bell(x, y, bell) for bell in _BELLS)
    heights = 0.3 + rng.normal(0, 0.05, x.shape) + bells
    heights[rng.random(x.shape) < 0.01] = np.nan
    heights[np.hypot(x - 610, y - 130) < 18] = np.nan
    outline = np.array([(30, 30), (1150, 30), (1170, 500), (1120, 870), (80, 870), (30, 500)], dtype=float)
    pockets = tuple(_pocket(k, bell, rng) for k, bell in enumerate(_BELLS))
    from debulk.recipe import Recipe

    return Report(
        verdict=Verdict.INVALID, reason="pocket 6 cannot be judged: the scanner saw 61 % of its area", pockets=pockets,
        timings_ms={
            "read": 412.0, "clean": 305.5, "height map": 120.25, "segment": 40.0, "patch": 11.0, "net": 16.0,
            "solve": 210.0, "ridge and verdict": 4.0,
        },
        left_out=(
            LeftOut(what="region at (610, 130) mm, 1.8 cm²", why="below the area tolerance", bound="peak 2.4 mm"),
            LeftOut(what="1243 points", why="outliers, more than 1 deviation from their neighbours"),
        ),
        coverage=0.9871, height_map=Grid(heights.astype(np.float32), np.array([0.0, 0.0]), spacing),
        ply_outline_mm=outline, runs=_runs(0.3 + bells, outline),
        recipe=Recipe(net={"node_target": 90}, verdict={"rms_margin_mm": 0, "ridge_margin_mm": 0}).model_dump(),
        source={"scan": "scan <1>.pcd", "reference": "ref.pcd"},
        findings=(
            Finding("pockets", Verdict.INVALID, "pocket 6 cannot be judged: seen to 61 %", pocket=6),
            Finding("holes", Verdict.UNDECIDED, "a hole", 0.1, 0.5, "mm", (610.0, 130.0)),
            Finding("outline", None, "the outline <is not> known"),
        ),
        warnings=("the ply's edge is nearer than 20 mm to pocket 7",),
        trace=Trace(
            time_utc="2026-03-01T12:00:00.250Z", scan=ArrayTrace(shape=(960, 1280, 3), sha256="ab" * 32),
            reference=ArrayTrace(shape=(960, 1280, 3)),
            fibre_angles_map=Grid(np.array([[[0.1, 90.1], [np.nan, np.nan]]]), np.zeros(2), 50.0),
            mold_from_scanner=np.diag([1, -1, -1, 1]), fitted_camera=(1220.2, 639.5, 479.5),
            mask=ArrayTrace(shape=(960, 1280), sha256="cd" * 32), deadline_s=0.5,
            context={"part": "A-17 <b>", "ply": 3, "limits": [0.1, True, None]},
            versions={"debulk": "0.1.0"}, host={"name": "cell-4"},
        ),
    )  # fmt: skip


@pytest.fixture
def ctrl_c():
    """Ctrl-C as a terminal's program has it; what a shell starts in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
