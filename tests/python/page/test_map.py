"""What the map is made of: its colours, its marks, its frame."""

import base64
import dataclasses
import re

import cv2
import numpy as np
import pytest

from debulk import Grid
from debulk.page import map_frame, map_marks
from debulk.page.measured_ridges import measured_ridges
from debulk.page.report import page, report_map
from debulk.page.scales import HeightScale, colours
from debulk.results.advice import advice
from debulk.results.trace import Trace


def numbers(path):
    return np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", path), float)


def rgb(colour):
    return [int(colour[k : k + 2], 16) for k in (1, 3, 5)]


@pytest.mark.parametrize("top", [0.05, 0.4, 3.0, 15.0, 80.0])
@pytest.mark.parametrize("lowest", [0.0, -0.05, -0.3, -2.0, -99.0])
def test_the_key_says_the_height_of_each_colour(top, lowest):
    scale = HeightScale.up_to(top, lowest)
    key = scale.stops(1001)
    for at, text in scale.ticks():
        painted = scale.paint(np.float32([float(text.replace("−", "-"))]))[0].astype(int)
        assert np.abs(painted - rgb(key[round(10 * at)])).max() <= 12  # figures are rounded
    places = [at for at, _ in scale.ticks()]
    assert places[-1] == pytest.approx(100) and np.diff(places).min() > 6
    texts = [text for _, text in scale.ticks()]
    assert "0" in texts and ("−" in "".join(texts)) <= (lowest <= -0.1)
    assert scale.lowest_mm == (max(lowest, -scale.top_mm) if lowest <= -0.1 else 0)


def test_a_ridge_at_its_limit_stands_out_beside_a_pocket_of_15_mm():
    laid, ridge = HeightScale.up_to(15.0).paint(np.float32([0.3, 0.6])).astype(int)
    assert np.abs(ridge - laid).max() > 10


def test_what_lies_below_the_reference_has_colours_that_nothing_above_it_has():
    scale = HeightScale.up_to(15.0)
    below, above = (scale.paint(sign * np.linspace(0.02, 15, 400)).astype(int) for sign in (-1, 1))
    assert min(np.abs(above - one).max(axis=1).min() for one in below) >= 3
    assert scale.paint(np.float32([-99.0])).tolist() == scale.paint(np.float32([-15.0])).tolist()


def sheared(report, **material):
    values = np.full((40, 50), np.nan, dtype=np.float32)
    values[2:-2, 2:-2] = 12.0
    values[10:20, 10:30] = 48.0
    recipe = {**report.recipe, "material": {**report.recipe["material"], **material}}
    return dataclasses.replace(report, shear_map=Grid(values, np.array([100.0, 50.0]), 20.0), recipe=recipe)


def test_the_shear_is_a_layer_with_what_is_locked_outlined(report):
    assert [one.name for one in report_map(report).layers] == []
    (layer,) = report_map(sheared(report)).layers
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(layer.png), np.uint8), cv2.IMREAD_UNCHANGED)[::-1]
    assert (picture[0, 0, 3], picture[5, 5, 3], layer.top) == (0, 255, 50.0)
    table = [rgb(one) for one in colours(256)]
    assert [table.index(picture[y, x, 2::-1].tolist()) for y, x in ((5, 5), (15, 15))] == [61, 245]
    round_it = numbers(layer.lines) * [1, -1]
    # The cells of 10 to 29 and 10 to 19: from a third of a cell before the first point to one behind the last.
    assert round_it.min(axis=0) == pytest.approx([300 - 20 / 3, 250 - 20 / 3], abs=0.1)
    assert round_it.max(axis=0) == pytest.approx([680 + 20 / 3, 430 + 20 / 3], abs=0.1)
    assert "beyond the locking angle of 45 degrees" in layer.key
    free = report_map(sheared(report, locking_deg=60.0)).layers[0]
    assert free.lines == "" and "locking" not in free.key


def test_the_hatch_covers_its_box_and_nothing_else():
    ends = numbers(map_marks.hatch((10.0, -60.0, 100.0, 40.0), 7.0))
    assert ends[:, 0].min() >= 10 and ends[:, 0].max() <= 110
    assert ends[:, 1].min() >= -60 and ends[:, 1].max() <= -20
    assert np.abs(np.diff(ends.reshape(-1, 2, 2), axis=1).sum(axis=2)).max() < 0.11  # all at 45 degrees
    distance = np.diff((ends[::2] - [10, -60]).sum(axis=1))
    assert distance == pytest.approx(np.full(len(distance), 7.0), abs=0.11) and len(distance) == 140 // 7 - 1


def test_the_origin_is_drawn_where_it_lies_and_said_to_be_off_the_map():
    inside = map_frame.frame(np.array([-100.0, -100]), np.array([300.0, 200]), 10)
    assert inside.at_origin and (inside.x, inside.y) == (0, 0)
    off = map_frame.frame(np.array([50.0, -100]), np.array([300.0, 200]), 10)
    assert not off.at_origin and 50 < off.x < 80 and 70 < off.y < 100


def test_fibre_directions_stand_in_the_corner_without_pockets(report):
    asked = dataclasses.replace(report, trace=Trace(time_utc="", fibre_angles_deg=np.array([30.0, -45.0])))
    low, high = np.zeros(2), np.array([1200.0, 900.0])
    pockets = [np.array([[100.0, 100], [200, 100], [200, 200]]), np.array([[1000.0, 700], [1100, 700], [1100, 800]])]
    drawn = map_frame.rose(asked, [*pockets, np.array([[150.0, 700], [200, 800], [100, 750]])], low, high, 30)
    assert drawn.x > 900 and drawn.y > -200  # lower right
    ends = numbers(drawn.path).reshape(-1, 2, 2)
    ways = np.degrees(np.arctan2(-(ends[:, 1, 1] - ends[:, 0, 1]), ends[:, 1, 0] - ends[:, 0, 0]))
    assert ways == pytest.approx([30, -45], abs=1)
    assert [text for _, _, text in drawn.texts] == ["30°", "−45°"]
    assert map_frame.rose(report, pockets, low, high, 30) is None  # its angles are a map


def test_measured_ridges_are_what_stands_above_the_limit_inside_the_outlines():
    values = np.full((60, 80), 0.25, np.float32)
    values[20:23, 10:40] = 1.2  # a ridge in the outline
    values[50, 60:70] = 1.2  # one that is in none
    values[30, 20] = np.nan
    grid = Grid(values, np.array([100.0, 200.0]), 2.0)
    outline = np.array([[110.0, 220], [190, 220], [190, 280], [110, 280]])
    ends = numbers(measured_ridges(grid, [outline], 0.6))
    assert ends[:, 0].min() == 120 and ends[:, 0].max() == 178
    assert sorted(set(-ends[:, 1])) == [240, 244]
    assert measured_ridges(grid, [outline], 1.3) == "" == measured_ridges(None, [outline], 0.6)


def test_the_cursor_is_told_pocket_verdict_and_ridge(report):
    says = {mark.id: mark.says for mark in report_map(report).marks}
    assert says[3] == f"pocket 3: CREASE, ridge {report.pocket(3).ridge_height_mm:.2f} mm"
    assert says[6] == "pocket 6: INVALID"


def test_an_arrow_shows_where_a_pocket_is_to_be_smoothed_out(report):
    drawn = report_map(report)
    ways = [(deed.place_mm, way_deg) for deed in advice(report) for way_deg in deed.ways_deg]
    assert len(drawn.pushes) == len(ways) > 0
    for push, (place_mm, way_deg) in zip(drawn.pushes, ways, strict=True):
        assert (push.x, -push.y) == pytest.approx(place_mm)
        angle = np.degrees(np.arctan2(-push.tip[1], push.tip[0])) % 360
        assert angle == pytest.approx(way_deg)


def test_no_mark_but_a_crease_is_a_cross(report):
    marked = dataclasses.replace(report, left_out=(dataclasses.replace(report.left_out[0], place_mm=(300.0, 300.0)),))
    (bump,) = report_map(marked).bumps
    assert bump.path.startswith("M0 -") and bump.path.endswith("Z") and bump.path.count("M") == 1  # a closed diamond
    text = re.sub(r"<[^>]*>", "|", page(marked))
    around = [text[max(0, m.start() - 12) : m.end() + 12] for m in re.finditer("✕", text)]
    creasing = [f"{p.id} ✕" for p in report.creasing]
    meant = ("✕ CREASE", "✕ crease", "| ✕ at", "✕ pocket", f"|✕ {len(creasing)}|", *creasing)
    assert [one for one in around if not any(words in one for words in meant)] == []
    assert all(f"|{label}|" in text for label in creasing)
