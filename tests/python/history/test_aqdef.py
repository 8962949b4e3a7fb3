"""Layups as AQDEF, read back by a reader that is not ours."""

import dataclasses
from datetime import datetime

import pytest
from aqdefreader import DfqFile

from debulk import InputError, Verdict
from debulk.history import History
from debulk.history.export import export


@pytest.fixture
def history(report, tmp_path):
    """Return a history: of one part two layups, the first without a pocket and without a level; and another part."""
    history = History(tmp_path / "cell.sqlite")
    bare = {"verdict": Verdict.CEASE, "pockets": (), "findings": (), "level": None, "coverage": 0.9876}
    for context, day, changes in (
        ({"part": "A\x0f-17é", "ply": 3}, "2026-11-23", bare),
        ({"part": "A\x0f-17é", "ply": "4\r\nK0100 7"}, "2026-11-24", {}),
        ({"part": "B"}, "2026-11-25", {}),
    ):
        trace = dataclasses.replace(report.trace, context=context, time_utc=f"{day}T08:15:30.123Z")
        history.add(dataclasses.replace(report, trace=trace, **changes))
    return history


def test_another_reader_finds_every_figure(history, report, tmp_path, capsys):
    path = tmp_path / "layups.dfq"
    part = history.find()[-1].part
    assert export(history, path, search=history_search(part)) == 2
    found = DfqFile(path.read_bytes().decode("utf-8-sig").splitlines())  # its read_dfq_file leaves the file open
    assert "Count of characteristics in DFQ file: 9" in capsys.readouterr().out
    assert found.part_count() == 1 and found.get_part(0).get_data("K1001") == "A -17é"
    kinds = found.get_part(0).get_characteristics()
    assert [kind.get_data("K2002") for kind in kinds][:2] == ["largest ridge", "pockets"] and len(kinds) == 9
    values = {kind.get_data("K2002"): [one.value for one in kind.get_measurements()] for kind in kinds}
    ridges = [p.deciding_ridge.range_mm[1] for p in report.pockets if p.deciding_ridge and p.deciding_ridge.range_mm]
    assert values["largest ridge"] == [pytest.approx(max(ridges), abs=6e-4)]  # a layup without a pocket has none
    assert values["pockets"] == [0, len(report.pockets)]
    assert values["coverage"] == [98.76, pytest.approx(100 * report.coverage, abs=6e-3)]
    limit = report.recipe["verdict"]["max_ridge_mm"]
    assert float(kinds[0].get_data("K2111")) == pytest.approx(limit)
    when = [one.datetime for one in kinds[1].get_measurements()]
    assert when == [datetime(2026, 11, 23, 8, 15, 30), datetime(2026, 11, 24, 8, 15, 30)]
    assert [one.batch_no for one in kinds[1].get_measurements()] == ["#3", "#4 K0100 7"]


def history_search(part):
    from debulk.history import Search

    return Search(part=part)


def test_several_parts_and_other_tables_are_refused(history, tmp_path):
    path = tmp_path / "layups.dfq"
    with pytest.raises(InputError, match=r"^a .dfq: expected layups of one part, got .*'B'; choose one \(--part\)"):
        export(history, path)
    with pytest.raises(InputError, match="got no layup"):
        export(history, path, search=history_search("C"))
    with pytest.raises(InputError, match=r"expected the table layup for a \.dfq, got pocket"):
        export(history, path, "pocket")
    assert not path.exists()
