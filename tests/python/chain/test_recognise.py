"""A scan is compared with its qualified chain, in the inspector and apart from it; the chain is read from its file."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

import debulk
from debulk import InputError, Verdict
from debulk.chain import Chain, Figure, Signature, recognised
from debulk.page.report import page
from debulk.report import Report
from debulk.results.trace import Trace
from html_reader import read

SEEN = Signature(
    pitch_mm=1.3, noise_mm=0.05, near=-0.04, middle=-0.03, far=-0.01, repeated=0.0, step_mm=0.0, missing=0.02,
    edge_mm=-0.1,
)  # fmt: skip
LIMITS = {
    "pitch_mm": (1.2, 1.4), "noise_mm": (0.035, 0.065), "near": (-0.1, 0.02), "middle": (-0.1, 0.03),
    "far": (-0.08, 0.05), "repeated": (None, 0.012), "step_mm": (None, 0.0005), "missing": (0.005, None),
    "edge_mm": (-0.8, 0.5), "image": (0.5, 1.5),
}  # fmt: skip


def chain(**limits):
    spans = LIMITS | limits
    figures = tuple(
        Figure(name=name, mean=getattr(SEEN, name), sd=0.0, low=low, high=high) for name, (low, high) in spans.items()
    )
    return Chain(name="cell 3", made_utc="2026-03-01T12:00:00.000Z", debulk="0.1.0", scans=10, figures=figures)


def test_the_same_chain_is_recognised():
    found = recognised(SEEN, chain())
    assert found.findings == ()
    assert found.left_out == ()
    assert len(found.report.figures) == len(LIMITS)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"pitch_mm": 2.6}, "coarser"),
        ({"noise_mm": 0.02}, "smoother"),
        ({"noise_mm": 0.1}, "noisier"),
        ({"near": 0.4}, "smoother"),
        ({"repeated": 0.04}, "ranked by a median"),
        ({"step_mm": 0.01}, "rounded"),
        ({"missing": 0.0}, "filled"),
        ({"edge_mm": 1.0}, "blurred"),
    ],
)
def test_another_chain_is_invalid_and_says_what_differs(change, word):
    (finding,) = recognised(replace(SEEN, **change), chain()).findings
    assert (finding.check, finding.at_best) == ("chain", Verdict.INVALID)
    assert finding.measured == next(iter(change.values())) != finding.limit
    assert f"it is {word} (" in finding.reason
    assert "cell 3, 2026-03-01" in finding.reason


def test_what_is_not_known_is_never_the_same():
    nan = float("nan")
    unseen = Signature(1.3, nan, nan, nan, nan, nan, nan, nan)
    found = recognised(unseen, chain())
    assert [finding.at_best for finding in found.findings] == [Verdict.UNDECIDED]
    assert any("not seen" in entry.what for entry in found.left_out)
    assert recognised(replace(SEEN, edge_mm=nan), chain()).findings == ()


def test_a_chain_survives_its_file(tmp_path):
    chain().save(tmp_path / "chain.json")
    again = Chain.load(tmp_path / "chain.json")
    assert again == chain()
    assert again.sha256 == chain().sha256 != chain(near=(0.0, 1.0)).sha256


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"format": "debulk chain 9"}, "format: expected 'debulk chain 1', got 'debulk chain 9'"),
        ({"scans": 0}, "scans: expected a number"),
        ({"scan": 4}, "scan: not a known setting; did you mean scans"),
        ({"figures": [{"name": "near", "mean": "x", "sd": 0.0, "low": None, "high": None}]}, "figures.0.mean"),
    ],
)
def test_a_wrong_chain_is_refused(tmp_path, change, says):
    chain().save(tmp_path / "chain.json")
    text = (tmp_path / "chain.json").read_text()
    (tmp_path / "chain.json").write_text(json.dumps(json.loads(text) | change))
    with pytest.raises(InputError, match=says):
        Chain.load(tmp_path / "chain.json")
    (tmp_path / "chain.json").write_text(text[:100])
    with pytest.raises(InputError, match="not valid JSON"):
        Chain.load(tmp_path / "chain.json")
    with pytest.raises(InputError, match="cannot be read"):
        Chain.load(tmp_path / "none.json")
    with pytest.raises(InputError, match=r"ending in \.json"):
        chain().save(tmp_path / "chain.toml")


def test_another_file_of_debulk_is_named_by_its_format_alone(tmp_path):
    Report(verdict=Verdict.CEASE, reason="", pockets=()).save(tmp_path / "layup.json")
    with pytest.raises(InputError, match=r"layup\.json: format: expected 'debulk chain 1', got 'debulk report'$"):
        Chain.load(tmp_path / "layup.json")


def blurred(scan):
    """Return the scan with its ranges averaged over 3 by 3 pixels."""
    depth = scan[..., 2].astype(np.float64)
    seen = np.isfinite(depth)
    with np.errstate(invalid="ignore"):
        mean = cv2.blur(np.where(seen, depth, 0.0), (3, 3)) / cv2.blur(seen.astype(np.float64), (3, 3))
    return (scan * (mean / depth)[..., None]).astype(np.float32)


@pytest.mark.layup
def test_an_inspector_compares_its_scans():
    layup = debulk.scenes.layup(seed=1, pixels=(640, 480))
    seen = chain(pitch_mm=(1.9, 2.3))
    inspector = debulk.Inspector(
        None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, chain=seen
    )
    report = inspector.inspect(layup.scan)
    assert report.verdict is Verdict.CREASE
    assert report.chain.sha256 == seen.sha256
    assert not any(figure.differs for figure in report.chain.figures)
    smooth = inspector.inspect(blurred(layup.scan))
    assert smooth.verdict is Verdict.INVALID
    assert "smoother" in smooth.reason
    half = layup.scan.copy()
    half[:, ::2] = np.nan
    holed = inspector.inspect(half)
    assert holed.verdict is Verdict.INVALID
    assert holed.reason.startswith("the scan does not come from the chain"), holed.reason
    again = debulk.repeat(report, layup.scan, layup.reference, chain=seen)
    assert again.same, again.differences
    with pytest.raises(InputError, match="chain: expected that of the inspection"):
        debulk.repeat(report, layup.scan, layup.reference)
    loose = inspector.inspect(layup.scan[np.isfinite(layup.scan[..., 2])])
    assert loose.verdict is Verdict.INVALID
    assert "it is a list of points" in loose.reason


@pytest.mark.layup
def test_without_a_chain_the_report_says_so():
    layup = debulk.scenes.layup(seed=1, pixels=(640, 480))
    report = debulk.inspect(layup.scan, layup.reference, None, layup.ply_outline, (0, 90), layup.mold_from_scanner)
    assert report.chain is None
    assert any("chain that measures" in entry.what for entry in report.left_out)
    with pytest.raises(InputError, match=r"chain: expected a debulk\.Chain"):
        debulk.Inspector(None, layup.reference, chain="chain.json")


def test_the_page_of_a_report_shows_how_it_compares():
    found = recognised(replace(SEEN, step_mm=0.01), chain())
    report = Report(
        verdict=Verdict.INVALID, reason="", pockets=(), trace=Trace(time_utc="2026-03-01T12:00:00Z"), chain=found.report
    )
    text = " ".join(" ".join(read(page(report)).text).split())
    assert "ROUNDED step of the depths 0.01 mm, qualified at most 0.0005" in text
    assert "cell 3, 2026-03-01" in text
    assert "qualified chain none was given" in " ".join(" ".join(read(page(replace(report, chain=None))).text).split())
