"""Claims: the trials that they need, and verdicts that follow from the trials."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from bs4 import BeautifulSoup

from experiments.config import ConfigError, load_sweep
from experiments.grid import evaluations
from studies.claims import (
    check_cells,
    decide,
    draw,
    plan,
    plan_replicates,
    populations,
    statements,
    verdict,
)
from studies.statements import Criterion

from .conftest import CLAIMS


def test_the_plan_holds_the_cells_and_metrics_of_every_claim_and_no_more():
    planned = {
        (sweep.name, tuple(sweep.changes.split())): sweep for sweep in plan(CLAIMS.needed(0))
    }
    wanted = {key: evaluations(sweep) for key, sweep in planned.items()}
    assert set(planned) == {claim.trials for claim in CLAIMS.needed(0)}
    for key, sweep in planned.items():
        assert set().union(*wanted[key].values()) == set(sweep.metrics)
    # Single cells, worked out by hand.
    fewer = wanted["maa_vs_pas_outliers", ()]
    assert {cell.n_outliers for cell in fewer if cell.sigma_t in (0.02, 0.08)} == {0, 50}
    large = "trajectory_length", ("volume_per_camera=10",)
    assert planned[large].volume_per_camera == 10
    assert {metric for metrics in wanted[large].values() for metric in metrics} == {
        *("ATE", "DTE", "mAA", "TAS", "d")
    }


def test_replicates_differ_in_their_number_alone():
    tables = plan_replicates(CLAIMS, ["trials=7"], range(3))
    assert len(tables) == 3
    first, *_, last = tables
    assert {sweep.replicate for sweep in last} == {2}
    assert {sweep.trials for sweep in last} == {7}
    assert tuple(replace(sweep, replicate=0) for sweep in last) == first
    assert len(first) == len({claim.trials for claim in CLAIMS.needed(0)})


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("metrics=[TAS]", "'metrics' cannot be set: the claims decide"),
        ("n_outliers=[0,1]", "needs trials of outliers with n_outliers 10"),
        ("trials=0", "'trials': should be greater than or equal to 1, not 0 (experiment="),
        ("trails=1", "Could not override 'trails'"),
    ],
)
def test_settings_that_leave_claims_undecided_are_refused(override, problem):
    with pytest.raises(ConfigError) as caught:
        plan_replicates(CLAIMS, [override], [0])
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "minimum"),
    [
        ({"level": ["n_cameras"]}, 2),
        ({"level": ["sigma_t", "n_cameras"]}, 2),
        ({"where": {"sigma_t": [0.05]}, "level": ["sigma_t"]}, 2),
        (
            {
                "statistic": "initial response",
                "level": ["sigma_t"],
                "where": {"n_outliers": [0], "sigma_t": [0.01, 0.1]},
            },
            3,
        ),
    ],
)
def test_a_claim_needs_levels_to_compare(change, minimum):
    """Else it would have a verdict on nothing, after all trials."""
    name = "outliers-tas-discerns"
    with pytest.raises(ConfigError, match=f"'{name}' compares levels of .*, at least {minimum},"):
        check_cells(replace(CLAIMS.claims[name], **change), load_sweep(["experiment=outliers"]))


NUMBER = CLAIMS.claims["outliers-range-maa"]  # -74
SMALL = CLAIMS.claims["combined-range-pas-rotation"]  # 13
POWER = CLAIMS.claims["outliers-tas-discerns"]  # at least 0.5
WEAK = CLAIMS.claims["outliers-ate-blind"]  # below 0.5
WITHIN = CLAIMS.claims["thresholds-ras-lower"]  # within 20


def trials_of(outliers, metric, shrunk_by=0.0):
    """Make up trials of a metric whose range shrinks by a share under 50 outliers."""
    rows = [
        {"n_cameras": 100, "n_outliers": n, "sigma_t": sigma, "sigma_r_deg": 3.0, "trial": trial}
        | {metric: (1 - shrunk_by * (n == 50)) * (trial - 3.5) / 7 + 1e-6 * sigma}
        for n in outliers
        for sigma in (0.01, 0.03, 0.05, 0.07, 0.1)
        for trial in range(8)
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("claim", "values", "expected"),
    [
        (NUMBER, [-75, -74, -73], "reproduced"),
        (NUMBER, [-74.4, -74.45, -74.48], "reproduced"),  # -74 is rounded
        (NUMBER, [-74.6, -74.7, -74.65] * 2, "not reproduced"),
        (NUMBER, [-71, -72, -70], "inconclusive"),  # three studies cannot exclude a fourth of -74
        (NUMBER, [-71, -72, -70] * 10, "not reproduced"),
        (NUMBER, [-120, 40, -74], "inconclusive"),  # not even the direction is certain
        (NUMBER, [np.nan, -74, -74], "inconclusive"),
        (SMALL, [12, 13, 14] * 10, "reproduced"),
        (SMALL, [6, 13, 20] * 10, "inconclusive"),  # an interval wider than the number itself
        # The central 95 % leave out one of 41 on either side, but not one of 21.
        (POWER, [0.4] + [0.55] * 20, "inconclusive"),
        (POWER, [0.4] + [0.55] * 40, "reproduced"),
        (POWER, [0.9, 0.8], "reproduced"),
        (POWER, [0.4, 0.3], "not reproduced"),
        (POWER, [0.6, 0.4], "inconclusive"),
        (WEAK, [0.1, 0.2], "reproduced"),
        (WEAK, [0.6, 0.7], "not reproduced"),
        (WITHIN, [-19, 19], "reproduced"),
        (WITHIN, [-40, -30], "not reproduced"),
        (WITHIN, [10, 40], "inconclusive"),
    ],
)
def test_verdicts(claim, values, expected):
    assert verdict(claim, np.array(values, dtype=float)) == expected


@pytest.mark.parametrize(
    ("claim", "values", "expected"),
    [
        # Means of 0.52 and 0.48 with a standard error of 0.01 each are 2 of these from the bound.
        (POWER, [0.5, 0.54] * 2, "open"),
        (POWER, [0.59, 0.6, 0.61] * 2, "true"),
        (WEAK, [0.59, 0.6, 0.61] * 2, "false"),
        (NUMBER, [-74.1, -74, -73.9] * 2, "true"),  # between -74.5 and -73.5
        (NUMBER, [-76.1, -76, -75.9] * 2, "false"),  # though one study may well show it
        (WITHIN, [0, 1, -1] * 2, "true"),
        (POWER, [np.nan, 0.9], "open"),
    ],
)
def test_populations(claim, values, expected):
    assert populations([claim], [np.array(values, dtype=float)]) == [expected]


def test_the_more_claims_the_less_is_certain():
    """The p-value of a mean of 0.6 with a standard error of 0.0283, 0.024, is no news of three."""
    values = np.array([0.52, 0.56, 0.6, 0.64, 0.68])
    assert populations([POWER], [values]) == ["true"]
    assert populations([POWER] * 3, [values] * 3) == ["open"] * 3
    assert populations([POWER] * 2, [values, values + 0.3]) == ["true"] * 2  # Holm steps down


def test_every_reading_has_both_verdicts():
    """Single trials scatter less under outliers; their means rise with the noise all the same."""
    table = trials_of([0, 50], "mAA", shrunk_by=0.74)
    decisions = [decision for decision in CLAIMS.decisions if decision.id in ("range", "volume")]
    subset = {"a": NUMBER, "b": replace(NUMBER, implied_by=["a"])}
    claims = replace(CLAIMS, claims=subset, decisions=decisions, replicates_of_readings=2)
    verdicts, readings, _ = decide(claims, [{NUMBER.trials: table}] * 3)
    assert verdicts["ours"].tolist() == pytest.approx([-74, -74], abs=0.01)
    assert verdicts["verdict"].tolist() == ["reproduced"] * 2
    assert verdicts["population"].tolist() == ["true"] * 2
    assert readings["reading"].tolist() == ["mean curve"] * 2
    assert readings["verdict"].tolist() == ["not reproduced"] * 2
    assert readings["claim"].tolist() == ["a", "b"]
    assert readings["replicates"].map(str).tolist() == ["2"] * 2  # not 2.0


def test_a_reading_may_have_more_replicates_than_the_others():
    table = trials_of([0, 50], "mAA", shrunk_by=0.74)
    (decision,) = [entry for entry in CLAIMS.decisions if entry.id == "range"]
    longer = replace(decision.readings[1], replicates=3)
    decision = replace(decision, readings=[decision.readings[0], longer])
    claims = replace(CLAIMS, claims={"a": NUMBER}, decisions=[decision], replicates_of_readings=2)
    _, readings, _ = decide(claims, [{NUMBER.trials: table}] * 3)
    assert readings["replicates"].tolist() == [3]


def test_a_statement_is_reproduced_if_all_of_its_claims_are():
    words = ["reproduced", "inconclusive", "not reproduced", "reproduced"]
    table = pd.DataFrame({"sentence": list("aabb"), "verdict": words, "population": "true"})
    table = table.assign(source="Figure 2", implied_by=[None, None, None, "x"])
    summary = statements(table)
    assert summary["verdict"].tolist() == ["inconclusive", "not reproduced"]
    assert summary["claims"].tolist() == [2, 1]


def test_trials_of_all_replicates_are_pooled():
    """The range of each study is 1 before and 0.5 after; of both together it is 3 and 0.5."""
    first = trials_of([0, 50], "mAA", shrunk_by=0.5)
    second = first.assign(mAA=first["mAA"] + 2 * (first["n_outliers"] == 0))
    claims = replace(CLAIMS, claims={"a": NUMBER}, decisions=[])
    verdicts, *_ = decide(claims, [{NUMBER.trials: table} for table in (first, second)])
    assert verdicts["ours"].tolist() == pytest.approx([-50], abs=0.1)
    assert verdicts["pooled"].tolist() == pytest.approx([-100 * 2.5 / 3], abs=0.1)


def test_other_bounds_change_verdicts():
    """A range that changes by 10 %: within 20, and not within 5."""
    claim = replace(NUMBER, paper=None, criterion="within 20")
    claims = replace(
        CLAIMS,
        claims={"moves": claim, "number": NUMBER},
        criteria=[Criterion("insensitive", 20, [5, 15])],
        decisions=[],
    )
    table = trials_of([0, 50], "mAA", shrunk_by=0.1)
    *_, decided = decide(claims, [{NUMBER.trials: table}] * 2)
    assert decided["other"].tolist() == [5, 15]
    assert decided["claims"].tolist() == [1, 1]  # not the one without a bound
    assert decided["changed"].tolist() == [1, 0]
    assert decided["changes"].tolist() == ["moves: not reproduced", ""]


def test_the_page_begins_with_what_is_not_reproduced_and_has_every_claim():
    names = ("outliers-range-maa", "outliers-tas-discerns-outliers", "line-range-pas-outliers")
    subset = {name: CLAIMS.claims[name] for name in names}
    table = pd.DataFrame(
        [
            {key: getattr(claim, key) for key in ("id", "source", "sentence", "statement", "unit")}
            | {"paper": claim.paper, "criterion": claim.criterion, "statistic": claim.describe()}
            | {"implied_by": None, "replicates": 20, "ours": -48.4, "low": -53.0, "high": -44.0}
            | {"mean_low": -50.0, "mean_high": -46.0, "population": "true", "verdict": "reproduced"}
            for claim in subset.values()
        ]
    )
    table.loc[2, ["verdict", "population"]] = ["not reproduced", "false"]
    page = BeautifulSoup(draw(table), "html.parser")
    (failure,) = [item.get_text(" ", strip=True) for item in page.find_all("li")]
    assert failure.startswith("✗ not reproduced The range of the PAS is 59 % smaller")
    assert failure.endswith("Paper: −59 %; ours: −48.4 [−53.0, −44.0]")
    assert [row["id"] for row in page.find_all("tr", id=True)] == [
        "outliers-tas-discerns-outliers",  # the introduction comes before figure 2
        "outliers-range-maa",
        "line-range-pas-outliers",
    ]
    sections = [heading.get_text() for heading in page.find_all("h3")]
    assert sections[0] == "1 Introduction"
    assert "<html" not in draw(table, whole=False)
