"""A virtual chain is qualified, its own scans are recognised afterwards, and so are those of another chain."""

import cv2
import numpy as np
import pytest

import debulk
from debulk import InputError, Verdict
from debulk.chain import Gauge, Signature, recognised
from debulk.chain.gauge import measured
from html_reader import read

pytestmark = pytest.mark.layup

PIXELS = (448, 336)
RECIPE = debulk.Recipe(solve={"when": "needed"})


@pytest.fixture(scope="module")
def layups():
    return [debulk.scenes.layup(1, PIXELS, repeat=k) for k in range(12)]


@pytest.fixture(scope="module")
def chain(layups):
    one = layups[0]
    return debulk.qualify(
        (of.scan for of in layups[:10]),
        one.reference,
        RECIPE,
        one.ply_outline,
        (0, 90),
        one.mold_from_scanner,
        name="cell 3",
        sessions=["monday"] * 5 + ["friday"] * 5,
    )


def inspector(layup, **options):
    return debulk.Inspector(RECIPE, layup.reference, layup.ply_outline, (0, 90), layup.mold_from_scanner, **options)


def test_the_chain_is_what_the_virtual_scanner_does(chain):
    assert chain.figure("noise_mm").mean == pytest.approx(0.05, rel=0.15)
    assert chain.figure("missing").mean == pytest.approx(0.02, rel=0.3)
    assert chain.figure("step_mm").mean == 0
    assert chain.image == PIXELS[::-1]
    assert chain.scans == 10


def test_pockets_repeat_and_so_do_verdicts(chain):
    assert [study.quantity for study in chain.studies] == ["area", "peak", "excess length", "ridge"]
    for study in chain.studies:
        assert (study.sessions, study.trials) == (2, 5)
        assert study.parts >= 10
    ridge = chain.studies[-1]
    assert ridge.tolerance == RECIPE.verdict.max_ridge_mm
    assert 0 < ridge.grr < 0.2
    assert chain.agreement.pockets >= ridge.parts
    assert 0.5 < chain.agreement.kappa <= 1


def test_further_scans_are_recognised_and_filtered_ones_are_not(chain, layups):
    own = inspector(layups[0], chain=chain)
    for layup in layups[10:]:
        report = own.inspect(layup.scan)
        assert not [one for one in report.chain.figures if one.differs]
        assert not any(finding.check == "chain" for finding in report.findings)
    depth = np.nan_to_num(layups[0].scan[..., 2].astype(np.float64), nan=float(np.nanmedian(layups[0].scan[..., 2])))
    scan = layups[0].scan * (cv2.medianBlur(depth.astype(np.float32), 3) / depth)[..., None]
    report = own.inspect(scan.astype(np.float32))
    assert report.verdict is Verdict.INVALID
    assert report.findings[0].check == "chain"


def test_the_page_shows_what_the_file_holds(chain, tmp_path):
    chain.save(tmp_path / "chain.json")
    chain.save(tmp_path / "chain.html")
    assert debulk.Chain.load(tmp_path / "chain.json") == chain
    html = (tmp_path / "chain.html").read_text(encoding="utf-8")
    text = " ".join(" ".join(read(html).text).split())
    for words in (
        "Chain cell 3",
        "10 scans of one layup",
        chain.sha256,
        "parts by sessions",
        "Fleiss's kappa",
        "rounded",
    ):
        assert words in text, words
    for doubt in chain.doubts:
        assert doubt in text
    assert "no gauge was scanned" in text


def test_what_is_no_qualification_is_refused(layups):
    scans = [one.scan for one in layups]
    one = layups[0]
    given = (one.reference, RECIPE, one.ply_outline, (0, 90), one.mold_from_scanner)
    with pytest.raises(InputError, match="scans: expected at least 10 of one unmoved layup, but got 9"):
        debulk.qualify(scans[:9], *given)
    with pytest.raises(InputError, match=r"scan 1 cannot be used: scan and reference are the same"):
        debulk.qualify([one.reference] * 10, *given)
    with pytest.raises(InputError, match="scan 2 is scan 1 again, bit for bit"):
        debulk.qualify([one.scan] * 10, *given)


def test_a_strip_is_measured_on_a_flat_plate():
    x, y = np.meshgrid(np.arange(0.0, 200.0), np.arange(0.0, 150.0))
    flat = np.dstack([x, y, np.zeros_like(x)]).astype(np.float32)
    plain = debulk.Inspector(RECIPE, flat)
    rng = np.random.default_rng(5)
    image = np.where(np.abs(y - 75) < 6, 0.5, 0.0)
    blurred = cv2.GaussianBlur(image, (0, 0), 1.5)
    scans = [
        (flat + np.dstack([0 * x, 0 * x, 0.98 * blurred + rng.normal(0, 0.03, x.shape)])).astype(np.float32)
        for _ in range(3)
    ]
    found = measured(Gauge(scans, (20.0, 75.0), (180.0, 75.0), 0.5, 11.0), plain)
    assert found.gain == pytest.approx(0.98, abs=0.01)
    assert found.blur_mm == pytest.approx(1.5, abs=0.15)
    assert found.excess is None
    as_ridge = measured(Gauge(scans, (20.0, 75.0), (180.0, 75.0), 0.5, 16.0, "ridge"), plain)
    assert as_ridge.shape == "ridge" and as_ridge.excess > 0
    with pytest.raises(InputError, match=r"gauge\.shape: expected one of"):
        Gauge(scans, (20.0, 75.0), (180.0, 75.0), 0.5, 11.0, "round")
    with pytest.raises(InputError, match="at least 3"):
        measured(Gauge(scans[:2], (20.0, 75.0), (180.0, 75.0), 0.5, 11.0), plain)
    with pytest.raises(InputError, match=r"gauge\.width_mm"):
        Gauge(scans, (20.0, 75.0), (180.0, 75.0), 0.5, 0.0)


def test_a_chain_that_smooths_recognises_a_raw_scan(chain):
    sharp = Signature(**{one.name: one.mean for one in chain.figures})
    smooth = {one.name: one for one in chain.figures} | {
        "near": chain.figure("near").model_copy(update={"mean": 0.4, "low": 0.34, "high": 0.46})
    }
    (finding,) = recognised(sharp, chain.model_copy(update={"figures": tuple(smooth.values())})).findings
    assert "less smooth" in finding.reason
