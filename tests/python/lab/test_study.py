"""The study runs end to end, and its tables hold what they say."""

import csv
import io
import itertools
import runpy
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from debulk import InputError, solve
from debulk.recipe import Recipe
from lab import study
from lab.study.plan import AS_INSPECTED
from lab.study.runs import Row
from lab.study.summary import lines, profile


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    stages = []
    results = study.solver(folder, quick=True, progress=lambda stage, done: stages.append(done), pictures=False)
    assert stages == sorted(stages)
    assert stages[-1] == 1.0
    return results, folder


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What `main` says of one layup with its two largest pockets, and the folder that it wrote."""
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("main")
    small = replace(study.Plan.quick(), pockets=2)
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(study.Plan, "quick", classmethod(lambda cls: small))
        study.main(folder, quick=True)
    return out.getvalue(), err.getvalue(), folder


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_setting_meets_every_pocket(quick):
    results, folder = quick
    methods = [name for name in solve.methods() if name != "auto"]
    sweeps = {s.sweep for s in results.settings}
    assert sweeps == {"nodes", "tolerance", "starts", "stiffness", "method"}
    assert {line.label.split()[0] for line in results.sweep("method")} == set(methods)
    runs = read(folder / "runs.csv")
    assert len(runs) == len(results.settings) * results.plan.pockets
    for line in results.lines:
        mine = [r for r in runs if (r["sweep"], r["label"]) == (line.sweep, line.label)]
        assert len({(r["layup"], r["pocket"]) for r in mine}) == line.pockets == results.plan.pockets


def test_pockets_inside_the_ply_get_one_start_as_in_an_inspection(quick):
    results, _ = quick
    held = {(case.layup, case.pocket): case.laid.held for case, _ in results.solved}
    rows = [r for r in results.rows if (r.sweep, r.label) == ("starts", AS_INSPECTED)]
    assert len(rows) == len(held) and any(held.values())
    for row in rows:
        assert row.starts == 1 if held[row.layup, row.pocket] else row.starts >= Recipe().solve.starts


def test_lines_sum_up_the_runs_as_written(quick):
    _, folder = quick
    runs = read(folder / "runs.csv")
    for line in read(folder / "settings.csv"):
        mine = [r for r in runs if (r["sweep"], r["label"]) == (line["sweep"], line["label"])]
        times = [float(r["cpu_ms"]) for r in mine]
        assert float(line["cpu_median_ms"]) == pytest.approx(np.median(times), rel=1e-3)
        assert float(line["cpu_p99_ms"]) == pytest.approx(max(times), rel=1e-3)
        assert int(line["failed"]) == sum(r["certified"] == "False" for r in mine)
        assert float(line["rms_error_mean_mm"]) == pytest.approx(
            np.mean([float(r["rms_error_mm"]) for r in mine]), rel=1e-3, abs=1e-9
        )
        assert float(line["undecided"]) == pytest.approx(np.mean([r["verdict"] == "undecided" for r in mine]), rel=1e-3)


def test_errors_are_against_the_reference_of_the_same_net(quick):
    _, folder = quick
    references = {(r["layup"], r["pocket"], r["node_target"]): r for r in read(folder / "references.csv")}
    for run in read(folder / "runs.csv"):
        size = run["label"] if run["sweep"] == "nodes" else "100"
        reference = references[run["layup"], run["pocket"], size]
        assert run["nodes"] == reference["nodes"]
        for name in ("rms", "ridge"):
            error = abs(float(run[f"{name}_mm"]) - float(reference[f"{name}_mm"]))
            assert float(run[f"{name}_error_mm"]) == pytest.approx(error, abs=2e-4)


def test_the_reference_is_the_certified_start_of_least_energy(quick):
    results, _ = quick
    assert {case.node_target for case, _ in results.references} == set(results.plan.node_targets)
    for case, reference in results.references:
        good = [s for s in reference.starts if s.certified]
        best = min(good, key=lambda s: s.energy_mj)
        assert reference.solution.energy_mj == best.energy_mj
        assert reference.figures == best.figures
        assert solve.certify(case.sheet, reference.solution.nodes_mm).certified
        assert reference.gap(case.sheet.energy(case.net.nodes_mm)) == pytest.approx(1.0)
        assert all(reference.gap(s.energy_mj) >= 0 for s in good)
        if case.node_target == 100:
            plan = results.plan
            assert len(reference.starts) == 1 + plan.reference_starts * len(plan.amplitudes)


def test_ranges_grow_with_the_starts(quick):
    results, _ = quick
    for amplitude in results.plan.amplitudes:
        found = [g for g in results.growth if g.amplitude == amplitude]
        assert [g.starts for g in found] == [1, 2, 3, 4, 5]
        assert found[0].rms_range_mm == found[0].ridge_range_mm == 0
        for fewer, more in itertools.pairwise(found):
            assert more.cpu_ms > fewer.cpu_ms
        assert found[-1].rms_range_mm >= found[1].rms_range_mm
        assert found[-1].energy_gap <= found[0].energy_gap
    # All starts of one size: what the references hold.
    every = [
        np.ptp([s.figures.rms_mm for s in r.starts if s.certified and s.amplitude in (0.0, 0.1)])
        for _, r in results.solved
    ]
    assert results.growth[-1].amplitude == 0.1
    assert results.growth[-1].rms_range_mm == pytest.approx(np.mean(every))
    for p in results.perturbations:
        assert 1 <= p.minima <= p.starts == results.plan.reference_starts


def test_rules_ask_for_more_starts_only_where_a_limit_is_close(quick):
    results, folder = quick
    usual = Recipe().verdict
    found = {(r.starts, r.most_starts): r for r in results.rules if r.rms_margin_mm == usual.rms_margin_mm}
    assert len(read(folder / "rules.csv")) == len(results.rules)
    narrow, *_, wide = [r for r in results.rules if (r.starts, r.most_starts) == (3, 3)][1:]
    assert narrow.rms_margin_mm < usual.rms_margin_mm < wide.rms_margin_mm
    assert narrow.undecided <= found[3, 3].undecided <= wide.undecided
    assert {(1, 1), (2, 2), (3, 3), (4, 4), (2, 4)} <= set(found)
    assert max(most for _, most in found) <= results.plan.reference_starts + 1  # no more than there are
    for (first, most), rule in found.items():
        assert first <= rule.starts_mean <= max(first, most)
        assert rule.false_cease <= rule.overconfident <= 1 - rule.undecided
    few, rule, most = found[2, 2], found[2, 4], found[4, 4]
    assert few.cpu_mean_ms <= rule.cpu_mean_ms < most.cpu_mean_ms
    assert few.undecided <= rule.undecided <= most.undecided


def test_perturbed_starts_keep_to_the_mold_and_repeat(quick):
    case = quick[0].references[0][0]
    moved = case.perturbed(0.1, 3)
    fixed = case.net.kinds == 1
    assert np.array_equal(moved[fixed], case.net.nodes_mm[fixed])
    step = (moved - case.net.nodes_mm)[~fixed, :2] / case.net.spacing_mm
    assert 0.05 < np.abs(step).max() <= 0.1
    assert case.sheet.gaps(moved)[~fixed].min() > -1e-9
    assert np.array_equal(moved, case.perturbed(0.1, 3))
    assert not np.array_equal(moved, case.perturbed(0.1, 4))


TITLES = ("Tolerance", "Starts", "Stiffness", "Method", "Nodes", "Several minima", "Rules", "References", "Layups")


def test_the_printed_tables_say_what_the_csv_files_hold(printed):
    text, progress, folder = printed
    for title in TITLES:
        assert f"\n{title}" in text
    assert max(len(line) for line in text.splitlines()) < 200
    lines = [line.split() for line in text.splitlines()]
    counted = [line for line in lines if line[:1] == ["all"]]
    assert len(counted) == 1 and int(counted[0][1]) > 0  # no table is empty
    shown = 0
    for line in read(folder / "settings.csv"):
        if line["sweep"] == "nodes":
            continue  # another table, of other columns
        expected = [*line["label"].split(), line["pockets"], line["failed"], f"{float(line['starts_mean']):.1f}"]
        shown += any(words[: len(expected)] == expected for words in lines)
    assert shown == sum(line["sweep"] != "nodes" for line in read(folder / "settings.csv")) > 10
    assert progress.splitlines()[-1] == "100 %  tables"
    assert (folder / "rules.png").exists()


def row(**values):
    base = Row(
        sweep="method", label="a", layup=0, pocket=1, nodes=100, certified=True, compliant=False, status="converged",
        starts=1, iterations=1, evaluations=1, net_ms=1.0, cpu_ms=1.0, length_error=0.0, energy_gap=0.0, rms_mm=0.2,
        ridge_mm=0.1, rms_range_mm=0.0, ridge_range_mm=0.0, rms_error_mm=0.0, ridge_error_mm=0.0, verdict="cease",
        reference_verdict="cease", reference_verdict_of_all="cease",
    )  # fmt: skip
    return replace(base, **values)


def test_profile_counts_failures_and_ratios():
    rows = [
        row(label="a", pocket=1, cpu_ms=10.0),
        row(label="b", pocket=1, cpu_ms=40.0),
        row(label="a", pocket=2, cpu_ms=30.0, certified=False),
        row(label="b", pocket=2, cpu_ms=20.0),
        row(label="a", pocket=3, cpu_ms=6.0, energy_gap=0.2),
        row(label="b", pocket=3, cpu_ms=9.0),
        row(label="a", pocket=4, cpu_ms=5.0, certified=False),
        row(label="b", pocket=4, cpu_ms=5.0, certified=False),
        row(label="a", pocket=5, cpu_ms=5.0),  # the other was not given it
    ]
    inf = np.inf
    assert profile(rows, ["a", "b"], inf) == {"a": [1.0, 1.0, inf, inf], "b": [1.0, 1.5, 4.0, inf]}
    assert profile(rows, ["a", "b"], 0.01) == {"a": [1.0, inf, inf, inf], "b": [1.0, 1.0, 4.0, inf]}


@pytest.mark.parametrize(
    ("verdict", "reference", "of_all", "flipped", "overconfident"),
    [
        ("cease", "crease", "crease", True, False),
        ("crease", "cease", "undecided", True, True),
        ("cease", "cease", "undecided", False, True),
        ("undecided", "crease", "undecided", False, False),
        ("crease", "undecided", "undecided", False, True),
        ("invalid", "cease", "cease", False, False),
        ("cease", "", "", False, False),
    ],
)
def test_flips_and_overconfidence(verdict, reference, of_all, flipped, overconfident):
    one = row(verdict=verdict, reference_verdict=reference, reference_verdict_of_all=of_all)
    assert (one.flipped, one.overconfident) == (flipped, overconfident)
    (line,) = lines([one, row(pocket=2)])
    assert (line.flipped, line.overconfident) == (flipped / 2, overconfident / 2)


def test_pictures_are_drawn(quick, tmp_path):
    pytest.importorskip("matplotlib")
    from lab.study.pictures import draw

    draw(quick[0], tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"work_precision.png", "methods.png", "nodes.png", "minima.png", "rules.png"}
    for name in names:
        image = cv2.imread(str(tmp_path / name))
        assert min(image.shape[:2]) > 400
        assert image.std() > 5


def test_profiles_count_pockets_and_stress_cases(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    script = Path(__file__).parents[3] / "bench" / "study" / "profiles.py"
    monkeypatch.setattr(sys, "path", [*sys.path])  # it adds the stress cases' folder
    main = runpy.run_path(str(script))["main"]
    main(["--count", "4", "--pockets", "1", "--deadline", "0.3", "--out", str(tmp_path)])
    runs = read(tmp_path / "profile.csv")
    methods = [name for name in solve.methods() if name != "auto"]
    problems = {r["problem"] for r in runs}
    assert {r["group"] for r in runs} == {"pockets", "stress cases"}
    assert len(runs) == len(methods) * len(problems)
    for problem in problems:
        mine = [r for r in runs if r["problem"] == problem]
        assert {r["method"] for r in mine} == set(methods)
        gaps = [float(r["energy_gap"]) for r in mine if r["certified"] == "True"]
        assert not gaps or min(gaps) == 0.0
    text = (tmp_path / "profile.txt").read_text(encoding="utf-8")
    assert text.count("interior_point  ") >= 3
    assert cv2.imread(str(tmp_path / "profile.png")).std() > 5


def test_scans_are_compared_pair_by_pair():
    script = runpy.run_path(str(Path(__file__).parents[3] / "bench" / "study" / "scans.py"))
    seen = [
        script["Seen"]("the recipe", 0, repeat, pocket, verdict, 0.2 + 0.01 * repeat, 0.5, 2, 1.0)
        for pocket, verdicts in enumerate((("cease", "crease", "crease"), ("undecided", "crease", "undecided")))
        for repeat, verdict in enumerate(verdicts)
    ]
    line = next(line for line in script["table"](seen, 1, 3).splitlines() if line.split()[:3] == ["the", "recipe", "2"])
    # Of six pairs two are opposite and two differ otherwise; RMS differ by 0.01, 0.02 and 0.01.
    assert line.split()[2:] == ["2", "2.0", "33.3%", "6", "33.33%", "33.33%", "0.0133", "0.000", "–"]


def bench(name):
    return runpy.run_path(str(Path(__file__).parents[3] / "bench" / "study" / name))


def test_every_part_of_the_range_round_the_limit_weighs_the_same():
    script = bench("limit.py")

    def said(truth_mm, verdict):
        return script["Row"](0, "", truth_mm, verdict, truth_mm, 0.02, "excess", "")

    edges = np.linspace(0.3, 0.9, 13)
    rows = [said(mm + 0.01, "cease" if mm < 0.6 else "crease") for mm in edges[:-1] for _ in range(3)]
    assert script["share"](rows, ("undecided",)) == (0.0, 0.0)
    assert not any(script["wrong"](r) for r in rows)
    rows += [said(0.61, "undecided")] * 3  # half of the six in the seventh of twelve parts
    part, error = script["share"](rows, ("undecided",))
    assert part == pytest.approx(0.5 / 12)
    assert error == pytest.approx(np.sqrt(0.25 / 6) / 12)
    assert script["wrong"](said(0.61, "cease")) and script["wrong"](said(0.59, "crease"))


def test_bad_input_is_named(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="layups: expected at least one"):
        study.solver(tmp_path, layups=[], quick=True, pictures=False)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"out_dir: .* cannot be made"):
        study.solver(tmp_path / "file" / "below", quick=True, pictures=False)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InputError, match=r"matplotlib is missing.*debulk\[bench\]"):
        study.solver(tmp_path, quick=True)
