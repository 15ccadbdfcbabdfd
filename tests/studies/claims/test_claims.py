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
from figures import FIGURES
from studies import statistics
from studies.claims.claims import CLAIMS_FILE, Claim, Reading, load_claims
from studies.claims.verdicts import evaluate_claim

# The percentages in the captions of figures 2, 6 and 7.
PAPER = [-74, -51, -66, 13, -84, 14, -75, -50, -94, -55, -74, -59, -73, -24]


def test_the_percentages_of_the_captions_are_there() -> None:
    claims = load_claims().claims.values()
    assert [claim.paper for claim in claims if claim.paper is not None] == PAPER


def test_every_claim_has_a_figure_that_shows_its_experiment() -> None:
    for claim in load_claims().claims.values():
        assert f"trials/{claim.experiment}" in FIGURES[claim.figure]


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
        for name in decision.claims:
            claim = claims.claims[name]
            assert taken.of(claim) == claim
            for reading in others:
                assert reading.of(claim) != claim
                lax = reading.where and not set(reading.where) & set(claim.level)
                assert not lax or (claim.take, claim.bound[0]) != ("smallest", "at least")


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
CLAIM, DECISION = "'outliers-ate-discerns': ", "'volume': "
BROKEN: list[tuple[dict[str, Any], str]] = [
    ({"statistic": "mean"}, "statistic: unknown statistic 'mean'; they are range change, "),
    ({"statistic": None}, "statistic: should be a valid string, not None"),
    ({"level": []}, "needs 'level' for its statistic"),
    ({"level": "sigma"}, "level.0: unknown setting of a cell 'sigma'; they are n_cameras, "),
    ({"experiment": "outlier"}, "experiment: unknown experiment 'outlier'; they are collinear, "),
    ({"metric": "APE"}, "metric: unknown metric 'APE'"),
    ({"metric": "TAS(threshold=1)"}, "has no option 'threshold'"),
    ({"metric": []}, "metric: should be a valid string"),
    ({"metric": None}, "metric: should be a valid string"),
    ({"versus": "APE"}, "versus: unknown metric 'APE'"),
    ({"statement": None}, "statement: should be a valid string, not None"),
    ({"take": "median"}, "take: unknown 'take' 'median'; they are smallest, largest, mean"),
    ({"where": {"outliers": [1]}}, "where.outliers.[key]: unknown setting of a cell 'outliers'"),
    ({"where": {"n_outliers": 1}}, "where.n_outliers: should be a valid list, not 1"),
    ({"where": {"n_outliers": []}}, "where.n_outliers: List should have at least 1 item"),
    ({"where": {"n_outliers": ["few"]}}, "where.n_outliers.0: should be a valid number"),
    ({"where": 3}, "where: should be a valid dictionary, not 3"),
    ({"statistic": "range change"}, "needs 'before' for its statistic"),
    ({"statistic": "relative range"}, "needs 'versus' for its statistic"),
    ({"paper": -74}, "needs either a number of the paper or a criterion"),
    ({"paper": "less"}, "paper: should be a valid number"),
    ({"criterion": None}, "needs either a number of the paper or a criterion"),
    ({"criterion": "about 0.5"}, "needs a criterion such as at least or below or within 0.5"),
    ({"criterion": "below five"}, "needs a criterion such as"),
    ({"criterion": "at least nan"}, "needs a criterion such as"),
    ({"remark": "-"}, "remark: is unknown"),
    ({"of_means": "often"}, "of_means: should be a valid boolean"),
]


def refusal(tmp_path: Path, content: Any) -> str:
    path = tmp_path / "claims.yaml"
    path.write_text(json.dumps(content))  # JSON is YAML, and sooner written
    with pytest.raises(ConfigError) as caught:
        load_claims(path=path)
    error = str(caught.value)
    assert "claims.yaml" in error
    assert "\n" not in error
    return error


@pytest.fixture
def content() -> Any:
    return deepcopy(CONTENT)


@pytest.mark.parametrize(("change", "reason"), BROKEN, ids=[str(change) for change, _ in BROKEN])
def test_a_broken_claim_is_named_in_one_line(
    tmp_path: Path, content: Any, change: dict[str, Any], reason: str
) -> None:
    content["groups"][0]["claims"][0].update(change)
    error = refusal(tmp_path, content)
    assert error.startswith(f"claims.yaml: {CLAIM}")
    assert reason in error


@pytest.mark.parametrize("key", ["id", "statement", "statistic", "metric", "level", "criterion"])
def test_a_claim_without_a_key_it_needs_is_refused(tmp_path: Path, content: Any, key: str) -> None:
    del content["groups"][0]["claims"][0][key]
    error = refusal(tmp_path, content)
    assert key in error
    assert ("a claim of Figure 2: " if key == "id" else CLAIM) in error


def test_a_claim_that_stands_there_twice_is_refused(tmp_path: Path, content: Any) -> None:
    group = content["groups"][0]["claims"]
    group.append(group[0])
    assert "'outliers-ate-discerns' stands there twice" in refusal(tmp_path, content)


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (["groups"], None, "the file: groups: "),
        (["groups"], "all", "the file: groups: should be a valid list, not 'all'"),
        (["decisions"], None, "the file: decisions: "),
        (["replicates"], None, "the file: replicates: "),
        (["remark"], "-", "the file: remark: is unknown"),
        (["groups", 0], "Figure 2", "groups.0: should be a dictionary"),
        (["groups", 0, "claims"], None, "groups.0.claims: "),
        (["groups", 0, "figure"], None, "groups.0.figure: "),
        (["groups", 0, "remark"], "-", "groups.0.remark: is unknown"),
        (["groups", 0, "claims", 0], "The ATE discerns.", "groups.0.claims.0: should be a valid"),
        (["decisions", 0], "volume", "decisions.0: should be a valid dictionary, not 'volume'"),
        (["decisions", 0, "remark"], "-", DECISION + "remark: is unknown"),
        (["decisions", 0, "readings"], None, DECISION + "readings: "),
        (["decisions", 0, "readings"], [], DECISION + "readings: List should have at least 1"),
        (["decisions", 0, "readings", 0], "volume n/10", DECISION + "readings.0: should be a"),
        (["decisions", 0, "claims"], [], DECISION + "claims: List should have at least 1"),
        (["decisions", 0, "claims"], ["no-such"], "'volume' names no claim: 'no-such'"),
        (["decisions", 0, "readings", 0, "where"], {"sigma_t": [0.5]}, "length-maa-favours-large"),
        (["decisions", 0, "readings", 0, "metric"], "APE", DECISION + "readings.0.metric: unknown"),
    ],
    ids=str,
)
def test_a_broken_structure_is_named_in_one_line(
    tmp_path: Path, content: Any, path: list[Any], value: Any, named: str
) -> None:
    *parents, last = path
    place = content
    for key in parents:
        place = place[key]
    place[last] = value
    assert named in refusal(tmp_path, content)
    if value is None:
        del place[last]
        assert named in refusal(tmp_path, content)


@pytest.mark.parametrize("text", ["[", "claims: 3", ""])
def test_a_broken_file_is_named_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "claims.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"claims\.yaml") as caught:
        load_claims(path=path)
    assert "\n" not in str(caught.value)


def test_a_statistic_is_one_entry_of_the_registry(
    tmp_path: Path, content: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its name is known to the file, its keys are asked for, its function decides."""

    def largest(trials: pd.DataFrame, metric: str, versus: str) -> float:
        return float(trials[metric].max() - trials[versus].min())

    entry = statistics.Statistic(largest, ("versus",), "largest {metric} above {versus}")
    monkeypatch.setitem(statistics.STATISTICS, "largest", entry)
    given = {"id": "{metric}-new", "statistic": "largest", "metric": ["TAS", "PAS(weight=1)"]}
    claim = {**given, "statement": "{metric}.", "criterion": "below 1", "where": {"sigma_t": [1]}}
    content["groups"][0]["claims"] = [claim]
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


def made(**settings: Any) -> Claim:
    """A claim as the file would have it."""
    known = {"id": "a", "statement": "-", "source": "-", "figure": "-", "experiment": "outliers"}
    return Claim(
        **{**known, "statistic": "power", "level": ["sigma_t"], "metric": "TAS", **settings}
    )


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({}, "τ of TAS with sigma_t, positive where worse (smallest)"),
        (
            {"where": {"n_outliers": [0]}},
            "τ of TAS with sigma_t, positive where worse (n_outliers 0)",
        ),
        (
            {"where": {"n_outliers": [0, 1]}, "take": "mean", "versus": "ATE"},
            "τ of TAS minus ATE with sigma_t, positive where worse (mean; n_outliers 0/1)",
        ),
    ],
)
def test_a_statistic_in_words(settings: dict[str, Any], text: str) -> None:
    assert made(criterion="at least 0.5", **settings).describe() == text


@pytest.mark.parametrize(
    ("settings", "interval"),
    [
        ({"paper": 13}, (12.5, 13.5)),
        ({"criterion": "at least 0.5"}, (0.5, inf)),
        ({"criterion": "below 0.5"}, (-inf, 0.5)),
        ({"criterion": "within 20"}, (-20, 20)),
    ],
)
def test_the_interval_in_which_a_claim_holds(
    settings: dict[str, Any], interval: tuple[float, float]
) -> None:
    assert made(**settings).interval == interval
