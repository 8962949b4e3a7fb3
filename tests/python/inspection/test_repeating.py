"""An inspection is repeated from its report alone and the same clouds."""

import dataclasses

import numpy as np
import pytest
from typer.testing import CliRunner

import debulk
from debulk import InputError, Report, files
from debulk.cli import app
from debulk.inspection.repeating import repeat


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Return a folder with a scan, a reference, a mask and the report of all three; nothing else is left of it."""
    folder = tmp_path_factory.mktemp("kept")
    layup = debulk.scenes.layup(seed=5, pixels=(640, 480))
    mask = np.zeros((480, 640), bool)
    mask[:3] = True
    angles = debulk.Grid(np.full((3, 3, 2), [10.1, 99.7]), np.array([-2000.0, -2000.0]), 2000.0)
    inspector = debulk.Inspector(
        debulk.Recipe(net={"node_target": 60}, solve={"seed": 7}),
        layup.reference,
        layup.ply_outline,
        angles,
        layup.mold_from_scanner,
        mask=mask,
    )
    inspector.inspect(layup.scan, context={"part": "A-17"}).save(folder / "layup.json")
    files.save_cloud(folder / "scan.pcd", layup.scan)
    files.save_cloud(folder / "reference.npy", layup.reference)
    np.save(folder / "mask.npy", mask)
    return folder


def loaded(folder):
    report = Report.load(folder / "layup.json")
    return report, files.load_cloud(folder / "scan.pcd"), files.load_cloud(folder / "reference.npy")


def test_the_same_files_give_the_same_to_the_bit(kept):
    report, *clouds = loaded(kept)
    again = repeat(report, *clouds, files.load_mask(kept / "mask.npy"))
    assert again.same and again.differences == () and again.unchecked == ()
    assert len(report.pockets) > 3
    assert again.report.trace.context == {"part": "A-17"}


def test_a_record_of_a_history_gives_the_same(tmp_path):
    """A history leaves out maps, and of what an inspector keeps there the nets that decided nothing, too."""
    layup = debulk.scenes.layup(seed=5, pixels=(448, 336))
    there, whole = (debulk.history.History(tmp_path / name) for name in ("cell.sqlite", "whole.sqlite"))
    inspector = debulk.Inspector(
        None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, history=there
    )
    whole.add(inspector.inspect(layup.scan))
    for history in (there, whole):
        again = repeat(history.report(1), layup.scan, layup.reference)
        assert again.same and again.report.height_map is not None, again.differences


def test_a_figure_that_differs_is_named(kept):
    report, *clouds = loaded(kept)
    first = report.pockets[0]
    changed = dataclasses.replace(first, area_mm2=float(np.nextafter(first.area_mm2, 0)))
    report = dataclasses.replace(report, pockets=(changed, *report.pockets[1:]))
    again = repeat(report, *clouds, files.load_mask(kept / "mask.npy"))
    assert again.differences == ("pockets[0].area_mm2",)


def test_other_clouds_are_refused(kept):
    report, scan, reference = loaded(kept)
    mask = files.load_mask(kept / "mask.npy")
    row, column = np.argwhere(np.isfinite(scan).all(axis=2))[0]
    other = scan.copy()
    other[row, column, 2] = np.nextafter(other[row, column, 2], np.float32(0))
    with pytest.raises(InputError, match="scan: expected the inspection's, XXH3 "):
        repeat(report, other, reference, mask)
    with pytest.raises(InputError, match="reference: expected the inspection's, XXH3 "):
        repeat(report, scan, scan, mask)
    with pytest.raises(InputError, match=r"scan: expected the shape of the inspection's, \(480, 640, 3\)"):
        repeat(report, scan.reshape(-1, 3), reference, mask)
    with pytest.raises(InputError, match="mask: expected one, as the inspection had, but got none"):
        repeat(report, scan, reference)
    with pytest.raises(InputError, match="mask: expected the inspection's"):
        repeat(report, scan, reference, ~mask)
    with pytest.raises(InputError, match="report: expected one with the record of its inspection"):
        repeat(dataclasses.replace(report, trace=None), scan, reference)


def test_the_command_tells_by_its_exit_code(kept, monkeypatch):
    monkeypatch.chdir(kept)
    files_given = ["--scan", "scan.pcd", "--reference", "reference.npy", "--mask", "mask.npy"]
    good = CliRunner().invoke(app, ["repeat", "layup.json", *files_given])
    assert good.exit_code == 0, good.output
    assert "the same to the bit" in good.output
    bad = CliRunner().invoke(app, ["repeat", "layup.json", *files_given[:3], "scan.pcd", *files_given[4:]])
    assert bad.exit_code == 2
    assert "reference: expected the inspection's" in bad.stderr
