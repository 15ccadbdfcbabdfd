"""The claims are complete, well formed, and refused in one line where they are not."""

import json
from copy import deepcopy
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from experiments.config import ConfigError
from studies import statistics
from studies.claims.claims import CLAIMS_FILE, Reading, load_claims
from studies.claims.verdicts import evaluate_claim
from studies.paper import FIGURES

# The percentages in the captions of figures 2, 6 and 7.
PAPER = [-74, -51, -66, 13, -84, 14, -75, -50, -94, -55, -74, -59, -73, -24]


def test_the_percentages_of_the_captions_are_there() -> None:
    claims = load_claims().claims.values()
    assert [claim.paper for claim in claims if claim.paper is not None] == PAPER


def test_every_claim_has_a_figure_that_shows_its_experiment() -> None:
    for claim in load_claims().claims.values():
        assert claim.experiment in FIGURES[claim.figure]


def test_numbers_stand_in_the_statements_too() -> None:
    for claim in load_claims().claims.values():
        if claim.paper is not None:
            word = "smaller" if claim.paper < 0 else "greater"
            assert f"{abs(claim.paper):g} % {word}" in claim.statement


def test_a_decision_shows_what_else_its_claims_would_say() -> None:
    """A reading that leaves out groups of trials can only ease what all of them must show."""
    claims = load_claims()
    for decision in claims.decisions:
        taken, *others = decision.readings
        assert all(taken.of(claim) == claim for claim in claims.claims.values())
        for reading in others:
            changed = claims.under(decision, reading)
            assert changed
            named = {
                name
                for name in decision.claims
                if not reading.experiments or claims.claims[name].experiment in reading.experiments
            }
            assert not named or set(changed) == named
            for claim in changed.values():
                lax = reading.where and not set(reading.where) & {*claim.level, *claim.at}
                assert not lax or (claim.take, claim.bound[0]) != ("smallest", "at least")


def test_a_reading_changes_what_it_names_alone() -> None:
    claims = load_claims().claims
    pooled = Reading("pooled", metrics={"mAA": "mAA(pooled=true)"})
    assert pooled.of(claims["outliers-range-maa"]).metric == "mAA(pooled=true)"
    assert pooled.of(claims["outliers-tas-steadier"]).versus == "mAA(pooled=true)"
    assert pooled.of(claims["outliers-range-tas"]) == claims["outliers-range-tas"]
    own = replace(claims["outliers-range-maa"], metric="mAA(pooled=false)")
    assert pooled.of(own) == own
    on_lines = Reading("ray", experiments=["collinear"], settings=["geometry=ray"])
    assert on_lines.of(claims["collinear-maa-weak"]).settings == ["geometry=ray"]
    assert on_lines.of(claims["line-maa-discerns"]) == claims["line-maa-discerns"]
    everywhere = Reading("all noise", everywhere=True)
    assert everywhere.of(claims["length-tas-much-below-dte"]).at == {}
    especially = claims["length-tas-below-dte-especially"]  # compares some noise with all
    assert everywhere.of(especially) == especially
    distance = Reading("distance", metrics={"TAS": "HalfDistance"}, level=["n_outliers"])
    assert distance.of(claims["outliers-tas-discerns"]).metric == "HalfDistance"
    assert distance.of(claims["outliers-tas-discerns"]).level == ["n_outliers"]
    ordered = Reading("order", statistics={"size of range change": "size of order change"})
    assert ordered.of(claims["outliers-tas-steadier"]).statistic == "size of order change"
    means = Reading("means", of_means=True)
    assert means.of(claims["outliers-range-maa"]).of_means
    assert not means.of(claims["outliers-tas-discerns"]).of_means


def test_claims_that_follow_from_others_are_so_by_their_criteria() -> None:
    """By "much", by "much" and "especially", by two numbers, or since it takes fewer cells."""
    claims = load_claims().claims
    implied = [claim for claim in claims.values() if claim.implied_by]
    assert len(implied) == 26
    for claim in implied:
        others = [claims[name] for name in claim.implied_by]
        assert not any(other.implied_by for other in others)
        if "steadier" in claim.id and len(others) == 2:
            maa, ours = (other.paper for other in others)
            assert [other.metric for other in others] == [claim.versus, claim.metric]
            assert maa is not None
            assert ours is not None
            assert abs(ours) < abs(maa)
        elif len(others) == 2:
            much, more = others
            assert {(o.metric, o.versus) for o in (claim, much, more)} == {
                (claim.metric, claim.versus)
            }
            assert (much.criterion, more.criterion) == ("below 50", "below 0")
            assert (much.at, more.at) == ({}, claim.at)
            assert claim.criterion in (much.criterion, "below 0")
        elif claim.versus:
            (other,) = others
            assert (other.metric, other.versus) == (claim.metric, claim.versus)
            assert (other.criterion, claim.criterion) == ("below 50", "below 0")
        else:
            (other,) = others
            assert (other.metric, other.criterion) == (claim.metric, claim.criterion)
            for key, values in claim.where.items():
                wider = other.take != "smallest" or other.bound[0] == "at least"
                part = set(values) <= set(other.where.get(key, values))
                assert part if wider else set(values) >= set(other.where.get(key, values))


def test_a_reading_leaves_fewer_cells_to_a_claim() -> None:
    claim = load_claims().claims["outliers-tas-beats-dte"]
    reading = Reading("0, 1, 50", where={"n_outliers": [0, 1, 50]})
    assert reading.of(claim).where == {**claim.where, "n_outliers": [1, 50]}
    everywhere = replace(claim, where={})
    assert reading.of(everywhere).where == {"n_outliers": [0, 1, 50]}


def test_claims_that_are_compared_are_judged_in_the_same_cells() -> None:
    claims = load_claims().claims
    cells = {
        source: {str(claim.where) for name, claim in claims.items() if name.startswith(source)}
        for source in ("rotations-", "combined-ras-", "combined-maa-both", "combined-pas-both")
    }
    assert len(cells["rotations-"]) == 1
    assert cells["combined-ras-"] == cells["combined-maa-both"] == cells["combined-pas-both"]


def test_replicates_can_be_set_but_one_is_none() -> None:
    assert load_claims(3).replicates == 3
    for wrong in (1, 0, "many", 2.5, True):
        with pytest.raises(ConfigError, match="'replicates' must be a whole number"):
            load_claims(wrong)  # type: ignore[arg-type]


CONTENT = yaml.safe_load(CLAIMS_FILE.read_text())
CLAIM = ["groups", 0, "claims", 0]
DECISION = ["decisions", 0]


@pytest.fixture
def content() -> Any:
    return deepcopy(CONTENT)


def refusal(tmp_path: Path, content: Any) -> str:
    path = tmp_path / "claims.yaml"
    path.write_text(json.dumps(content))  # JSON is YAML, and sooner written
    with pytest.raises(ConfigError) as caught:
        load_claims(path=path)
    error = str(caught.value)
    assert "\n" not in error
    before, found, problem = error.partition("claims.yaml: ")
    assert found
    assert before in ("", f"{tmp_path}/")
    return problem


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"statement": None}, "statement: should be a valid string, not None"),
        ({"statistic": "mean"}, "statistic: must be one of range change, "),
        ({"statistic": "range change"}, "needs 'before' for its statistic"),
        ({"level": []}, "needs 'level' for its statistic"),
        ({"level": "sigma"}, "level.0: must be one of n_cameras, "),
        ({"experiment": "outlier"}, "experiment: must be one of collinear, "),
        ({"metric": "TAS(threshold=1)"}, "has no option 'threshold'"),
        ({"metric": []}, "metric: should be a valid string"),
        ({"versus": "APE"}, "versus: unknown metric 'APE'"),
        ({"take": "median"}, "take: must be one of smallest, largest, mean, not 'median'"),
        (
            {"where": {"outliers": [1]}},
            "where: has the key 'outliers', which must be one of n_cameras",
        ),
        ({"where": {"n_outliers": 1}}, "where.n_outliers: should be a valid list, not 1"),
        ({"where": {"n_outliers": []}}, "where.n_outliers: needs 1 or more entries, not []"),
        ({"where": {"n_outliers": ["few"]}}, "where.n_outliers.0: should be a valid number"),
        ({"paper": -74}, "needs either a number of the paper or a criterion"),
        ({"criterion": None}, "needs either a number of the paper or a criterion"),
        ({"criterion": "about 0.5"}, "needs a criterion such as at least or below or within 0.5"),
        ({"criterion": "below five"}, "needs a criterion such as"),
        ({"criterion": "at least nan"}, "needs a criterion such as"),
        ({"remark": "-"}, "remark: is unknown"),
        ({"at": {"sigma_t": [0.01]}}, "has 'at', which its statistic does not take"),
        ({"of_means": "often"}, "of_means: should be a valid boolean"),
    ],
    ids=str,
)
def test_a_broken_claim_is_named_in_one_line(
    tmp_path: Path, content: Any, change: dict[str, Any], problem: str
) -> None:
    content["groups"][0]["claims"][0].update(change)
    error = refusal(tmp_path, content)
    assert problem in error
    assert error.startswith("'outliers-ate-discerns': ")


@pytest.mark.parametrize(
    ("place", "value", "problem"),
    [
        (["groups"], "all", "groups should be a valid list, not 'all'"),
        (["groups"], ..., "groups is missing"),
        (["decisions"], None, "decisions should be a valid list"),
        (["groups", 0], "Figure 2", "groups.0 needs key: value"),
        (["groups", 0, "claims"], None, "groups.0.claims should be a valid list"),
        (["groups", 0, "figure"], ..., "groups.0.figure is missing"),
        (CLAIM, "The ATE discerns.", "groups.0.claims.0 needs key: value"),
        ([*CLAIM, "id"], ..., "a claim of Figure 2: id: is missing"),
        ([*CLAIM, "id"], "outliers-ate-blind", "'outliers-ate-blind' is defined twice"),
        ([*CLAIM, "statement"], ..., "'outliers-ate-discerns': statement: is missing"),
        ([*CLAIM, "statistic"], ..., "'outliers-ate-discerns': statistic: is missing"),
        ([*CLAIM, "metric"], ..., "'outliers-ate-discerns': metric: should be a valid string"),
        (DECISION, "volume", "decisions.0 needs key: value, not 'volume'"),
        ([*DECISION, "remark"], "-", "'volume': remark: is unknown"),
        ([*DECISION, "readings"], ..., "'volume': readings: is missing"),
        ([*DECISION, "readings"], [], "'volume': readings: needs 2 or more entries, not []"),
        ([*DECISION, "readings", 0], "n/10", "'volume': readings.0: needs key: value"),
        ([*CLAIM, "implied_by"], ["no"], "'outliers-ate-discerns' is implied by no claim: 'no'"),
        ([*DECISION, "readings", 0, "settings"], 5, "'volume': readings.0.settings: should be a"),
        ([*DECISION, "claims"], ["no-such"], "'volume' names no claim: 'no-such'"),
        (
            [*DECISION, "readings", 0, "where"],
            {"sigma_t": [0.5]},
            "'volume', 'volume n/10', 'outliers-ate-discerns': where.sigma_t: needs 1 or more",
        ),
        (
            [*DECISION, "readings", 0, "metrics"],
            {"mAA": "mAA(steps=1)"},
            "'volume': readings.0.metrics.mAA: metric 'mAA(steps=1)' has",
        ),
    ],
    ids=str,
)
def test_a_broken_structure_is_named_in_one_line(
    tmp_path: Path, content: Any, place: list[Any], value: Any, problem: str
) -> None:
    *parents, last = place
    parent = content
    for key in parents:
        parent = parent[key]
    if value is ...:
        del parent[last]
    else:
        parent[last] = value
    assert refusal(tmp_path, content).startswith(problem)


def test_a_broken_file_is_named_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "claims.yaml"
    path.write_text("[")
    with pytest.raises(ConfigError, match=f"^cannot read {path}: [^\n]*$"):
        load_claims(path=path)


def test_a_statistic_is_one_entry_of_the_registry(
    tmp_path: Path, content: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its name is known to the file, its keys are asked for, its function decides."""

    def largest(trials: pd.DataFrame, metric: str, versus: str) -> float:
        return float(trials[metric].max() - trials[versus].min())

    entry = statistics.Statistic(largest, "largest {metric} above {versus}")
    monkeypatch.setitem(statistics.STATISTICS, "largest", entry)
    given = {"id": "{metric}-new", "statistic": "largest", "metric": ["TAS", "PAS(weight=1)"]}
    claim = {**given, "statement": "{metric}.", "criterion": "below 1", "where": {"sigma_t": [1]}}
    content["groups"] = [{**content["groups"][0], "claims": [claim]}]
    content["decisions"] = []
    assert "needs 'versus' for its statistic" in refusal(tmp_path, content)
    claim["versus"] = "ATE"
    (tmp_path / "claims.yaml").write_text(json.dumps(content))
    claims = load_claims(path=tmp_path / "claims.yaml").claims
    new = claims["tas-new"]
    assert set(claims) >= {"tas-new", "pas-weight-1-new"}
    assert claims["pas-weight-1-new"].statement == "PAS(weight=1)."
    assert new.describe() == "largest TAS above ATE (sigma_t 1)"
    trials = pd.DataFrame({"sigma_t": [1, 1, 2], "TAS": [5, 4, 9], "ATE": [2, 1, 0]})
    assert evaluate_claim(new, trials) == 4


@pytest.mark.parametrize(
    ("name", "text", "interval"),
    [
        (
            "combined-range-pas-rotation",
            "change of the range of PAS, % (sigma_r_deg 1 → sigma_r_deg 9)",
            (12.5, 13.5),
        ),
        (
            "outliers-ate-blind",
            "τ of ATE with sigma_t, positive where worse "
            "(n_outliers 1, sigma_t 0.01/0.03/0.05/0.07/0.1)",
            (-inf, 0.5),
        ),
        (
            "outliers-dte-degrades-slower",
            "τ of DTE minus ATE with sigma_t, positive where worse "
            "(mean; n_outliers 1/10/50, sigma_t 0.01/0.03/0.05/0.07/0.1)",
            (0.05, inf),
        ),
        (
            "thresholds-ras-lower",
            "width of the range of RAS(max_threshold_deg=8) relative to RAS, % "
            "(n_outliers 10, sigma_r_deg 1/5/10)",
            (-20, 20),
        ),
    ],
)
def test_claims_in_words_and_the_interval_in_which_they_hold(
    name: str, text: str, interval: tuple[float, float]
) -> None:
    claim = load_claims().claims[name]
    assert (claim.describe(), claim.interval) == (text, interval)
