"""Outlines in text and DXF: no corner is lost, and nothing but the outline is taken for it."""

import builtins
import logging
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from debulk import InputError, files, rings

ANGLES = np.linspace(0, math.tau, 13)
CORNERS = [(0, 0), (400, 0), (400, 300), (0, 300)]


def load(path, text, **how):
    path.write_text(text, encoding="utf-8")
    return files.load_outline(path, **how)


def error_for(path, text, **how):
    with pytest.raises(InputError) as caught:
        load(path, text, **how)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "0,0\n400,0\n400,300\n0,300\n",
        "Ply, seen from above\nx,y\nmm,mm\n0,0\n400,0\n400,300\n0,300\n0,0\n",
        "X [mm];Y [mm]\n0,0;0,0\n400,0;0,0\n400,0;300,0\n0,0;300,0\n",
        "0,0 0,0\n400,0 0,0\n400,0 300,0\n0,0 300,0\n",
        "y,x\n0,0\n0,400\n300,400\n300,0\n",
        "id;x;y;z\n1;0;0;5\n2;400;0;5\n3;400;300;5\n4;0;300;5\n",
        "0,0,\n400,0,\n400,300,\n0,300,\n",
    ],
)
def test_text(tmp_path, text):
    np.testing.assert_array_equal(load(tmp_path / "o.csv", text), CORNERS)


@pytest.mark.parametrize(
    ("first", "part"),
    [
        ("O,0", "line 1: expected numbers, got 'O,0'"),
        ("O,O", "line 1: expected numbers, got 'O,O'"),
        ("0 mm,0 mm", "line 1: expected numbers, got '0 mm,0 mm'"),
        ("0;0 mm", "line 1: expected numbers"),
        ("x,y\nO,0", "line 2: expected numbers"),
        ("0.0,0,0", "line 2: expected finite numbers, as many as above"),
        ("corner 1", "line 1: expected numbers, got 'corner 1'"),
        ("x[m],y[m]\n0,0", "its columns are in m; load it with that unit (--frame-unit m)"),
        ("x,y\ninch,inch\n0,0", "its columns are in inch; convert it"),
    ],
)
def test_a_slip_in_the_first_line_loses_no_corner(tmp_path, first, part):
    assert part in error_for(tmp_path / "o.csv", f"{first}\n400,0\n400,300\n0,300\n")


def test_text_of_utf16_as_spreadsheets_write_it_is_named(tmp_path):
    (tmp_path / "o.txt").write_bytes("x\ty\n0\t0\n400\t0\n400\t300\n".encode("utf-16"))
    with pytest.raises(InputError, match="UTF-16 text; save it as UTF-8"):
        files.load_outline(tmp_path / "o.txt")


def test_decimal_commas_between_commas(tmp_path):
    text = "0,0,0,0\n400,0,0,0\n400,0,300,0\n"
    assert "expected two columns x,y, got 4 (decimal commas between commas?)" in error_for(tmp_path / "o.csv", text)
    with pytest.raises(InputError, match=r"layer: expected None for a file that is no \.dxf"):
        load(tmp_path / "o.csv", text, layer="A")


def test_without_ezdxf_one_sentence_says_so(tmp_path, monkeypatch):
    whole = builtins.__import__
    monkeypatch.setattr(
        builtins, "__import__", lambda name, *a, **k: whole("no" * name.startswith("ezdxf") + name, *a, **k)
    )
    assert "pip install 'debulk[dxf]', or export the outline as lines of x,y" in error_for(tmp_path / "o.dxf", "0\n")


class TestDxf:
    @pytest.fixture
    def drawn(self, tmp_path):
        ezdxf = pytest.importorskip("ezdxf")

        def draw(build, units=4, **how):
            document = ezdxf.new(units=units)
            build(document.modelspace(), document)
            document.saveas(tmp_path / "o.dxf")
            return files.load_outline(tmp_path / "o.dxf", **how)

        return draw

    def refused(self, drawn, build, *parts, **how):
        with pytest.raises(InputError) as caught:
            drawn(build, **how)
        for part in parts:
            assert part in str(caught.value)

    @pytest.mark.parametrize(
        "build",
        [
            lambda space, _: space.add_lwpolyline(CORNERS, close=True),
            lambda space, _: space.add_lwpolyline([*CORNERS, CORNERS[0]]),
            lambda space, _: space.add_polyline2d(CORNERS, close=True),
            lambda space, _: space.add_polyline3d([(x, y, 7) for x, y in CORNERS], close=True),
            lambda space, _: [space.add_line(CORNERS[k], CORNERS[(k + 1) % 4]) for k in (2, 0, 3, 1)],
            lambda space, _: (
                [space.add_line(CORNERS[k], CORNERS[k - 1]) for k in (0, 2)]
                + [space.add_line((400.02, 0), (0.02, 0)), space.add_line((400, 300), (0, 300.01))]
            ),
            lambda space, _: (space.add_text("PLY 7"), space.add_lwpolyline(CORNERS, close=True)),
        ],
    )
    def test_straight_sides(self, drawn, build):
        found = drawn(build)
        assert sorted(map(tuple, found.round(0).tolist())) == sorted(CORNERS)
        assert abs(area(found)) == pytest.approx(120_000, rel=2e-4)

    @pytest.mark.parametrize("turn", [1, -1])
    def test_bulges_run_either_way(self, drawn, turn):
        bulges = [(0, 0, 0, 0, turn), (400, 0, 0, 0, 0), (400, 300, 0, 0, 0), (0, 300, 0, 0, 0.2)]
        half, chord, rise = math.pi * 200**2 / 2, 300, 0.2 * 300 / 2
        radius = (chord**2 / 4 + rise**2) / (2 * rise)
        angle = 4 * math.atan(0.2)
        expected = 120_000 + turn * half + radius**2 / 2 * (angle - math.sin(angle))
        for extrusion in ((0, 0, 1), (0, 0, -1)):  # one seen from below, too
            how = {"extrusion": extrusion}
            found = drawn(lambda space, _, how=how: space.add_lwpolyline(bulges, close=True, dxfattribs=how))
            assert abs(area(found)) == pytest.approx(expected, abs=0.01 * 1600)

    def test_arcs_and_splines_are_as_flat_as_promised(self, drawn):
        def rounded(space, _):
            for start, end in (
                ((50, 0), (350, 0)),
                ((400, 50), (400, 300)),
                ((400, 300), (0, 300)),
                ((0, 300), (0, 50)),
            ):
                space.add_line(start, end)
            space.add_arc((350, 50), 50, 270, 0)
            space.add_arc((50, 50), 50, 180, 270)

        assert abs(area(drawn(rounded))) == pytest.approx(120_000 - (4 - math.pi) * 50**2 / 2, abs=10)
        circle = drawn(lambda space, _: space.add_circle((10, 20), 200))
        middles = (circle + np.roll(circle, 1, axis=0)) / 2
        assert np.abs(np.hypot(*(middles - (10, 20)).T) - 200).max() <= 0.0101
        ellipse = drawn(lambda space, _: space.add_ellipse((0, 0), (200, 0), 0.5))
        assert abs(area(ellipse)) == pytest.approx(math.pi * 200 * 100, abs=10)
        frame = np.array([(200 * math.cos(a), (200 + 40 * (k % 2)) * math.sin(a)) for k, a in enumerate(ANGLES)])
        spline = drawn(lambda space, _: space.add_open_spline(frame))
        knots = np.r_[[0] * 3, np.arange(len(frame) - 2), [len(frame) - 3] * 3]
        curve = BSpline(knots, frame, 3)(np.linspace(0, len(frame) - 3, 3000))
        sides = np.roll(spline, -1, axis=0) - spline
        along = np.clip(((curve[:, None] - spline) * sides).sum(axis=2) / (sides**2).sum(axis=1), 0, 1)
        assert np.hypot(*(spline + along[..., None] * sides - curve[:, None]).T).min(axis=0).max() <= 0.0101
        self.refused(drawn, lambda space, _: space.add_spline(frame), "a SPLINE of fit points alone")

    def test_units(self, drawn, caplog):
        small = [(x / 1000, y / 1000) for x, y in CORNERS]
        build = lambda space, _: space.add_lwpolyline(small, close=True)  # noqa: E731
        with caplog.at_level(logging.WARNING):
            np.testing.assert_allclose(drawn(build, units=6), CORNERS)
        assert "read in m, as it says itself ($INSUNITS)" in caplog.text
        np.testing.assert_allclose(drawn(build, units=6, unit="m"), CORNERS)
        np.testing.assert_allclose(drawn(build, units=0, unit="m"), CORNERS)
        self.refused(drawn, build, "too small", "$INSUNITS in the file says mm", units=4)
        self.refused(drawn, build, "$INSUNITS 3, is none of inches", units=3)

    def test_what_is_not_one_closed_line_is_listed(self, drawn):
        def two(space, _):
            space.add_circle((0, 0), 200, dxfattribs={"layer": "PLY"})
            space.add_circle((500, 0), 100, dxfattribs={"layer": "HOLE"})

        self.refused(drawn, two, "got 2 closed and 0 open", "400 x 400 mm", "'PLY'", "200 x 200 mm", "'HOLE'")
        assert np.ptp(drawn(two, layer="ply"), axis=0).max() == pytest.approx(400, abs=0.02)
        self.refused(drawn, two, "expected one closed line on layer 'CUT', got nothing", layer="CUT")
        self.refused(drawn, lambda space, _: space.add_lwpolyline(CORNERS), "0 closed and 1 open", "open, 400 x 300 mm")
        self.refused(drawn, lambda space, _: space.add_text("ply"), "expected one closed line, got 1 TEXT")
        star = lambda space, _: [space.add_line((0, 0), end) for end in CORNERS[1:]]  # noqa: E731
        self.refused(drawn, star, "more than two lines meet at (0, 0) mm")
        self.refused(drawn, lambda space, _: space.add_circle((0, 0), 1e12), "a radius of 1e+12")

    def test_one_closed_line_holds_cut_outs(self, drawn):
        window = [(100, 100), (180, 100), (180, 160), (100, 160)]

        def on(*named):
            def build(space, _):
                for corners, layer in named:
                    space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})

            return build

        expected = rings.outline([CORNERS, window], "o")
        np.testing.assert_array_equal(drawn(on((window, "1"), (CORNERS, "1"))), expected)
        mark = [(20, 20), (40, 20), (40, 40)]
        aama = on((CORNERS, "1"), (window, "11"), (mark, "8"))
        np.testing.assert_array_equal(drawn(aama, layer="1, 11"), expected)
        np.testing.assert_array_equal(drawn(aama, layer="1"), CORNERS)
        self.refused(drawn, aama, "got 3 closed and 0 open", "with its cut-outs on its layer")
        moved = [(x + 10, y) for x, y in window]
        self.refused(drawn, on((CORNERS, "1"), (window, "1"), (moved, "1")), "cut-out 2: expected rings that lie apart")

    def test_blocks_are_taken_apart(self, drawn):
        def block(space, document):
            document.blocks.new("PLY").add_lwpolyline(CORNERS, close=True)
            space.add_blockref("PLY", (100, 50), dxfattribs={"rotation": 90})

        np.testing.assert_allclose(drawn(block).min(axis=0), (-200, 50), atol=1e-9)

    @settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(
        cut=st.floats(0, 1),
        changes=st.lists(
            st.tuples(st.floats(0, 1), st.sampled_from([b"\0", b"-1", b"1e300", b"nan", b"LINE", b"\n", b" 0"]))
        ),
    )
    def test_damaged_files_give_one_error(self, drawn, tmp_path, cut, changes):
        drawing = tmp_path / "whole.dxf"
        if not drawing.exists():
            drawn(lambda space, _: (space.add_lwpolyline(CORNERS, close=True), space.add_text("ply")))
            data = (tmp_path / "o.dxf").read_bytes()
            drawing.write_bytes(data)
        data = bytearray(drawing.read_bytes())
        at_entities = data.rindex(b"ENTITIES")
        for place, part in changes:
            at = at_entities + int(place * (len(data) - at_entities))
            data[at : at + len(part)] = part
        (tmp_path / "o.dxf").write_bytes(data[: at_entities + int(2 * cut * (len(data) - at_entities))])
        try:
            assert files.load_outline(tmp_path / "o.dxf").shape[1] == 2
        except InputError as error:
            assert str(error).startswith(str(tmp_path / "o.dxf")) and "\n" not in str(error)

    @pytest.mark.parametrize("data", [b"", b"junk", b"AC1032", b"  0\nSECTION\n", b"AutoCAD Binary DXF\r\n\x1a\0abc"])
    def test_other_files(self, tmp_path, data):
        pytest.importorskip("ezdxf")
        (tmp_path / "o.dxf").write_bytes(data)
        with pytest.raises(InputError, match="DXF"):
            files.load_outline(tmp_path / "o.dxf")


def area(corners):
    x, y = corners.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
