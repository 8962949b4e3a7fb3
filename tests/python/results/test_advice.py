"""What a report says is to be done, and where."""

import csv
import dataclasses
import io

import numpy as np
import pytest

from debulk.report import Report
from debulk.results.advice import advice, deciding
from debulk.results.bridge_section import BridgeSection
from debulk.results.deciding import worst_first
from debulk.results.finding import Finding
from debulk.results.level import Level
from debulk.results.report import UnseenHole, Wrinkle
from debulk.results.report_csv import csv_text
from debulk.results.report_text import table
from debulk.verdict import Verdict

LEVEL = Level(
    thickness_mm=0.3, laid_mm=0.31, uncertainty_mm=0.01, low_share=0.0, high_share=0.01, offset_mm=0.01,
    tilt_deg=0.002, tilt_axis_deg=10.0, bow_mm=0.02, blocks=40, block_mm=40.0, judged_share=0.7,
)  # fmt: skip
HOLE = UnseenHole(
    centre_mm=(-169.2, 16.4), extent_mm=(66, 82), area_mm2=4980, thickness_mm=58, rim_height_mm=0.3, of="scan"
)


def test_the_middle_of_an_outline_is_that_of_its_area_wherever_its_corners_crowd(report):
    """An L of a 4 by 1 and a 1 by 3 rectangle, one side with many corners, and far from the origin."""
    crowded = [(x, 0.0) for x in np.linspace(0, 4, 50)]
    outline = np.array([*crowded, (4, 1), (1, 1), (1, 4), (0, 4)])
    outline = outline + np.array([1000.0, -2000.0])
    for turned in (outline, outline[::-1]):
        middle = dataclasses.replace(report.pockets[0], outline_mm=turned).centroid_mm
        assert middle == pytest.approx((1000 + (4 * 2 + 3 * 0.5) / 7, -2000 + (4 * 0.5 + 3 * 2.5) / 7), abs=1e-9)
    for flat in (np.zeros((0, 2)), np.zeros((3, 2))):
        assert dataclasses.replace(report.pockets[0], outline_mm=flat).centroid_mm is None


def test_table_and_csv_say_where_the_pockets_are(report):
    rows = list(csv.DictReader(io.StringIO(csv_text(report))))
    for pocket, row in zip(report.pockets, rows, strict=True):
        assert (float(row["x_mm"]), float(row["y_mm"])) == pytest.approx(pocket.centroid_mm)
    # The made-up pockets are ellipses about these points.
    assert report.pockets[0].centroid_mm == pytest.approx((330.0, 260.0), abs=1e-6)
    line = next(line for line in table(report).splitlines() if line.split()[0] == "1")
    assert " 330   260 " in line


def test_every_pocket_that_decides_is_named_with_its_place(report):
    named = {number: verdict for verdict, numbers in deciding(report) for number in numbers}
    assert named == {p.id: p.verdict for p in report.pockets if p.verdict is not Verdict.CEASE}
    assert [verdict for verdict, _ in deciding(report)] == [Verdict.INVALID, Verdict.CREASE, Verdict.UNDECIDED]
    deeds = advice(report)
    places = [deed.pocket for deed in deeds if deed.pocket is not None]
    assert (deeds[0].at, deeds[0].place_mm) == ("holes", (610.0, 130.0))
    assert places == [p.id for p in worst_first(report.pockets) if p.verdict is not Verdict.CEASE]
    for deed in deeds[1 : 1 + len(places)]:
        pocket = report.pocket(deed.pocket)
        assert deed.place_mm == pocket.centroid_mm and deed.verdict is pocket.verdict
    assert deeds[-1].do == "scan again before the vacuum is drawn"


def test_a_creasing_pocket_has_its_amount_and_direction(report):
    for deed in advice(report):
        if deed.verdict is Verdict.CREASE:
            moves = report.rework().of(deed.pocket)
            assert deed.do == "smooth the ply" and deed.ways_deg == tuple(move.towards_deg for move in moves)
            assert all(f"{move.length_mm:.2f} mm towards {move.towards_deg:.0f}°" in deed.amount for move in moves)
            assert moves or deed.amount.startswith("ridge up to ")
    assert any(deed.ways_deg for deed in advice(report))


def test_a_pocket_that_bridges_is_smoothed_into_the_hollow(report):
    high = BridgeSection(
        height_mm=2.9, range_mm=(2.8, 3.1), lacks_mm=1.5, lacks_error_mm=0.1, pull_n_per_mm=4.7, hold_n_per_mm=4.2
    )
    creased = dataclasses.replace(report.pockets[3], verdict=Verdict.CREASE, bridge_section=high, id=99)
    layup = dataclasses.replace(report, verdict=Verdict.CREASE, findings=(), unseen=(), wrinkles=(), pockets=(creased,))
    deed, again = advice(layup)
    assert (deed.do, deed.amount) == ("smooth the ply into the hollow below it", "bridge up to 3.10 mm, limit 0.60 mm")
    assert again.do == "scan again before the vacuum is drawn"


def test_the_findings_own_remedies_come_first(report):
    found = (
        Finding("level", Verdict.INVALID, "scan and reference look swapped", remedy="swap scan and reference"),
        Finding("mold_edge", Verdict.INVALID, "nothing tells where the ply ends", place_mm=(1.0, -2.0)),
        Finding("reference", None, "the reference is known on 60 % of the ply", remedy="complete the reference"),
        Finding("outline", None, "only mentioned, and asks for nothing of its own"),
        Finding("made up", Verdict.INVALID, "a check of a later version"),
        Finding("pockets", Verdict.CREASE, "pocket 3 creases"),
    )
    deeds = advice(dataclasses.replace(report, findings=found))
    assert [(deed.do, deed.at, deed.place_mm) for deed in deeds[:4]] == [
        ("swap scan and reference", "level", None),
        ("give the ply's outline", "mold edge", (1.0, -2.0)),
        ("complete the reference", "reference", None),
        ("scan again", "made up", None),
    ]
    assert deeds[4].pocket == 6
    asks = dataclasses.replace(report.pockets[3], remedy="give a denser scan")
    (deed, *_) = advice(dataclasses.replace(report, findings=(), unseen=(), pockets=(asks,)))
    assert (deed.do, deed.pocket) == ("give a denser scan", asks.id)


def test_no_advice_refers_to_another_sentence(report):
    for verdict in Verdict:
        for one in (report, Report(verdict=verdict, reason="for some reason", pockets=())):
            text = " ".join(map(str, advice(one)))
            assert "reason" not in text and "above" not in text and text


def test_only_a_hole_that_matters_asks_for_a_scan():
    calm = Report(verdict=Verdict.CEASE, reason="", pockets=(), unseen=(HOLE,))
    assert [str(deed) for deed in advice(calm)] == ["draw the vacuum"]
    assert "unseen: a hole in the scan of 49.8 cm² at (-169, 16) mm" in table(calm).splitlines()
    hides = dataclasses.replace(HOLE, at_best=Verdict.UNDECIDED)
    doubtful = Report(verdict=Verdict.UNDECIDED, reason="", pockets=(), unseen=(hides,))
    assert [str(deed) for deed in advice(doubtful)] == ["scan again (a hole in the scan of 49.8 cm² at (-169, 16) mm)"]
    assert "UNDECIDED at best" in table(doubtful)
    lacks = dataclasses.replace(doubtful, unseen=(dataclasses.replace(hides, of="reference"),))
    assert advice(lacks)[0].do == "complete the reference"


def test_before_the_level_is_right_no_pocket_counts(report):
    recipe = {**report.recipe, "level": {"tol_mm": 0.1, "largest_share": 0.15}}
    right = dataclasses.replace(report, level=LEVEL, recipe=recipe)
    assert len(advice(right)) > 1 and "stands 0.310 ± 0.010 mm" in table(right)
    for wrong in ({"laid_mm": 0.45}, {"laid_mm": 0.15}, {"low_share": 0.2}):
        off = dataclasses.replace(right, level=dataclasses.replace(LEVEL, **wrong))
        assert advice(off)[0].do.startswith("check the pose") and "no pocket counts" in advice(off)[1].do
        assert len(advice(off)) == 2


def test_a_standing_wrinkle_is_to_be_smoothed(report):
    wrinkle = Wrinkle(
        start_mm=(10, 20), end_mm=(70, 20), length_mm=60, height_mm=2, width_mm=3, excess_length_mm=2,
        ridge_height_mm=1.2,
    )  # fmt: skip
    creased = dataclasses.replace(report, verdict=Verdict.CREASE, pockets=(), findings=(), wrinkles=(wrinkle,))
    assert str(advice(creased)[0]) == "smooth it (the wrinkle of 60 mm from (10, 20) to (70, 20) mm)"


def test_what_a_deadline_cut_wants_time_and_no_hands(report):
    late = "the deadline passed before the solution was certified"
    cut = dataclasses.replace(report.pockets[3], reason=late)
    known = (Finding("pockets", Verdict.UNDECIDED, late), Finding("deadline", None, late, pocket=cut.id))
    undecided = dataclasses.replace(report, verdict=Verdict.UNDECIDED, reason="1 of 1 undecided", findings=known)
    lines = advice(dataclasses.replace(undecided, pockets=(cut,)))
    assert [line.do for line in lines] == [
        "give the inspection more time, and inspect the same scan again: the deadline passed"
    ]
    both = dataclasses.replace(undecided, pockets=(cut, dataclasses.replace(report.pockets[3], id=99)))
    assert [line.do.split()[0] for line in advice(both)] == ["smooth", "give", "scan"]
    found = (Finding("deadline", Verdict.UNDECIDED, "the deadline passed during the stage place"),)
    whole = Report(verdict=Verdict.UNDECIDED, reason=found[0].reason, pockets=(), findings=found)
    assert advice(whole) == lines
