"""What goes into another process: public objects pickle and copy to the last bit, or name in a sentence what does."""

import copy
import pickle
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

import debulk
from debulk import net, pocket, scanner, scenes, section, sheet, solve, surface

X = np.arange(-60.0, 61.0, 2.0)
R = np.hypot(*np.meshgrid(X, X))
TURN = np.linspace(0, 2 * np.pi, 100, endpoint=False)
CIRCLE = 40 * np.column_stack([np.cos(TURN), np.sin(TURN)])
MOLD = surface.Reference(np.hypot(90.0, R), (-60, -60), 2.0)
HEIGHTS = np.where(R < 40, 8 * np.cos(np.pi * R / 80) ** 2, 0.0)
PLY = surface.Reference(MOLD.heights_mm + HEIGHTS, (-60, -60), 2.0)
MAP = surface.HeightMap(HEIGHTS.astype(np.float32), np.array([-60.0, -60.0]), 2.0, R < 50)


def laid():
    return net.fibre_net(PLY, MOLD, (1, 2), (10, 95), 10.0, outline_mm=CIRCLE, ply_outline=1.2 * CIRCLE)


def lone_sheet():
    made = laid()
    nodes = made.nodes_mm, made.neighbours, made.kinds, made.spacing_mm, made.area_mm2
    return sheet.Sheet(*nodes, MOLD, debulk.Recipe(material={"friction": 0.2}), np.full(len(made.kinds), 30.0))


def calibration():
    looking = np.array([[900.0, 0, 320], [0, 900, 240], [0, 0, 1]])
    return scanner.Calibration((looking, looking), (np.zeros(5),) * 2, np.eye(3), (-200.0, 0, 0), (640, 480))


MAKE = {
    "recipe": lambda: debulk.Recipe(net={"node_target": 90}),
    "grid": lambda: debulk.Grid(R, np.zeros(2), 2.0),
    "reference": lambda: PLY,
    "height map": lambda: MAP,
    "pocket": lambda: pocket.segment(MAP).pockets[0],
    "net": laid,
    "drape": lambda: net.drape(MOLD, (5, 5), (20, 110), 6.0, outline_mm=CIRCLE, paths="vertical_plane"),
    "sheet of a net": lambda: sheet.Sheet.of_net(laid(), MOLD, debulk.Recipe()),
    "sheet of nodes": lone_sheet,
    "solution": lambda: solve.minimise(lone_sheet(), starts=2),
    "fold": lambda: section.fold(1.0, 50.0, steps=2),
    "layup": lambda: scenes.layup(seed=4, pixels=(64, 48)),
    "calibration": calibration,
}


def content(value):
    """Everything public that an object holds and computes, as plain values."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, (list, tuple)):
        return [content(item) for item in value]
    if isinstance(value, dict):
        return {key: content(item) for key, item in value.items()}
    if isinstance(value, surface.Reference):
        return content([value.heights_mm, value.origin_mm, value.spacing_mm])
    if isinstance(value, sheet.Sheet):
        start = value.start_mm
        return content([start, value.neighbours, value.kinds, value.edge_mm, value.terms(start), value.gradient(start)])
    if isinstance(value, net.Drape):
        return content([value.nodes_mm, value.lattice, value.inside, value.angles_deg(CIRCLE)])
    if is_dataclass(value):
        return {field.name: content(getattr(value, field.name)) for field in fields(value) if field.name[0] != "_"}
    if isinstance(value, scanner.Calibration):
        return content(vars(value))
    return repr(value)


@pytest.mark.parametrize(
    "make", [pytest.param(make, id=name, marks=[pytest.mark.layup] * (name == "layup")) for name, make in MAKE.items()]
)
def test_public_objects_pickle_and_copy(make):
    made = make()
    for again in (pickle.loads(pickle.dumps(made)), copy.deepcopy(made), copy.copy(made)):
        assert type(again) is type(made)
        assert content(again) == content(made)


def test_reports_do_too(report):
    assert pickle.loads(pickle.dumps(report)).to_dict() == copy.deepcopy(report).to_dict() == report.to_dict()


def test_a_net_does_not_follow_the_arrays_that_it_was_laid_from():
    outline = CIRCLE.copy()
    made = net.fibre_net(PLY, MOLD, (1, 2), (10, 95), 10.0, outline_mm=outline)
    outline *= 0.5
    assert np.array_equal(pickle.loads(pickle.dumps(made)).nodes_mm, made.nodes_mm)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: pocket.segment(MAP), "a Segmentation cannot be pickled .* height map"),
        (lambda: pocket.feet(pocket.segment(MAP)), "Feet cannot be pickled .* height map"),
        (lambda: scanner.Scanner(calibration(), periods=(20, 21)), "a Scanner cannot be pickled .* calibration's file"),
    ],
)
def test_the_rest_says_what_to_take_instead(make, words):
    for take in (pickle.dumps, copy.copy, copy.deepcopy):
        with pytest.raises(TypeError, match=words):
            take(make())
