"""A ply with a cut-out: its edge is an edge of the ply, what shows in it is no ply, and the scan has to have it there.

The molds are a plane and a saddle in closed form, the bumps squares of cosines.
"""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest
from typer.testing import CliRunner

import debulk
import laid_ply
from debulk import Inspector, Recipe, Report, Verdict, rings
from debulk.cli import app
from debulk.inspection.repeating import repeat

T, PITCH, NOISE = 0.3, 1.5, 0.02
OUTER = np.array([(-200, -150), (200, -150), (200, 150), (-200, 150)], dtype=np.float64)


def square(x, y, side):
    return 0.5 * side * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) + [x, y]


def disc(x, y, wide):
    turn = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    return 0.5 * wide * np.stack([np.cos(turn), np.sin(turn)], axis=1) + [x, y]


OFF = np.array([8.0, 0.0])  # mm
WINDOW = square(40, 10, 80)
MOLDS = {"plane": lambda x, y: 0 * x, "saddle": lambda x, y: y**2 / 3000 - x**2 / 1600}
ON_BOTH = pytest.mark.parametrize("mold", MOLDS)
CUT_OUTS = {"square": WINDOW, "round": disc(-60, 20, 60), "hole": disc(-60, 20, 20), "drain hole": disc(-60, 20, 12)}


def bell(x0, y0, wide, high):
    def height(x, y):
        out = np.hypot(x - x0, y - y0) / (0.5 * wide)
        return high * np.cos(0.5 * np.pi * np.minimum(out, 1)) ** 2

    return height


def cloud(mold, true=None, height=lambda x, y: 0.0, seed=0):
    """Return (N, 3) points of a mold, or of the ply with this outline on it."""
    rng = np.random.default_rng(seed)
    x, y = (v.ravel() for v in np.meshgrid(np.arange(-240, 240, PITCH), np.arange(-190, 190, PITCH)))
    x, y = (v + rng.uniform(-0.4, 0.4, v.shape) for v in (x, y))
    z = MOLDS[mold](x, y) + rng.normal(0, NOISE, x.shape)
    if true is not None:
        on = np.zeros(x.shape, dtype=bool)
        for ring in true:
            on ^= debulk.pocket.inside(ring, np.stack([x, y], axis=1))
        z += np.where(on, T + height(x, y), 0.0)
    return np.stack([x, y, z], axis=1)


@functools.cache
def prepared(mold):
    return Inspector(None, cloud(mold, seed=1)).prepared


def inspect(mold, true, given, height=lambda x, y: 0.0, angles=(0, 90)):
    return Inspector(None, prepared(mold), given, angles).inspect(cloud(mold, true, height, seed=2))


@ON_BOTH
@pytest.mark.parametrize("cut_out", CUT_OUTS)
def test_a_ply_with_its_cut_out_passes(mold, cut_out):
    outline = [OUTER, CUT_OUTS[cut_out]]
    report = inspect(mold, outline, outline)
    assert report.verdict is Verdict.CEASE and report.coverage == 1
    assert rings.said(report.ply_outline_mm).endswith("1 cut-out")


@ON_BOTH
@pytest.mark.parametrize(
    ("cut_out", "fault"),  # a drain hole that is not given is smaller than what is looked for
    [(c, f) for c in CUT_OUTS for f in ("closed", "8 mm off", "not given") if (c, f) != ("drain hole", "not given")],
)
def test_a_cut_out_that_does_not_fit_is_invalid(mold, cut_out, fault):
    ring = CUT_OUTS[cut_out]
    given = [OUTER] if fault == "not given" else [OUTER, ring + OFF] if fault == "8 mm off" else [OUTER, ring]
    report = inspect(mold, [OUTER] if fault == "closed" else [OUTER, ring], given)
    assert report.verdict is Verdict.INVALID
    (found,) = (one for one in report.findings if one.at_best is Verdict.INVALID)
    assert found.check == ("plateaus" if fault == "not given" else "ply_edge")
    assert np.hypot(*(found.place_mm - ring.mean(axis=0))) < 60


@ON_BOTH
def test_a_fibre_that_ends_at_a_cut_out_ends_as_at_the_outer_edge(mold):
    """The same bump beside a window, and beside the outer edge of a ply that ends where the window begins."""
    bump, half = bell(-28, 10, 50, 4.0), np.minimum(OUTER, [0, np.inf])
    window, edge, none = (inspect(mold, o, o, bump).pockets[0] for o in ([OUTER, WINDOW], [half], [OUTER]))
    assert window.verdict is edge.verdict
    assert window.ridge_height_mm == pytest.approx(edge.ridge_height_mm, abs=1e-3)
    assert abs(window.ridge_height_mm - none.ridge_height_mm) > 0.01


def test_a_creasing_bump_creases_wherever_the_cut_out_is():
    outline = [OUTER, WINDOW]
    for x, y in ((-110, -80), (140, 10)):  # clear of it; on fibres between it and the edge
        (pocket,) = inspect("plane", outline, outline, bell(x, y, 60, 6.0)).pockets
        assert pocket.verdict is Verdict.CREASE and pocket.ridge_height_mm > 0.6
    (held,) = inspect("plane", outline, outline, bell(140, 10, 60, 4.0)).pockets
    assert held.verdict is Verdict.CEASE


def test_a_bump_round_a_hole_is_judged_by_the_fibres_beside_the_hole():
    """No net can begin in the middle of such a pocket."""
    outline = [OUTER, disc(-60, 20, 14)]
    (pocket,) = inspect("plane", outline, outline, bell(-60, 20, 70, 8.0)).pockets
    (whole,) = inspect("plane", [OUTER], [OUTER], bell(-60, 20, 70, 8.0)).pockets
    assert pocket.verdict is whole.verdict is Verdict.CREASE
    assert pocket.ridge_height_mm > 0.6


@ON_BOTH
def test_bumps_on_both_sides_of_a_cut_out_share_no_fibre(mold):
    slot, left, right = square(0, 0, 6) * [1, 20], bell(-37, 0, 60, 3.7), bell(37, 0, 60, 3.7)
    both = lambda x, y: left(x, y) + right(x, y)  # noqa: E731
    apart, joined = (inspect(mold, o, o, both) for o in ([OUTER, slot], [OUTER]))
    assert joined.verdict is Verdict.UNDECIDED and "a fibre over it and pocket" in joined.reason
    assert apart.verdict is Verdict.CEASE


@pytest.mark.parametrize("seed_mm", [(-100.0, 0.0), (40.0, 10.0)])  # the second lies in the cut-out
def test_a_drape_goes_on_over_a_cut_out(seed_mm):
    outline = [OUTER, WINDOW]
    draping = debulk.net.Draping(seed_mm, (0, 90))
    assert inspect("saddle", outline, outline, angles=draping).verdict is Verdict.CEASE
    off = inspect("saddle", outline, [OUTER, WINDOW + OFF], angles=draping)
    assert off.verdict is Verdict.INVALID


@pytest.fixture(scope="module")
def image():
    """Return the inspector of an image, its scan and the outline: a ply with a window and a bump beside it."""
    one, window = laid_ply.layup(), square(20, 10, 60)
    bump = laid_ply.bell(-60, 10, 70, 4.0)
    scan = laid_ply.scan(lambda x, y: np.where((np.abs(x - 20) < 30) & (np.abs(y - 10) < 30), -T, bump(x, y)), seed=4)
    return one, scan, [one.ply_outline, window]


def inspected(image, threads=2):
    one, scan, outline = image
    given = laid_ply.inspector().prepared, outline, (0, 90), one.mold_from_scanner
    return Inspector(Recipe(run={"threads": threads}), *given).inspect(scan)


@pytest.fixture(scope="module")
def report(image):
    return inspected(image)


def test_an_image_of_it_is_judged_alike_on_any_number_of_threads(image, report):
    alone = inspected(image, threads=1)
    assert report.verdict is Verdict.CEASE and len(report.pockets) == 1
    for one, other in zip(report.pockets, alone.pockets, strict=True):
        assert one.excess == other.excess and one.ridge_height_mm == other.ridge_height_mm
    one, scan, outline = image
    assert inspected((one, scan, [outline[0], outline[1] + OFF])).verdict is Verdict.INVALID


def test_a_report_holds_the_rings_and_is_repeated(image, report, tmp_path):
    report.save(tmp_path / "layup.json")
    report.save(tmp_path / "layup.html")
    loaded = Report.load(tmp_path / "layup.json")
    np.testing.assert_array_equal(loaded.ply_outline_mm, report.ply_outline_mm)
    assert len(rings.split(loaded.ply_outline_mm)) == 2
    assert repeat(loaded, image[1], image[0].reference).same
    page = (tmp_path / "layup.html").read_text()
    assert ", 1 cut-out" in page
    assert any(d.count("M") == 2 for d in re.findall(r'<path[^>]* d="([^"]*)"', page))


def test_the_command_line_reads_a_file_of_rings(tmp_path):
    np.save(tmp_path / "mold.npy", cloud("plane", seed=1))
    np.save(tmp_path / "ply.npy", cloud("plane", [OUTER, WINDOW], seed=2))
    text = "\n\n".join("\n".join(f"{x:g},{y:g}" for x, y in ring) for ring in (OUTER, WINDOW))
    (tmp_path / "o.csv").write_text(f"x,y\n{text}\n")
    given = [str(tmp_path / "ply.npy"), "--reference", str(tmp_path / "mold.npy"), "--outline", str(tmp_path / "o.csv")]
    result = CliRunner().invoke(app, ["inspect", *given, "-o", str(tmp_path / "out.json")])
    assert result.exit_code == 0, result.output
    assert len(rings.split(Report.load(tmp_path / "out.json").ply_outline_mm)) == 2
    (tmp_path / "o.csv").write_text(f"x,y\n{text.replace('80,', '280,')}\n")
    assert CliRunner().invoke(app, ["inspect", *given]).exit_code == 2
