"""One report and one comparison of every earlier schema, as the debulk of its time wrote them: each loads for ever.

They are the made-up reports of the tests of that time, thinned out, with every part that a record could have.
"""

import gzip
import json
from pathlib import Path

import pytest

from debulk import InputError, Report, Verdict
from debulk.comparison import Comparison
from debulk.recipe import Recipe
from debulk.results.codec import SCHEMA

OLD = Path(__file__).with_name("old")


def tree_of(kind, schema):
    return json.loads(gzip.decompress((OLD / f"{kind}_{schema}.json.gz").read_bytes()))


def load(tree, folder, kind=Report):
    (folder / "x.json").write_text(json.dumps(tree))
    return kind.load(folder / "x.json")


def test_there_is_one_of_every_schema():
    for kind in ("report", "comparison"):
        assert [tree_of(kind, schema)["schema"] for schema in range(1, SCHEMA)] == list(range(1, SCHEMA))


@pytest.mark.parametrize("schema", range(1, SCHEMA))
def test_a_report_loads_with_all_that_it_said(schema, tmp_path):
    tree = tree_of("report", schema)
    report = load(tree, tmp_path)
    assert (report.verdict.value, report.reason) == (tree["verdict"], tree["reason"])
    said = [warning for warning in report.warnings if f"in schema {schema}" in warning]
    assert len(said) == 1
    for pocket, stored in zip(report.pockets, tree["pockets"], strict=True):
        for name in ("rms_mm", "ridge_height_mm", "area_mm2", "energy_mj", "reason"):
            assert getattr(pocket, name) == stored[name]
        if stored.get("excess"):
            assert pocket.excess.height_mm == stored["excess"]["height_mm"]
    assert report.pockets[0].net.nodes_mm.tolist() == tree["pockets"][0]["net"]["nodes_mm"]
    recipe = Recipe(**report.recipe)  # a comparison needs it
    assert recipe.net.node_target == 90
    if schema == 1:
        assert recipe.net.free_edge_mm == tree["recipe"]["segmentation"]["edge_tol_mm"]
    assert recipe.verdict.criterion == ("paper" if schema < 4 else "excess")
    for ending in ("json", "html", "csv"):
        report.save(tmp_path / f"again.{ending}")
    assert (report.findings[0].check == "not recorded") == (schema < 11)
    assert Report.load(tmp_path / "again.json").warnings == report.warnings


@pytest.mark.parametrize("schema", range(1, SCHEMA))
def test_a_comparison_loads(schema, tmp_path):
    comparison = load(tree_of("comparison", schema), tmp_path, Comparison)
    assert comparison.max_rms_mm == 0.25 and len(comparison.pockets) == 1
    comparison.save(tmp_path / "again.html")


@pytest.mark.parametrize("schema", [1, 3, 8, 10])
def test_a_cease_of_its_time_stays_what_it_was(schema, tmp_path):
    tree = tree_of("report", schema)
    tree |= {"verdict": "cease", "pockets": []}
    report = load(tree, tmp_path)
    assert report.verdict is Verdict.CEASE and "are not checked against its figures" in report.warnings[-1]


@pytest.mark.parametrize(
    ("schema", "damage", "part"),
    [
        (8, lambda t: t.pop("pockets"), "not a record of schema 8: KeyError: 'pockets'"),
        (8, lambda t: t["pockets"][0].pop("rms_mm"), "pockets[0].rms_mm: is missing"),
        (9, lambda t: t["pockets"][0]["excess"].pop("at_half_mm"), "not a record of schema 9"),
        (3, lambda t: t.update(warnings=None), "not a record of schema 3"),
        (2, lambda t: t["pockets"].append(7), "not a record of schema 2"),
        (5, lambda t: t.update(schema=SCHEMA + 1), "install a newer debulk"),
        (5, lambda t: t.update(schema=0), f"expected 1 to {SCHEMA}, got 0"),
    ],
)
def test_a_damaged_old_record_is_named(schema, damage, part, tmp_path):
    tree = tree_of("report", schema)
    damage(tree)
    with pytest.raises(InputError) as caught:
        load(tree, tmp_path)
    assert part in str(caught.value)
