"""Outlines with cut-outs: one array whichever way they are given, and rings that are no cut-outs are refused."""

import numpy as np
import pytest

from debulk import InputError, files, pocket, rings
from debulk.page.map import path

OUTER = np.array([(0, 0), (400, 0), (400, 300), (0, 300)], dtype=np.float64)
WINDOW = np.array([(100, 100), (180, 100), (180, 160), (100, 160)], dtype=np.float64)
ROUND = np.array([(300 + 20 * np.cos(a), 200 + 20 * np.sin(a)) for a in np.linspace(0, 6, 40)])
PLY = rings.outline([OUTER, WINDOW, ROUND], "o")


@pytest.mark.parametrize(
    "given",
    [
        [OUTER, WINDOW, ROUND],
        (OUTER.tolist(), WINDOW[::-1].tolist(), ROUND.tolist()),
        [OUTER[::-1], np.vstack([WINDOW, WINDOW[:1]]), ROUND],
        np.vstack([OUTER, OUTER[:1], WINDOW, WINDOW[:1], ROUND, ROUND[:1]]),
        np.vstack([OUTER, OUTER[:1], WINDOW, WINDOW[:1], ROUND, ROUND[:1], OUTER[:1]]),
        PLY,
    ],
)
def test_all_ways_to_give_rings_are_one(given):
    found = rings.outline(given, "o")
    assert len(found) == 5 + 5 + 41
    assert [len(ring) for ring in rings.split(found)] == [4, 4, 40]
    assert [np.sign(pocket.polygon_area(ring)) for ring in rings.split(found)] == [1, -1, -1]
    assert pocket.polygon_area(found) == pytest.approx(120_000 - 4800 - abs(pocket.polygon_area(ROUND)))
    assert pocket.inside(found, [[50, 50], [140, 130], [300, 200], [240, 150]]).tolist() == [True, False, False, True]
    assert pocket.distance_to_outline(found, [[140, 110], [230, 130]]) == pytest.approx([10, 50])
    assert rings.said(found) == "48 corners, 2 cut-outs"


def test_a_polygon_stays_what_it_was():
    touching = np.array([(0, 0), (50, 0), (50, 50), (0, 0), (-50, 0), (-50, -50)], dtype=np.float64)
    for corners in (OUTER, OUTER[::-1], touching):
        np.testing.assert_array_equal(rings.outline(corners, "o"), corners)
        np.testing.assert_array_equal(rings.outline([corners], "o"), corners)
        assert len(rings.split(corners)) == 1
    assert rings.said(OUTER) == "4 corners"


@pytest.mark.parametrize(
    ("given", "part"),
    [
        ([WINDOW, OUTER], "o, cut-out 1: expected a ring inside the first"),
        ([OUTER, WINDOW + 400], "cut-out 1: expected a ring inside the first.*at \\(500, 560\\)"),
        ([OUTER, WINDOW, WINDOW - (-250, 0)], "cut-out 2: expected rings that lie apart, but it meets the outside"),
        (
            [OUTER, WINDOW - (100, 0)],
            "cut-out 1: expected rings that lie apart, but it meets the outside near \\(0,",
        ),
        ([OUTER, WINDOW, WINDOW + 20], "cut-out 2: expected rings that lie apart, but it meets o, cut-out 1"),
        ([OUTER, WINDOW, WINDOW * 0.5 + 70], "one of it and o, cut-out 1 lies within the other"),
        ([OUTER, WINDOW * 0.5 + 70, WINDOW], "one of it and o, cut-out 1 lies within the other"),
        ([OUTER, WINDOW / 1000 + 5], "o, cut-out 1: .*is it in metres"),
        ([OUTER, WINDOW[:2]], "o, cut-out 1: expected at least 3 corners"),
        ([OUTER, WINDOW[[0, 2, 1, 3]]], "o, cut-out 1: .*does not cross itself"),
        ([OUTER, np.array([(100, 100), (150, 100), (150, 150), (100, 100), (50, 100), (50, 50)])], "a corner twice"),
        ([OUTER, WINDOW * np.nan], "o, cut-out 1: .*finite"),
        ([OUTER, "window"], "o: expected an \\(M, 2\\) array"),
        ([OUTER, [1, 2]], "o: expected an \\(M, 2\\) array"),
        ([[(0, 0), (400, 0), (400, 300)], [(1, 2)], 3], "o: expected an \\(M, 2\\) array"),
    ],
)
def test_what_is_no_cut_out_is_refused(given, part):
    with pytest.raises(InputError, match=part):
        rings.outline(given, "o")


def test_a_notch_that_passes_through_a_ring_is_seen():
    """No corner of either lies in the other."""
    plus = np.array([(0, 0), (300, 0), (300, 140), (20, 140), (20, 160), (300, 160), (300, 300), (0, 300)])
    with pytest.raises(InputError, match="meets the outside"):
        rings.outline([plus, WINDOW], "o")


@pytest.mark.parametrize(
    "text",
    [
        "{outer}\n\n{window}\n",
        "x,y\n{outer}\n0,0\n{window}\n100,100\n",
        "x,y\n{outer}\n0,0\n\n\n{window}\n100,100\n\n",
    ],
)
def test_tables_hold_rings(tmp_path, text):
    outer, window = ("\n".join(f"{x:g},{y:g}" for x, y in ring) for ring in (OUTER, WINDOW))
    (tmp_path / "o.csv").write_text(text.format(outer=outer, window=window))
    np.testing.assert_array_equal(files.load_outline(tmp_path / "o.csv"), rings.outline([OUTER, WINDOW], "o"))


def test_a_column_tells_rings_apart(tmp_path):
    rows = [(k, *corner) for k, ring in enumerate((OUTER, WINDOW)) for corner in ring]
    (tmp_path / "o.csv").write_text("Loop;x;y\n" + "\n".join(f"{k};{x:g};{y:g}" for k, x, y in rows))
    np.testing.assert_array_equal(files.load_outline(tmp_path / "o.csv"), rings.outline([OUTER, WINDOW], "o"))


def test_lines_that_a_writer_left_empty_are_no_rings(tmp_path):
    (tmp_path / "o.csv").write_text("\n\n".join(f"{x:g},{y:g}" for x, y in OUTER))
    np.testing.assert_array_equal(files.load_outline(tmp_path / "o.csv"), OUTER)


def test_every_ring_is_drawn_however_few_corners_are_wanted():
    assert path(PLY, 400).count("M") == path(PLY, 400).count("Z") == 3
    assert path(PLY, 6).count("L") >= 9
