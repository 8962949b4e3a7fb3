import csv
import dataclasses
import json
import math
import os
import sys

import numpy as np
import pytest

from debulk import Grid, InputError
from debulk.report import Report
from debulk.results.codec import SCHEMA
from debulk.results.deciding import worst_first
from debulk.results.number import number
from debulk.results.report import PocketNet, PocketReport, SolveReport
from debulk.verdict import Verdict


def same(a, b):
    """Equal to the last bit, NaN included, types included."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, Grid):
        return same(a.values, b.values) and same(a.origin_mm, b.origin_mm) and same(a.spacing_mm, b.spacing_mm)
    if dataclasses.is_dataclass(a):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    if isinstance(a, float):
        return isinstance(b, float) and (a == b or (math.isnan(a) and math.isnan(b)))
    if isinstance(a, tuple | list):
        return type(a) is type(b) and len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    return type(a) is type(b) and a == b


def pocket(**changes):
    values = dict(
        id=1,
        verdict=Verdict.INVALID,
        reason="r",
        outline_mm=np.zeros((3, 2)),
        area_mm2=250.0,
        peak_mm=4.0,
        volume_mm3=1.0,
    )
    return PocketReport(**(values | changes))


@pytest.fixture
def tree(report):
    return json.loads(json.dumps(report.to_dict()))


def load_tree(tmp_path, tree):
    path = tmp_path / "x.json"
    path.write_text(json.dumps(tree) if not isinstance(tree, str) else tree, encoding="utf-8")
    return Report.load(path)


def test_json_comes_back_to_the_last_bit(report, tmp_path):
    report.save(tmp_path / "r.json")
    assert same(report, Report.load(tmp_path / "r.json"))


def test_json_is_plain_json(report, tmp_path):
    report.save(tmp_path / "r.json")

    def refuse(name):
        raise AssertionError(name)

    tree = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"), parse_constant=refuse)
    assert (tree["format"], tree["schema"], tree["verdict"]) == ("debulk report", SCHEMA, "invalid")
    assert tree["pockets"][3]["solve"]["curvature"] == "NaN"
    assert len(tree["pockets"][0]["net"]["nodes_mm"][0]) == 3


def test_odd_numbers_and_empty_arrays_survive(tmp_path):
    net = PocketNet(
        nodes_mm=np.zeros((0, 3)),
        neighbours=np.zeros((0, 4)),
        kinds=[],
        edges=np.zeros((0, 2)),
        inside=np.zeros(0, bool),
    )
    grid = Grid(np.array([[np.nan, np.inf, -0.0]], np.float32), np.array([1e-17, -np.pi]), 0.1)
    p = pocket(
        peak_mm=math.inf, rms_mm=math.nan, rms_range_mm=(-math.inf, 0.1 + 0.2), net=net, debulked_mm=np.zeros((0, 3)),
        outline_mm=np.array([[np.nan, np.inf], [-np.inf, 5e-324], [-0.0, 1e308]]),
    )  # fmt: skip
    report = Report(
        verdict=Verdict.INVALID, reason='é – ∅ \u2028 "', pockets=(p,), height_map=grid, timings_ms={"b": 1, "a": 2}
    )
    report.save(tmp_path / "r.json")
    back = Report.load(tmp_path / "r.json")
    assert same(dataclasses.replace(report, timings_ms={"b": 1.0, "a": 2.0}), back)


def test_a_file_name_that_is_no_utf8_and_the_largest_number_come_back(tmp_path):
    """Python keeps the bytes of such a name as halves of characters, which UTF-8 does not have."""
    name = os.fsdecode(b"ply \xe9.pcd")
    most = sys.float_info.max
    report = Report(verdict=Verdict.INVALID, reason="", pockets=(), source={"scan": name}, timings_ms={"a": most})
    for kind in ("json", "csv", "html"):
        report.save(tmp_path / f"r.{kind}")
    back = Report.load(tmp_path / "r.json")
    assert (back.source["scan"], back.timings_ms["a"]) == (name, most)


def test_saving_is_deterministic(report, tmp_path):
    report.save(tmp_path / "a.json")
    Report.load(tmp_path / "a.json").save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


@pytest.mark.parametrize(
    ("mend", "part"),
    [
        (lambda t: t.update(schema=SCHEMA + 1), f"got {SCHEMA + 1}; install a newer debulk"),
        (lambda t: t.update(schema=0), f"schema: expected 1 to {SCHEMA}, got 0"),
        (lambda t: t.update(schema=True), f"schema: expected 1 to {SCHEMA}, got true"),
        (lambda t: t.pop("schema"), f"schema: expected 1 to {SCHEMA}, got null"),
        (lambda t: t.update(format="other"), "not a report"),
        (lambda t: t.pop("reason"), "reason: is missing"),
        (lambda t: t.update(extra=1), "extra: not a value"),
        (lambda t: t["pockets"][2].pop("rms_mm"), "pockets[2].rms_mm: is missing"),
        (lambda t: t["pockets"][2].update(rms_mm="0.3"), "pockets[2].rms_mm: expected a number, got \"0.3\""),
        (lambda t: t["pockets"][2].update(id=1.5), "pockets[2].id: expected a whole number"),
        (lambda t: t["pockets"][2].update(area_mm2=None), "pockets[2].area_mm2: expected a number, got null"),
        (lambda t: t["pockets"][2].update(verdict="good"), "pockets[2].verdict: expected one of cease"),
        (lambda t: t["pockets"][2].update(outline_mm=[[1, 2], [3]]), "pockets[2].outline_mm"),
        (lambda t: t["pockets"][2].update(outline_mm=[[1, 2, 3]]), "pockets[2].outline_mm: expected the shape (n, 2)"),
        (lambda t: t["pockets"][2]["net"].update(kinds=[0.5]), "pockets[2].net.kinds"),
        (lambda t: t["pockets"][2]["net"].update(kinds=[-1]), "pockets[2].net.kinds"),
        (lambda t: t["pockets"][2]["net"].update(inside=[1]), "pockets[2].net.inside"),
        (lambda t: t["pockets"][2].update(debulked_mm=[[0, 0, 0]]), "pockets[2].debulked_mm: expected one per node"),
        (lambda t: t["pockets"][2]["solve"].update(certified=1), "pockets[2].solve.certified: expected true or false"),
        (lambda t: t.update(pockets={}), "pockets: expected a list"),
        (lambda t: t["pockets"][0]["ridges"][0].pop("slope_deg"), "pockets[0].ridges[0].slope_deg: is missing"),
        (
            lambda t: t["pockets"][0]["ridges"][0].update(polyline_mm=[[1, 2]]),
            "pockets[0].ridges[0].polyline_mm: expected the shape (n, 3)",
        ),
        (lambda t: t["height_map"].update(shape=[1 << 20, 1 << 20]), "height_map.shape"),
        (lambda t: t["height_map"].update(shape=[2, 2]), "height_map.values: expected 16 bytes"),
        (lambda t: t["height_map"].update(values="!!"), "height_map.values"),
        (lambda t: t["height_map"].update(values="AAAA"), "height_map.values"),
        (lambda t: t["height_map"].update(spacing_mm=0), "spacing_mm > 0"),
        (lambda t: t["height_map"].update(encoding="zip"), "height_map.encoding: expected one of base64"),
        (lambda t: t["trace"].update(mold_from_scanner=[[1, 0]]), "trace.mold_from_scanner: expected the shape (4, 4)"),
        (lambda t: t["trace"]["scan"].update(sha256=3), "trace.scan.sha256: expected text, got 3"),
        (lambda t: t["height_map"].pop("values"), "height_map.values: is missing"),
    ],
)  # fmt: skip
def test_a_wrong_tree_is_named(tree, tmp_path, mend, part):
    mend(tree)
    with pytest.raises(InputError) as caught:
        load_tree(tmp_path, tree)
    assert str(tmp_path / "x.json") in str(caught.value)
    assert part in str(caught.value)


@pytest.mark.parametrize("text", ["", "[", "null", "3", "[" * 100_000, "{}", "1" * 5000])
def test_other_files_are_refused(tmp_path, text):
    with pytest.raises(InputError, match=r"x\.json: not"):
        load_tree(tmp_path, text)


def test_a_cut_file_is_refused_wherever_it_is_cut(report, tmp_path):
    report.save(tmp_path / "r.json")
    data = (tmp_path / "r.json").read_bytes()
    for length in range(0, len(data) - 2, len(data) // 40):
        (tmp_path / "cut.json").write_bytes(data[:length])
        with pytest.raises(InputError, match=r"cut\.json"):
            Report.load(tmp_path / "cut.json")


def test_csv_has_a_line_a_pocket_with_units(report, tmp_path):
    report.save(tmp_path / "r.csv")
    with (tmp_path / "r.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(report.pockets)
    assert float(rows[0]["area_mm2"]) == report.pockets[0].area_mm2
    assert float(rows[2]["rms_high_mm"]) == report.pockets[2].rms_range_mm[1]
    assert rows[5]["rms_mm"] == "" and rows[5]["certified"] == "" and rows[5]["verdict"] == "invalid"
    assert rows[0]["certified"] == "true" and rows[6]["touches_ply_edge"] == "true"


def test_csv_holds_no_formula(tmp_path):
    Report(verdict=Verdict.CREASE, reason="", pockets=(pocket(reason='=HYPERLINK("x")'),)).save(tmp_path / "r.csv")
    assert "'=HYPERLINK" in (tmp_path / "r.csv").read_text(encoding="utf-8")


def test_the_table_shows_every_pocket(report):
    lines = str(report).splitlines()
    assert lines[0].startswith("INVALID: pocket 6")
    lines = [line for line in lines if not line.startswith("do: ")]
    for k, entry in enumerate(worst_first(report.pockets)):
        assert lines[2 + k].split()[0] == str(entry.id)
        assert entry.verdict.name in lines[2 + k]
        assert f"{entry.area_mm2 / 100:.2f}" in lines[2 + k]
    assert "–" in lines[2]  # a pocket that was not judged has no ridge
    assert any(line.startswith("left out: 1243 points") for line in lines)


def test_there_is_no_negative_zero():
    assert [number(value, 2) for value in (-0.001, -0.0, 0.004, -0.006, None)] == ["0.00", "0.00", "0.00", "-0.01", "–"]


def test_only_cease_passes():
    for verdict in Verdict:
        assert Report(verdict=verdict, reason="", pockets=()).passed == (verdict is Verdict.CEASE)


def test_arrays_are_typed_checked_and_kept_from_change():
    outline = np.zeros((4, 2), dtype=np.float32)
    entry = pocket(outline_mm=outline)
    assert entry.outline_mm.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        entry.outline_mm[0, 0] = 1
    kept = np.zeros((4, 2))
    pocket(outline_mm=kept)
    kept[0, 0] = 1  # the caller's own array stays his
    with pytest.raises(InputError, match=r"outline_mm: expected the shape \(n, 2\), got \(4, 3\)"):
        pocket(outline_mm=np.zeros((4, 3)))


def test_a_pocket_needs_no_more_than_an_invalid_one_has(tmp_path):
    report = Report(verdict=Verdict.INVALID, reason="x", pockets=(pocket(verdict=Verdict.INVALID),))
    for kind in ("json", "csv", "html"):
        report.save(tmp_path / f"r.{kind}")
    assert same(report, Report.load(tmp_path / "r.json"))


def test_an_unknown_ending_is_refused(report, tmp_path):
    with pytest.raises(InputError, match=r"r\.xml: expected a file ending in \.json, \.csv or \.html"):
        report.save(tmp_path / "r.xml")
    with pytest.raises(InputError, match="cannot be written"):
        report.save(tmp_path / "none" / "r.json")
    assert list(tmp_path.iterdir()) == []


def test_a_solve_report_has_no_defaults_for_what_counts():
    with pytest.raises(TypeError):
        SolveReport(method="ipopt", status="converged")


def test_a_pocket_is_found_by_its_number(report):
    assert report.pocket(2) is report.pockets[1]
    assert [p.verdict for p in report.creasing] == [Verdict.CREASE] * len(report.creasing)
    assert len(report.creasing) == sum(p.verdict is Verdict.CREASE for p in report.pockets) > 0
    with pytest.raises(InputError, match=r"number of a pocket of this report \(1, 2, 3, 4, 5, 6, 7\), but got 8"):
        report.pocket(8)


def test_a_pocket_and_its_net_are_shown_in_a_line(report):
    assert repr(report.pockets[0]).startswith("PocketReport(1, CEASE: RMS ")
    assert len(repr(report.pockets)) < 2000
    net = report.pockets[0].net
    assert repr(net) == f"PocketNet({len(net.nodes_mm)} nodes, {len(net.edges)} edges)"
