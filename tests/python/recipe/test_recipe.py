import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from debulk import InputError
from debulk.recipe import Material, Net, Recipe
from debulk.recipe.errors import known_names


def error_of(make, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        make(*args, **kwargs)
    return str(caught.value)


def test_the_defaults_are_the_papers_tables():
    recipe = Recipe()
    assert recipe.material.model_dump(exclude={"locking_deg"}) == {
        "thickness_mm": 0.3, "young_mpa": 360.0, "shear_mpa": 40.0, "density_kg_m3": 1048.0, "friction": 0.4,
        "bulk_factor": 1.2, "torsion_n_mm": 0.0, "in_plane_bending_n_mm": 0.0, "tack_n_mm3": 0.0,
    }  # fmt: skip
    assert recipe.loads.model_dump() == {
        "pressure_mpa": 0.1, "gravity_m_s2": 9.81, "pressure_direction": "vertical", "lumping": "consistent",
    }  # fmt: skip
    assert recipe.segmentation.model_dump() == {
        "cut_height_mm": 2.0, "area_tol_mm2": 200.0, "peak_tol_mm": 1.25,
    }  # fmt: skip
    assert (recipe.clean.neighbours, recipe.clean.std_ratio, recipe.net.node_target) == (4, 1.0, 100)
    assert recipe.net.free_edge_mm == 20.0
    assert (recipe.verdict.max_rms_mm, recipe.verdict.max_ridge_mm, recipe.verdict.min_coverage) == (0.3, 0.6, 0.98)


def test_the_same_defaults_stand_in_the_core():
    from debulk.verdict import Criteria

    limits, core = Recipe().verdict, Criteria()
    assert limits.max_rms_mm == core.max_rms_mm
    assert limits.max_ridge_mm == core.max_ridge_height_mm
    for name in ("min_coverage", "min_pocket_coverage", "rms_margin_mm", "ridge_margin_mm"):
        assert getattr(limits, name) == getattr(core, name)
    for name in ("compliance_margin_mm", "criterion"):
        assert getattr(limits, name) == getattr(core, name)


def test_every_setting_is_described_and_every_dimension_named():
    plain = {
        "friction", "bulk_factor", "neighbours", "std_ratio", "least_ratio", "median_cells", "mode",
        "node_target", "paths", "when", "criterion",
        "method", "starts", "most_starts", "seed", "tolerance", "max_iterations", "stiffness",
        "min_coverage", "min_pocket_coverage", "largest_share", "largest_edge_share",
        "threads", "hash_scan", "audit", "lumping", "pressure_direction", "max_risk", "thickness_share",
        "height_share",
    }  # fmt: skip
    units = ("_mm", "_mm2", "_mpa", "_kg_m3", "_m_s2", "_ms", "_deg", "_n_mm", "_n_mm3")
    for section in Recipe.model_fields:
        for name, entry in type(getattr(Recipe(), section)).model_fields.items():
            assert entry.description, f"{section}.{name}"
            assert name in plain or name.endswith(units), f"{section}.{name}"


def test_toml_reads_back_to_an_equal_recipe(tmp_path):
    recipe = Recipe(net={"spacing_mm": 8.4}, material={"thickness_mm": 0.1 + 0.2}, solve={"tolerance": 1e-9})
    path = tmp_path / "cell.toml"
    path.write_text(recipe.to_toml(), encoding="utf-8")
    assert Recipe.load(path) == recipe
    path.write_text(recipe.to_toml(), encoding="utf-8-sig")  # as editors of Windows mark UTF-8
    assert Recipe.load(path) == recipe
    path.write_text(Recipe().to_toml(), encoding="utf-8")
    assert Recipe.load(str(path)) == Recipe()


def test_toml_has_a_comment_on_every_setting():
    """Each setting's description stands behind it, and goes on in the lines below it."""
    text = Recipe().to_toml()
    for section in Recipe.model_fields:
        table = re.search(rf"^\[{section}\]\n((?:.+\n)+)", text, re.MULTILINE)[1]
        for name, entry in type(getattr(Recipe(), section)).model_fields.items():
            found = re.search(rf"^(?:# )?{name} = \S+ +# (.+\n(?: +# .+\n)*)", table, re.MULTILINE)
            assert found, f"{section}.{name}"
            assert " ".join(re.sub(r"\n *#?", " ", found[1]).split()) == entry.description


def test_all_wrong_values_come_in_one_error():
    text = error_of(
        Recipe,
        material={"thickness_mm": -0.3, "bulk_factor": 0.9, "young_mpa": "soft"},
        net={"spacing_mm": float("nan"), "node_target": 99.5},
        loads={"pressure_mpa": float("inf")},
        patch={"mode": "sideways"},
        verdict=7,
        segmentation={"cut_height_mm": 0.15},
    )
    assert text.startswith("9 wrong values")
    for part in (
        "material.thickness_mm: expected a number at least 0.01, got -0.3",
        "material.bulk_factor: expected a number at least 1, got 0.9",
        "material.young_mpa: expected a number, got 'soft'",
        "net.spacing_mm: expected a finite number, got nan",
        "net.node_target: expected a whole number, got 99.5",
        "loads.pressure_mpa: expected a finite number, got inf",
        "patch.mode: expected 'foot' or 'paper', got 'sideways'",
        "verdict: expected a table of settings, got 7",
        "segmentation.cut_height_mm: expected more than 0.2",
    ):
        assert part in text


@pytest.mark.parametrize(
    ("values", "suggestion"),
    [
        ({"material": {"thicknes_mm": 0.2}}, "thicknes_mm: not a known setting; did you mean material.thickness_mm?"),
        ({"material": {"pressure_mpa": 0.2}}, "did you mean loads.pressure_mpa?"),
        ({"material": {"presure_mpa": 0.2}}, "did you mean loads.pressure_mpa?"),
        ({"segmentatoin": {}}, "segmentatoin: not a known setting; did you mean segmentation?"),
        ({"verdict": {"rms_mm": 0.2}}, "did you mean verdict.max_rms_mm?"),
        ({"load": {}}, "did you mean loads?"),
        ({"segmentation": {"edge_tol_mm": 20.0}}, "not a setting any more: it is called net.free_edge_mm now"),
        ({"loads": {"vacuum": "vertical"}}, "loads.vacuum: not a setting any more: see loads.pressure_direction"),
    ],
)  # fmt: skip
def test_an_unknown_name_is_told_its_neighbour(values, suggestion):
    assert suggestion in error_of(Recipe, **values)


@pytest.mark.parametrize("value", ["true", "false"])
def test_a_recipe_that_chooses_regions_of_interest_is_still_read(tmp_path, value):
    path = tmp_path / "earlier.toml"
    path.write_text(f"[segmentation]\ncut_height_mm = 1.8\nregions = {value}\n")
    recipe = Recipe.load(path)
    assert recipe == Recipe(segmentation={"cut_height_mm": 1.8})
    assert recipe.model_copy(update={"segmentation": {"regions": True}}) == recipe
    assert "regions =" not in recipe.to_toml()


def test_a_net_of_so_few_nodes_that_nothing_can_move_is_refused():
    assert re.match(r"net\.node_target: expected .*20.*, got 9", error_of(Recipe, net={"node_target": 9}))
    Recipe(net={"node_target": 20})


def test_settings_of_earlier_versions_load_and_change_nothing():
    assert Recipe(verdict={"excess_margin_mm": 0.05}) == Recipe()


def test_limits_and_spacings_that_no_ply_has_are_refused():
    """Larger ones come out as infinite in the figures that are made of them, smaller ones as zero."""
    for name in ("rms_margin_mm", "ridge_margin_mm", "compliance_margin_mm"):
        assert error_of(Recipe, verdict={name: 1e300}) == f"verdict.{name}: expected a number at most 1000, got 1e+300"
    assert error_of(Recipe, net={"spacing_mm": 1e-300}) == "net.spacing_mm: expected a number at least 0.1, got 1e-300"


@pytest.mark.parametrize("name", ["max_rms_mm", "max_ridge_mm"])
def test_limits_in_micrometres_are_refused_because_every_layup_keeps_them(name):
    assert error_of(Recipe, verdict={name: 600}) == f"verdict.{name}: expected a number at most 10, got 600"


def test_nothing_is_suggested_that_is_not_near():
    assert error_of(Recipe, qqq=1) == "qqq: not a known setting"


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"segmentation": {"cut_height_mm": 0.3}}, "segmentation.cut_height_mm"),
        ({"material": {"thickness_mm": 2.5}, "verdict": {"max_rms_mm": 9.0, "max_ridge_mm": 9.0}}, "cut_height_mm"),
        ({"patch": {"mold_tol_mm": 2.0}}, "segmentation.cut_height_mm"),
        ({"verdict": {"max_rms_mm": 0.25}}, "verdict.max_rms_mm"),
        ({"verdict": {"max_ridge_mm": 0.2}}, "verdict.max_ridge_mm"),
        ({"verdict": {"min_coverage": 1.01}}, "verdict.min_coverage"),
        ({"clean": {"median_cells": 4}}, "clean.median_cells"),
        ({"clean": {"neighbours": True}}, "clean.neighbours"),
        ({"run": {"threads": -1}}, "run.threads"),
    ],
)
def test_what_cannot_be_is_refused(values, name):
    assert name in error_of(Recipe, **values)


def test_the_limit_of_the_rms_follows_a_thicker_ply_unless_it_is_set():
    """The paper's limit is the nominal thickness, and a thick ply without any wrinkle has more than 0.3 mm."""
    thick = Recipe(material={"thickness_mm": 0.6})
    assert (thick.verdict.max_rms_mm, Recipe(material={"thickness_mm": 0.13}).verdict.max_rms_mm) == (0.6, 0.3)
    assert Recipe(material={"thickness_mm": 0.6}, verdict={"max_rms_mm": 0.55}).verdict.max_rms_mm == 0.55
    again = thick.model_copy(update={"material": {"thickness_mm": 0.3}})
    assert again == Recipe()
    assert Recipe(material={"thickness_mm": 0.45}, verdict=thick.verdict).verdict.max_rms_mm == 0.45
    assert thick.verdict.max_rms_mm == 0.6
    assert Recipe(**tomllib.loads(thick.to_toml())) == thick
    assert error_of(Recipe, material={"thickness_mm": 0.6}, net={"node_target": 9}).startswith("net.node_target")


def test_sections_alone_are_checked_too():
    assert error_of(Material, thickness_mm=0.0003) == "thickness_mm: expected a number at least 0.01, got 0.0003"
    assert Recipe(material=Material(thickness_mm=0.2)).material.thickness_mm == 0.2


def test_numpy_numbers_are_numbers():
    assert Recipe(net={"node_target": np.int64(50), "spacing_mm": np.float32(2.5)}).net == Net(
        node_target=50, spacing_mm=2.5
    )
    assert "material.friction" in error_of(Recipe, material={"friction": np.array([0.4, 0.5])})


def test_a_recipe_does_not_change():
    with pytest.raises(ValueError, match="thickness_mm: a recipe does not change"):
        Recipe().material.thickness_mm = 1.0


def test_a_changed_copy_is_checked():
    recipe = Recipe(material={"friction": 0.3})
    copy = recipe.model_copy(update={"material": {"thickness_mm": 0.2}})
    assert (copy.material.friction, copy.material.thickness_mm, recipe.material.thickness_mm) == (0.3, 0.2, 0.3)
    assert "material.thickness_mm" in error_of(recipe.model_copy, update={"material": {"thickness_mm": -1.0}})
    assert "cut_height_mm" in error_of(recipe.model_copy, update={"segmentation": {"cut_height_mm": 0.2}})
    assert recipe.model_copy() == recipe


@pytest.mark.parametrize(
    ("data", "parts"),
    [
        (b"[material]\nthickness_mm = = 3\n", ["not valid TOML", "line 2"]),
        (b"\xff\xfe", ["byte 0 is not UTF-8"]),
        (b"a = " + b"[" * 50_000, ["not a recipe"]),
        (b"[material]\nthickness_mm = nan\n", ["material.thickness_mm", "finite"]),
        (b"[material]\nyoung_mpa = 1e999\nfriction = -inf\n", ["2 wrong", "material.young_mpa", "material.friction"]),
        (b"# " + b"x" * (1 << 20), ["expected a recipe"]),
    ],
)
def test_a_bad_file_is_named(tmp_path, data, parts):
    path = tmp_path / "cell.toml"
    path.write_bytes(data)
    text = error_of(Recipe.load, path)
    assert text.startswith(f"{path}: ")
    for part in parts:
        assert part in text


def test_a_missing_file_is_named(tmp_path):
    assert "none.toml" in error_of(Recipe.load, tmp_path / "none.toml")
    assert str(tmp_path) in error_of(Recipe.load, tmp_path)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(st.sampled_from(known_names(Recipe)), JSON, max_size=6))
def test_any_values_give_a_recipe_or_one_error(values):
    tree: dict = {}
    for name, value in values.items():
        section, _, key = name.partition(".")
        if not key:
            tree[section] = value
        elif isinstance(tree.setdefault(section, {}), dict):
            tree[section][key] = value
    try:
        recipe = Recipe(**tree)
    except InputError:
        return
    assert Recipe(**tomllib.loads(recipe.to_toml())) == recipe


def test_a_limit_to_the_risk_that_was_taken_out_stays_out_in_toml():
    recipe = Recipe(verdict={"max_risk": None})
    assert 'max_risk = "none"' in recipe.to_toml()
    assert Recipe(**tomllib.loads(recipe.to_toml())) == recipe != Recipe()
    assert "max_risk" in error_of(lambda: Recipe(verdict={"max_risk": "some"}))


def test_its_repr_shows_what_is_no_default_and_gives_it_back():
    recipe = Recipe(net={"node_target": 90}, segmentation={"cut_height_mm": 3.0}, clean={"grid_spacing_mm": 2.0})
    assert repr(Recipe()) == "Recipe()"
    assert len(repr(recipe)) < 120
    assert eval(repr(recipe)) == recipe


@pytest.mark.program
def test_type_checkers_know_every_section(tmp_path):
    """The signature that they read is written by hand: a section that it lacks would be an error at the call."""
    api = pytest.importorskip("mypy.api")
    sections = [f"Recipe({name}={{}})\nRecipe({name}=Recipe().{name})" for name in Recipe.model_fields]
    wrong = ["Recipe(material=3)", "Recipe(materiel={})", "Recipe({})"]
    lines = "\n".join(["from debulk import Recipe", *sections, *wrong]).splitlines()
    (tmp_path / "call.py").write_text("\n".join(lines) + "\n")
    cache = Path(__file__).parents[3] / ".mypy_cache" / "calls"
    options = [
        "--config-file=",
        "--strict",
        "--follow-imports=silent",
        "--ignore-missing-imports",
        f"--cache-dir={cache}",
    ]
    said, failed, _ = api.run([*options, str(tmp_path / "call.py")])
    found = {int(number) for number in re.findall(r"call\.py:(\d+): error", said)}
    assert found == set(range(len(lines) - len(wrong) + 1, len(lines) + 1)), said + failed
