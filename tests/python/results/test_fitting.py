"""A report whose JSON was edited to a better verdict is refused."""

import json

import pytest

import debulk
from debulk import InputError, Report, Verdict

pytestmark = pytest.mark.layup

WRINKLE = {
    "start_mm": [0, 0], "end_mm": [200, 0], "length_mm": 200.0, "height_mm": 8.0, "width_mm": 2.0,
    "excess_length_mm": 14.0, "ridge_height_mm": 7.0,
}  # fmt: skip
HOLE = {
    "centre_mm": [5, 5], "extent_mm": [20, 20], "area_mm2": 300.0, "thickness_mm": 15.0, "rim_height_mm": 2.0,
    "of": "scan",
    "at_ply_edge": False,
    "at_best": "invalid",
}  # fmt: skip
SECTION = {
    "height_mm": 1.2, "range_mm": [0.9, 1.4], "lacks_mm": 0.3, "lacks_error_mm": 0.02, "pull_n_per_mm": 20.0,
    "hold_n_per_mm": 30.0,
}  # fmt: skip
LENIENT = {"max_rms_mm": 5.0, "max_ridge_mm": 9.0}


def inspected(recipe):
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    inspector = debulk.Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    return json.loads(json.dumps(inspector.inspect(layup.scan).to_dict()))


@pytest.fixture(scope="module")
def creases():
    return inspected(None)


@pytest.fixture(scope="module")
def ceases():
    """All pockets cease by RMS, ridge and bridge."""
    return inspected(debulk.Recipe(verdict=LENIENT | {"criterion": "paper"}))


@pytest.fixture(scope="module")
def ceases_by_excess():
    return inspected(debulk.Recipe(verdict=LENIENT | {"criterion": "excess"}))


def load(tree, folder):
    (folder / "x.json").write_text(json.dumps(tree))
    return Report.load(folder / "x.json")


def edited(tree, edit):
    tree = json.loads(json.dumps(tree))
    edit(tree)
    return tree


def test_what_an_inspection_wrote_is_read(creases, ceases, ceases_by_excess, tmp_path):
    assert load(ceases_by_excess, tmp_path).verdict is Verdict.CEASE
    assert load(creases, tmp_path).verdict is Verdict.CREASE
    assert load(ceases, tmp_path).verdict is Verdict.CEASE


def all_cease(tree):
    tree["verdict"] = "cease"
    for pocket in tree["pockets"]:
        pocket["verdict"] = "cease"


def without_the_creasing(tree):
    tree["verdict"] = "cease"
    tree["pockets"] = [pocket for pocket in tree["pockets"] if pocket["verdict"] == "cease"]


@pytest.mark.parametrize(
    ("edit", "part"),
    [
        (lambda t: t.update(verdict="cease"), "verdict: CEASE does not fit pocket"),
        (lambda t: t.update(verdict="undecided"), "verdict: UNDECIDED does not fit pocket"),
        (all_cease, "verdict: CEASE does not fit its figures: ridge"),
        (without_the_creasing, "pockets: expected all from 1 to"),
    ],
)
def test_a_creasing_layup_does_not_become_a_good_one(creases, tmp_path, edit, part):
    with pytest.raises(InputError) as caught:
        load(edited(creases, edit), tmp_path)
    assert part in str(caught.value)
    assert "x.json" in str(caught.value) and "was the file edited? Inspect the scan again" in str(caught.value)


@pytest.mark.parametrize(
    ("edit", "part"),
    [
        (lambda t: t.update(coverage=0.97), "verdict: CEASE does not fit coverage, which is 0.97, at least 0.98"),
        (lambda t: t.update(coverage=None), "does not fit coverage, which is unknown"),
        (lambda t: t.update(coverage="NaN"), "does not fit coverage, which is nan"),
        (lambda t: t["recipe"].pop("verdict"), "does not fit its figures"),
        (lambda t: t["recipe"]["verdict"].update(max_rms_mm=0.2501), "does not fit its figures: RMS"),
        (lambda t: t["recipe"]["verdict"].update(max_rms_mm=0.001), "recipe: verdict.max_rms_mm: expected more than"),
        (lambda t: t["recipe"]["verdict"].update(max_rms_mm="much"), "recipe: verdict.max_rms_mm: expected a number"),
        (lambda t: t["recipe"].update(verdict=[]), "recipe: verdict: expected a table of settings"),
        (lambda t: t["recipe"].update(level=3), "recipe: level: expected a table of settings, got 3"),
        (lambda t: t["recipe"]["level"].update(tol_mm="x"), "recipe: level.tol_mm: expected a number, got 'x'"),
        (lambda t: t["recipe"]["material"].update(bulk_factor="Infinity"), "recipe: material.bulk_factor: expected a"),
        (lambda t: t["recipe"]["verdict"].update(ridge_margin_mm=10**400), "recipe: verdict.ridge_margin_mm: "),
        (lambda t: (t["recipe"].pop("level"), t["level"].update(laid_mm=0.7)), "does not fit the level: the ply"),
        (lambda t: t["pockets"][2]["solve"].update(certified=False), "pockets[2].verdict: CEASE does not fit"),
        (lambda t: t["pockets"][2].update(solve=None), "pockets[2].verdict: CEASE does not fit"),
        (lambda t: t["pockets"][2].update(rms_mm=None, rms_range_mm=None), "pockets[2].verdict: CEASE does not fit"),
        (lambda t: t["pockets"][2].update(rms_range_mm=[0.2, 5.1]), "pockets[2].verdict: CEASE does not fit"),
        (lambda t: t["pockets"][2].update(bridge_height_mm=9.1), "pockets[2].verdict: CEASE does not fit"),
        (
            lambda t: t["pockets"][2].update(bridge_section=SECTION | {"height_mm": 9.5, "range_mm": [9.3, 9.9]}),
            "does not fit its figures: bridge 9.30 to 9.90 mm exceeds",
        ),
        (
            lambda t: t["pockets"][2].update(bridge_section=SECTION | {"range_mm": [1.4, 0.9]}),
            "pockets[2].bridge_section: expected 0 <= range_mm[0] <= height_mm <= range_mm[1], got 1.4, 1.2 and 0.9",
        ),
        (lambda t: t["pockets"][2].update(measured_share=0.5), "pockets[2].verdict: CEASE does not fit"),
        (lambda t: t["pockets"][2].update(measured_share=7), "pockets[2].coverage: expected a share from 0 to 1"),
        (lambda t: t["pockets"][2].update(verdict="crease"), "verdict: CEASE does not fit pocket 3, CREASE"),
        (lambda t: t.update(wrinkles=[WRINKLE]), "verdict: CEASE does not fit the wrinkle of 200 mm from (0, 0)"),
        (
            lambda t: t.update(unseen=[HOLE]),
            "verdict: CEASE does not fit a hole in the scan of 3 cm² at (5, 5) mm, INVALID",
        ),
        (lambda t: t["level"].update(laid_mm=0.7), "verdict: CEASE does not fit the level: the ply between"),
        (lambda t: t["level"].update(high_share=0.2), "verdict: CEASE does not fit the level: the ply between"),
    ],
)
def test_a_good_layup_needs_its_evidence(ceases, tmp_path, edit, part):
    with pytest.raises(InputError) as caught:
        load(edited(ceases, edit), tmp_path)
    assert part in str(caught.value)


@pytest.mark.parametrize(
    "edit",
    [
        lambda p: p["excess"].update(range_mm=[1.0, 9.1]),
        lambda p: p.update(excess=None),
        lambda p: (p["excess"].update(bridge_bound_mm=9.1), p["solve"].update(certified=False)),
        lambda p: p.update(measured_share=0.5),
    ],
)
def test_so_does_one_by_the_excess_length(ceases_by_excess, tmp_path, edit):
    number = next(p["id"] for p in ceases_by_excess["pockets"] if p["decided_by"] == "excess")
    with pytest.raises(InputError, match=rf"pockets\[{number - 1}\].verdict: CEASE does not fit"):
        load(edited(ceases_by_excess, lambda t: edit(t["pockets"][number - 1])), tmp_path)
