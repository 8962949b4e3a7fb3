import pytest

from debulk.recipe import Recipe, options

# No value is its default, so that a setting which is not handed over shows.
OTHER = Recipe(
    material={
        "thickness_mm": 0.2, "young_mpa": 300.0, "shear_mpa": 30.0, "density_kg_m3": 900.0, "friction": 0.3,
        "bulk_factor": 1.1, "torsion_n_mm": 0.4, "in_plane_bending_n_mm": 30.0, "tack_n_mm3": 0.1,
    },
    loads={"pressure_mpa": 0.08, "gravity_m_s2": 9.0, "lumping": "paper", "pressure_direction": "normal"},
    segmentation={"cut_height_mm": 1.9, "area_tol_mm2": 190.0, "peak_tol_mm": 1.2},
    clean={"neighbours": 6, "std_ratio": 1.5, "least_ratio": 1.75, "spike_mm": 0.4, "median_cells": 5},
    patch={"mold_tol_mm": 0.15, "smooth_mm": 7.0, "mode": "paper"},
    net={"node_target": 90, "spacing_mm": 6.0, "free_edge_mm": 19.0, "paths": "vertical_plane"},
    solve={
        "method": "interior_point", "starts": 3, "seed": 5, "tolerance": 1e-7, "max_iterations": 77, "stiffness": 1e7,
    },
    ridge={"touch_mm": 0.02},
    verdict={
        "criterion": "paper", "max_rms_mm": 0.2, "min_coverage": 0.9, "min_pocket_coverage": 0.7,
        "rms_margin_mm": 0.02, "ridge_margin_mm": 0.04, "compliance_margin_mm": 0.06,
    },
)  # fmt: skip


@pytest.mark.parametrize(
    ("made", "sections"),
    [
        (options.outliers(OTHER), ["clean"]),
        (options.front_end(OTHER, 1.0), ["clean"]),
        (options.segment(OTHER, None), ["segmentation", "patch"]),
        (options.unseen(OTHER, None), ["segmentation"]),
        (options.feet(OTHER), ["material", "patch"]),
        (options.lay_pocket(OTHER), ["patch"]),
        (options.lay_pocket(OTHER).net, ["net"]),
        (options.ply(OTHER), ["material", "loads"]),
        (options.minimise(OTHER), ["solve"]),
        (options.minimise(OTHER).solve, ["solve"]),
        (options.section_ply(OTHER), ["loads"]),
        (options.ridge(OTHER), ["material", "ridge"]),
        (options.criteria(OTHER), ["verdict"]),
    ],
)
def test_a_setting_arrives_under_its_name(made, sections):
    settings = {name: value for section in sections for name, value in getattr(OTHER, section).model_dump().items()}
    there = {name for name in settings if hasattr(made, name)}
    arrived = {name: getattr(made, name) for name in there}
    if "criterion" in arrived:
        arrived["criterion"] = arrived["criterion"].name.lower()
    assert arrived == {name: settings[name] for name in there}
    assert there, f"nothing of {sections} in {type(made).__name__}"


def test_what_goes_by_another_name_arrives_too():
    recipe = Recipe(clean={"max_hole_mm": 12.0}, verdict={"max_ridge_mm": 0.5})
    assert options.front_end(recipe, 1.5).spacing_mm == 1.5
    assert options.front_end(recipe, 1.5).hole_diameter_mm == 12.0
    assert options.criteria(recipe).max_ridge_height_mm == 0.5
    assert options.criteria(recipe, "paper").criterion != options.criteria(recipe).criterion
    assert options.section_ply(recipe).stiffness_n_mm == pytest.approx(360 * 0.3**3 / 12)


def test_post_processing_and_the_sections_of_bridges_have_the_same_gap_that_touches():
    for recipe, touch_mm in ((Recipe(), 0.01), (Recipe(ridge={"touch_mm": 0.2}), 0.2)):
        assert options.ridge(recipe).touch_gap_mm == pytest.approx(touch_mm)
        assert options.bridge_mm(0.99 * touch_mm, recipe) == 0.0
        assert options.bridge_mm(1.01 * touch_mm, recipe) == pytest.approx(1.01 * touch_mm + 0.25)
