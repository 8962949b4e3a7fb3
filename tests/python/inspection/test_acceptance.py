"""The main job on virtual layups that nothing was chosen on, against their truth."""

from __future__ import annotations

import numpy as np
import pytest

from debulk import Inspector, scenes
from debulk.verdict import Verdict

# Limits of the errors: of every peak in mm, of the median and the worst area and volume as shares. Over all pockets,
# those with a drop-out at the rim or in the noise included; what noise alone does stands in bench/front/accuracy.txt.
SIZES = {
    (1280, 960): {"peak": 0.15, "area": (0.0025, 0.016), "volume": (0.0025, 0.016)},
    (5120, 3840): {"peak": 0.05, "area": (0.001, 0.009), "volume": (0.001, 0.008)},
}
# No other test, study or bench looks at these layups: no limit and no method was chosen on them.
HELD_OUT = (8201, 8202, 8203)


@pytest.mark.parametrize("pixels", SIZES, ids=["1.2 Mpx", "20 Mpx"])
@pytest.mark.parametrize("seed", HELD_OUT)
def test_the_fourteen_pockets_and_no_decoy(pixels, seed):
    limits = SIZES[pixels]
    layup = scenes.layup(seed, pixels)
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    report = inspector.inspect(layup.scan)
    truth = layup.truth.pockets

    own = [p for p in report.pockets if not p.promoted]
    assert [p.id for p in report.pockets] == list(range(1, len(report.pockets) + 1))
    assert [p.id for p in own] == list(range(1, 15))
    for found, true in zip(own, truth, strict=True):
        assert np.linalg.norm(_centroid(found.outline_mm) - _centroid(true.outline_mm)) < 0.5
        assert found.touches_ply_edge == true.touches_ply_edge
        assert found.peak_mm == pytest.approx(true.peak_mm, abs=limits["peak"])
    area_error = [abs(p.area_mm2 / t.area_mm2 - 1) for p, t in zip(own, truth, strict=True)]
    volume_error = [abs(p.volume_mm3 / t.volume_mm3 - 1) for p, t in zip(own, truth, strict=True)]
    for what, error in (("area", area_error), ("volume", volume_error)):
        median, worst = limits[what]
        assert np.median(error) < median
        assert max(error) < worst

    # The decoys are dropped, at their places, for what stood against them; one that no cut reaches is not there at all.
    dropped = inspector.find(layup.scan).dropped
    against = {"below CutHeight": set(), "below AreaTol": {"area"}, "below PeakTol": {"peak"}}
    for decoy in layup.truth.decoys:
        near = [d for d in dropped if np.linalg.norm(d.centroid_mm - decoy.centre_mm) < 3.0]
        assert len(near) == len(against[decoy.kind])
        for bump in near:
            assert against[decoy.kind] <= set(bump.reason.split(" and "))
            # A small, steep one holds enough excess for a ridge, and is judged all the same.
            judged = [p for p in report.pockets[14:] if np.linalg.norm(_centroid(p.outline_mm) - decoy.centre_mm) < 3.0]
            assert len(judged) == 1 or decoy.kind == "below PeakTol"

    for p in report.pockets:
        assert p.solve is not None
        assert p.solve.certified, (p.id, p.solve.doubt)
        assert p.solve.kkt_error <= 1e-4
        longer = 1e-3 if p.solve.compliant else 1e-4  # a small steep bump needs fibres that give way
        assert p.solve.length_error <= longer
        assert p.solve.penetration_mm <= 1e-3
        assert 90 <= p.node_count <= 300  # more than the target where the outline would hold too few of them
        assert np.all(np.abs(_lengths(p.net.nodes_mm, p.net.edges) / p.spacing_mm - 1) < 1e-9)
        assert np.all(np.abs(_lengths(p.debulked_mm, p.net.edges) / p.spacing_mm - 1) < longer)
    assert report.coverage > 0.99
    assert Verdict.worst(p.verdict for p in own) is Verdict.CREASE  # a bump with many drop-outs may be INVALID
    closing = [p.id for p in own if p.verdict.value == "cease"]
    assert 4 <= len(closing) <= 9
    # Shallow pockets have too little excess length for any ridge, the steepest too much for none.
    for found, true in zip(own, truth, strict=True):
        if true.straight_excess_mm < 0.2:
            assert found.verdict.value == "cease", found.reason
        if true.straight_excess_mm > 2.4:
            assert found.verdict.value == "crease", found.reason


def _lengths(nodes, edges):
    return np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1)


def _centroid(outline):
    ahead = np.roll(outline, -1, axis=0)
    cross = outline[:, 0] * ahead[:, 1] - ahead[:, 0] * outline[:, 1]
    return ((outline + ahead) * cross[:, None]).sum(axis=0) / (3 * cross.sum())
