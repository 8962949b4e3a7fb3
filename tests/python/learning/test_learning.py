"""A hidden limit is recovered, its interval holds it as often as it says, and outcomes become a proposal."""

import importlib.util
import json
import math
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize
import scipy.stats
from typer.testing import CliRunner

from debulk import InputError
from debulk.cli import app
from debulk.history import History
from debulk.history.check import record_hash
from debulk.history.overview import overview
from debulk.history.rows import LayupRow, OutcomeRow, PocketRow, as_tuples, digest
from debulk.history.search import Search
from debulk.history.tables import connected
from debulk.learning import Outcomes, calibrate, pod, posterior
from debulk.learning.calibration import Costs, cost_limit_mm
from debulk.learning.likelihood import Prior
from debulk.learning.text import as_json, text
from debulk.recipe import Recipe
from debulk.results.report import ExcessReport, PocketReport
from debulk.ridge import excess_of_ridge
from debulk.risk import risk
from debulk.verdict import Verdict
from lab.sampled_risk import sampled

BENCH = Path(__file__).resolve().parents[3] / "bench" / "learning" / "coverage.py"


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("coverage_of_learning", BENCH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_hidden_limit_is_recovered_and_its_interval_holds_it(bench):
    """Of 200 repetitions 190 ± 3 are expected within the interval; below 181 are one in a thousand."""
    found = bench.recovered("logistic", 60, 200)
    assert found["within"] >= 190 and abs(found["bias"]) < 0.01
    assert found["holds"] >= 181 and found["width"] < 0.1


def test_the_posterior_without_outcomes_is_the_prior():
    none = posterior(Outcomes(np.zeros(0), np.zeros(0), np.zeros(0, bool)), Prior(limit_mm=0.8, limit_sd_mm=0.1))
    assert none.limit_mm == pytest.approx(0.8, abs=1e-3) and none.limit_sd_mm == pytest.approx(0.1, abs=1e-3)
    low, high = none.interval_mm()
    assert (low, high) == pytest.approx((0.8 - 0.196, 0.8 + 0.196), abs=2e-3)


def test_the_posterior_agrees_with_a_sum_written_out():
    ridge, noise, creased = np.array([0.5, 0.7]), np.array([0.0, 0.03]), np.array([False, True])
    limits, spreads = np.linspace(0.01, 2.0, 399), np.geomspace(0.005, 0.5, 41)
    total = np.zeros((399, 41))
    for i, limit in enumerate(limits):
        for j, spread in enumerate(spreads):
            p = math.exp(-0.5 * ((limit - 0.6) / 0.3) ** 2 - 0.5 * (math.log(spread / 0.06) / math.log(2)) ** 2)
            for h, sd, c in zip(ridge, noise, creased, strict=True):
                z = (h - limit) / (math.sqrt(3) / math.pi * math.hypot(spread, sd))
                p *= 1 / (1 + math.exp(-z if c else z)) if abs(z) < 700 else float((z > 0) == c)
            total[i, j] = p
    total /= total.sum()
    found = posterior(Outcomes(ridge, noise, creased))
    np.testing.assert_allclose(found.weights, total, atol=1e-12)
    assert found.creases(0.6)[0] == pytest.approx(0.5, abs=0.05)


def test_costs_move_the_proposal():
    rng = np.random.default_rng(0)
    ridge = rng.uniform(0.3, 1.0, 200)
    found = posterior(Outcomes(ridge, np.zeros(200), ridge > 0.65 + 0.05 * rng.logistic(size=200)))
    dear, fair, cheap = (cost_limit_mm(found, Costs(missed, 1.0)) for missed in (100.0, 1.0, 0.01))
    assert dear < fair < cheap
    assert fair == pytest.approx(found.limit_mm, abs=0.02)
    with pytest.raises(InputError, match="costs"):
        Costs(0.0, 1.0)


# --- detection ---


def test_the_curve_is_that_of_the_largest_likelihood():
    rng = np.random.default_rng(4)
    size = rng.uniform(0.2, 1.2, 90)
    hit = rng.random(90) < 1 / (1 + np.exp(-(4 + 7 * np.log(size))))
    found = pod(size, hit)

    def cost(b):
        z = b[0] + b[1] * np.log(size)
        return np.logaddexp(0, np.where(hit, -z, z)).sum()

    best = scipy.optimize.minimize(cost, [1.0, 1.0], method="BFGS")
    assert (found.b0, found.b1) == pytest.approx(best.x, rel=1e-4)
    assert found.at(found.a50_mm) == pytest.approx(0.5) and found.at(found.a90_mm) == pytest.approx(0.9)
    # a90/95 by the likelihood ratio: the best curve through POD = 90 % there is worse by half of 2.7055.
    through = scipy.optimize.minimize_scalar(
        lambda b1: cost([math.log(9) - b1 * math.log(found.a90_95_mm), b1]), bounds=(0.1, 100), method="bounded"
    )
    assert through.fun - best.fun == pytest.approx(0.5 * 2.705543, abs=1e-3)


def test_the_bound_of_a90_is_above_it_as_often_as_it_says(bench):
    above, refused, *_ = bench.detected(120, 60)
    assert refused <= 1 and above >= 48  # 55 ± 2 were counted in the bench


@pytest.mark.parametrize(
    ("size", "hit", "part"),
    [
        ([0.1, 0.2], [True, True], "2 hits of 2"),
        ([0.1, 0.2], [False, True], "every hit is larger than every miss"),
        ([0.3, 0.2, 0.1], [False, True, True], "does not rise"),
        ([0.0, 0.2], [False, True], "positive sizes"),
        ([0.1, 0.2], [True], "one per size"),
    ],
)
def test_what_gives_no_curve_is_named(size, hit, part):
    with pytest.raises(InputError, match=part):
        pod(size, hit)


# --- a history ---


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    """200 layups of one pocket each, the limit being 0.72 mm; what became of every third is known."""
    there = History(tmp_path_factory.mktemp("learning") / "cell.sqlite")
    rng, previous = np.random.default_rng(5), "0" * 64
    with connected(there.path, write=True) as connection:
        for number in range(1, 201):
            ridge = float(rng.uniform(0.2, 1.1))
            creased = ridge > 0.72 + 0.04 * rng.normal()
            verdict = "CREASE" if ridge > 0.63 else "CEASE"
            made = [
                LayupRow(
                    number, "", "", "", verdict, "", 1, int(ridge > 0.63), 0, 0, 1.0, None, None, None, None, None, 0.0,
                    "", "", "", "",
                ),
                PocketRow(number, 1, verdict, "excess", 0.0, 0.0, 9.0, 5.0, ridge, ridge, ridge, 0.004, 0),
                PocketRow(number, 2, verdict, "paper", 0.0, 0.0, 9.0, 5.0, 9.0, 9.0, 9.0, None, 1),
            ]  # fmt: skip
            if number % 3 == 0:
                measured = "CREASE" if creased else "CEASE"
                peak = ridge + 0.1 * rng.normal()
                made += [
                    OutcomeRow(number, number, 1, "scan", verdict, "CEASE" if creased else "CREASE", ridge, peak, 1.0),
                    OutcomeRow(number, number, 1, "operator", verdict, measured, ridge, peak, 1.0),
                    OutcomeRow(number, number, 2, "scan", verdict, "CEASE", 9.0, 1.0, 1.0),
                ]
                made.pop(3)
            tables = as_tuples(made)
            header = (number, "report", None, "", digest(tables), previous)
            previous = record_hash(header, b"")
            connection.execute("INSERT INTO record VALUES (?, ?, ?, ?, ?, ?, ?)", (*header, previous))
            for name, lines in tables.items():
                connection.executemany(f"INSERT INTO {name} VALUES ({', '.join('?' * len(lines[0]))})", lines)
    return there


def test_a_history_gives_a_proposal(history):
    found = calibrate(history)
    assert len(found.outcomes) == 66
    low, high = found.posterior.interval_mm()
    assert low < 0.72 < high and abs(found.posterior.limit_mm - 0.72) < 0.05
    assert 0.5 < found.limit_mm < 0.72 and found.excess_mm == pytest.approx(
        2 * (found.limit_mm - 0.4292 * 0.3), abs=1e-3
    )
    assert found.validated.own <= found.validated.present and -0.69 < found.validated.log_score < 0
    narrow = calibrate(history, wanted_mm=0.005)
    assert 0 < narrow.more_best < narrow.more_usual
    assert narrow.best_mm[0] < 0.72 < narrow.best_mm[1]
    assert all(
        record % 3 and pocket == 1 and narrow.best_mm[0] <= h <= narrow.best_mm[1] for record, pocket, h in narrow.ask
    )
    assert [record for record, _, _ in narrow.ask] == sorted((record for record, _, _ in narrow.ask), reverse=True)
    assert found.detected is not None and found.detected.total == 66


def test_the_number_that_is_needed_is_about_right(bench):
    """After as many more outcomes at the best ridges as it says the interval is about as narrow as was wanted."""
    rng = np.random.default_rng(6)
    _, _, known = bench.virtual(rng, "logistic", 60)
    found = posterior(known)
    lacking = (1.96 / 0.02) ** 2 - 1 / found.limit_sd_mm**2
    count = math.ceil(lacking / found.information(found.limit_mm)[0])
    widths = []
    for _ in range(10):
        hidden, spread = found.limit_mm, found.spread_mm
        ridge = np.full(count, found.limit_mm)
        creased = ridge > hidden + spread * rng.logistic(0, math.sqrt(3) / math.pi, count)
        more = Outcomes(
            np.append(known.ridge_mm, ridge),
            np.append(known.noise_mm, np.zeros(count)),
            np.append(known.creased, creased),
        )
        low, high = posterior(more).interval_mm()
        widths.append(0.5 * (high - low))
    assert np.mean(widths) == pytest.approx(0.02, rel=0.35)


@pytest.mark.parametrize("ridge_mm", [0.5, 0.6, 0.65, 0.7, 0.72, 0.75, 0.8, 0.9])
def test_probabilities_by_the_proposed_recipe_are_those_of_the_posterior(history, ridge_mm):
    """Summed over all limits and spreads, each logistic; a normal law of the same variance is within 0.023 of that."""
    found, thickness_mm, noise_mm = calibrate(history), 0.3, 0.004
    recipe = found.proposed(Recipe(uncertainty={"thickness_share": 0, "height_share": 0, "angle_deg": 0}))
    excess_mm = excess_of_ridge(ridge_mm, thickness_mm)
    known = ExcessReport(
        length_mm=excess_mm, height_mm=ridge_mm, range_mm=(ridge_mm, ridge_mm), alone_mm=ridge_mm, elastic_mm=1.0,
        noise_mm=noise_mm, uncertainty_mm=0.02, bridge_bound_mm=0.0, missed_mm=0.0,
    )  # fmt: skip
    one = PocketReport(
        id=1, verdict=Verdict.CEASE, reason="", decided_by="excess", excess=known, outline_mm=np.zeros((0, 2)),
        area_mm2=1.0, peak_mm=1.0, volume_mm3=1.0,
    )  # fmt: skip
    expected = found.posterior.creases(ridge_mm, noise_mm)[0]
    assert risk([one], None, recipe).pockets[1] == pytest.approx(expected, abs=0.04)
    assert sampled([one], None, recipe, 4000).pockets[1] == pytest.approx(expected, abs=0.05)


def test_probabilities_by_proposed_recipes_come_true_as_often_as_they_say(bench):
    """Of 100 hidden limits, each learned from 60 outcomes and asked of 100 more pockets, by sixths of what is said."""
    rng, said, was = np.random.default_rng(8), [], []
    for _ in range(100):
        limit, spread, known = bench.virtual(rng, "normal", 60)
        found = posterior(known)
        sd_mm = math.hypot(found.limit_sd_mm, found.spread_mm)  # what Calibrated.proposed writes, and risk adds
        ridge = rng.uniform(limit - 0.15, limit + 0.15, 100)
        said.append(scipy.stats.norm.cdf((ridge - found.limit_mm) / sd_mm))
        was.append(ridge > limit + spread * rng.normal(size=100))
    p, true = np.concatenate(said), np.concatenate(was)
    for low in np.arange(6) / 6:
        here = (p >= low) & (p < low + 1 / 6)
        assert p[here].mean() == pytest.approx(true[here].mean(), abs=0.05)


def test_what_a_scan_did_not_decide_is_no_outcome(tmp_path):
    """Ten pockets creased; what became of ten lower ones a coarse scan left open, and of one of them it was said."""
    there = History(tmp_path / "c.sqlite")
    with connected(there.path, write=True) as connection:
        for number in range(1, 21):
            ridge, measured = (0.9, "CREASE") if number <= 10 else (0.5, "UNDECIDED")
            connection.execute(
                "INSERT INTO pocket VALUES (?, 1, 'CEASE', 'excess', 0, 0, 9, 5, ?, ?, ?, 0.004, 0)",
                (number, ridge, ridge, ridge),
            )
            row = (number, number, measured, ridge)
            connection.execute("INSERT INTO outcome VALUES (?, ?, 1, 'scan', 'CEASE', ?, ?, 0.5, 1)", row)
    with pytest.raises(InputError, match="got 10 creased of 10, and 10 that are UNDECIDED or INVALID: run"):
        calibrate(there)
    with connected(there.path, write=True) as connection:
        connection.execute("INSERT INTO outcome VALUES (30, 20, 1, 'operator', 'CEASE', 'CEASE', 0.5, NULL, NULL)")
    found = calibrate(there)
    assert (len(found.outcomes), int(found.outcomes.creased.sum()), found.undecided) == (11, 10, 9)
    assert {record for record, *_ in found.ask} <= set(range(11, 20))
    assert text(found).startswith("11 outcomes, 10 of them creased, and 9 that are UNDECIDED or INVALID")
    assert json.loads(as_json(found))["undecided"] == 9
    with connected(there.path, write=True) as connection:  # measured again, by a scan that could not tell
        for record, report in ((31, 1), (32, 20)):
            row = (record, report, 0.9)
            connection.execute("INSERT INTO outcome VALUES (?, ?, 1, 'scan', 'CEASE', 'UNDECIDED', ?, 0.9, 1)", row)
    found = calibrate(there)  # takes back what an earlier scan seemed to show, and not what somebody said
    assert (len(found.outcomes), int(found.outcomes.creased.sum()), found.undecided) == (10, 9, 10)
    with connected(there.path) as connection:  # the page of the history counts the same outcomes
        shown = overview(connection, Search()).outcomes
    assert shown == {("CEASE", "CREASE"): 9, ("CEASE", "UNDECIDED"): 10, ("CEASE", "CEASE"): 1}


def test_too_few_or_equal_outcomes_are_refused(tmp_path, report):
    there = History(tmp_path / "c.sqlite")
    there.add(report)
    of_pockets = "expected at least 10 outcomes of pockets that their excess decided"
    with pytest.raises(InputError, match=f"{of_pockets}, some creased and some not, but got 0 creased of 0"):
        calibrate(there)


def test_outcomes_of_plies_of_another_thickness_do_not_count(tmp_path, report):
    """No limit carries over: a ridge is half an excess and 0.43 thicknesses. Ten outcomes of each of three plies."""
    there = History(tmp_path / "c.sqlite")
    for k, changed in enumerate(({}, {"thickness_mm": 0.2}, {"bulk_factor": 1.1})):
        material = {**report.recipe["material"], **changed}
        record = there.add(report.changed(recipe={**report.recipe, "material": material}))
        with connected(there.path, write=True) as connection:
            for pocket in range(101, 111):
                measured, ridge = ("CREASE", 0.7 - 0.1 * k) if pocket % 2 else ("CEASE", 0.6 - 0.1 * k)
                row = (record, pocket, ridge, ridge, ridge)
                connection.execute(
                    "INSERT INTO pocket VALUES (?, ?, 'CEASE', 'excess', 0, 0, 9, 5, ?, ?, ?, 0.004, 0)", row
                )
                row = (record, record, pocket, measured, ridge)
                connection.execute("INSERT INTO outcome VALUES (?, ?, ?, 'scan', 'CEASE', ?, ?, 0.5, 1)", row)
    thick, thin, denser = calibrate(there), calibrate(there, thickness_mm=0.2), calibrate(there, bulk_factor=1.1)
    assert [(len(one.outcomes), one.others) for one in (thick, thin, denser)] == [(10, 20)] * 3
    ridges = [sorted(set(one.outcomes.ridge_mm.round(3).tolist())) for one in (thick, thin, denser)]
    assert ridges == [[0.6, 0.7], [0.5, 0.6], [0.4, 0.5]]
    said = "and 20 of plies of another thickness or bulk factor"
    assert text(thin).startswith(f"10 outcomes, 5 of them creased, {said}")
    assert json.loads(as_json(thin))["others"] == 20
    with pytest.raises(InputError, match="got 0 creased of 0, and 30 of plies of another thickness or bulk factor"):
        calibrate(there, thickness_mm=0.5)


def test_the_command_proposes_and_changes_nothing(history, tmp_path):
    before = history.path.read_bytes()
    (tmp_path / "cell.toml").write_text("[net]\nnode_target = 60\n")
    words = ["calibrate", history.path, "--recipe", tmp_path / "cell.toml", "-o", tmp_path / "proposed.toml"]
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    proposed = Recipe.load(tmp_path / "proposed.toml")
    found = calibrate(history)
    known = found.posterior
    learned = {"crease_mm": known.limit_mm, "limit_mm": known.limit_sd_mm, "spread_mm": known.spread_mm}
    assert proposed == Recipe(
        net={"node_target": 60}, verdict={"max_ridge_mm": found.limit_mm},
        uncertainty={name: round(value, 4) for name, value in learned.items()},
    )  # fmt: skip
    assert f"proposed: verdict.max_ridge_mm = {found.limit_mm:.2f}" in done.stdout
    assert (tmp_path / "cell.toml").read_text() == "[net]\nnode_target = 60\n"
    assert history.path.read_bytes() == before
    tree = json.loads(CliRunner().invoke(app, ["calibrate", str(history.path), "--json"]).stdout)
    assert tree["proposed_mm"] == found.limit_mm and tree["pod"]["total"] == 66
    for more, part in (("x.pdf", "ending in .toml"), ("no/x.toml", "no folder")):
        bad = CliRunner().invoke(app, ["calibrate", str(history.path), "-o", more])
        assert (bad.exit_code, bad.stderr.count("\n")) == (2, 1) and part in bad.stderr


def test_a_limit_that_every_ply_exceeds_is_none(history, tmp_path):
    """Where a missed crease costs so much that only ridges are worth passing that a ply without a wrinkle has."""
    words = ["calibrate", str(history.path), "--missed", "1e9"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0 and "proposed: no limit" in done.stdout
    assert "the proposed limit" not in done.stdout
    none = CliRunner().invoke(app, [*words, "-o", str(tmp_path / "proposed.toml")])
    assert (none.exit_code, none.stdout) == (2, done.stdout) and "not written" in none.stderr
    assert not (tmp_path / "proposed.toml").exists()


def test_the_least_limit_is_that_of_the_ply(history):
    """A proposal that the debulked ply itself exceeds is none: at a factor of 1 it keeps all its thickness."""
    proposed = calibrate(history).limit_mm
    none = calibrate(history, thickness_mm=proposed + 0.01, bulk_factor=1.0)
    assert none.limit_mm == 0
    with pytest.raises(InputError, match="no ridge is worth passing"):
        none.proposed(Recipe())
    assert calibrate(history, thickness_mm=proposed + 0.01, bulk_factor=1.1).limit_mm == proposed


def test_arguments_of_another_kind_are_named():
    with pytest.raises(InputError, match=r"outcomes: expected a debulk.learning.Outcomes, but got an array"):
        posterior(np.zeros(3))
    with pytest.raises(InputError, match=r"history: expected a debulk.history.History, but got 'cell.sqlite'"):
        calibrate("cell.sqlite")
    listed = Outcomes([0.3, 0.9], [0.01, 0.01], [False, True])
    arrays = Outcomes(np.array([0.3, 0.9]), np.array([0.01, 0.01]), np.array([False, True]))
    assert posterior(listed).limit_mm == posterior(arrays).limit_mm
