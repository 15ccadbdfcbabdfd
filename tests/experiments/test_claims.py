"""The claims are complete, well formed, and refused in one line where they are not."""

import json
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from experiments.claims import CLAIMS_FILE, Reading, load_claims
from experiments.config import ConfigError, load
from experiments.replicate import cells_of, plan, run
from experiments.sweep import cells, sweep
from figures import FIGURES

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
BROKEN: list[tuple[dict[str, Any], str]] = [
    ({"statistic": "mean"}, "unknown statistic"),
    ({"statistic": None}, "statistic: "),
    ({"level": []}, "needs 'level'"),
    ({"level": "sigma"}, "unknown level"),
    ({"experiment": "outlier"}, "unknown experiment"),
    ({"metric": "APE"}, "unknown metric 'APE'"),
    ({"metric": "TAS(threshold=1)"}, "no option 'threshold'"),
    ({"metric": []}, "metric: "),
    ({"metric": None}, "metric: "),
    ({"statement": None}, "statement: "),
    ({"take": "median"}, "unknown 'take'"),
    ({"where": {"outliers": [1]}}, "may select cells by"),
    ({"where": {"n_outliers": 1}}, "where.n_outliers: "),
    ({"where": {"n_outliers": []}}, "needs a list of numbers"),
    ({"where": {"n_outliers": ["few"]}}, "needs a list of numbers"),
    ({"where": 3}, "where: "),
    ({"paper": -74}, "either a number of the paper or a criterion"),
    ({"paper": "less"}, "paper: "),
    ({"criterion": None}, "either a number of the paper or a criterion"),
    ({"criterion": "about 0.5"}, "needs a criterion such as"),
    ({"criterion": "below five"}, "needs a criterion such as"),
    ({"criterion": "at least nan"}, "needs a criterion such as"),
    ({"remark": "-"}, "remark: "),
    ({"of_means": "often"}, "of_means: "),
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
    assert reason in error
    assert "outliers-ate-discerns" in error


@pytest.mark.parametrize("key", ["id", "statement", "statistic", "metric", "level", "criterion"])
def test_a_claim_without_a_key_it_needs_is_refused(tmp_path: Path, content: Any, key: str) -> None:
    del content["groups"][0]["claims"][0][key]
    error = refusal(tmp_path, content)
    assert key in error
    assert ("a claim of Figure 2" if key == "id" else "outliers-ate-discerns") in error


def test_a_claim_that_stands_there_twice_is_refused(tmp_path: Path, content: Any) -> None:
    group = content["groups"][0]["claims"]
    group.append(group[0])
    assert "'outliers-ate-discerns' stands there twice" in refusal(tmp_path, content)


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (["groups"], None, "groups"),
        (["groups"], "all", "groups"),
        (["decisions"], None, "decisions"),
        (["groups", 0], "Figure 2", "groups[0]"),
        (["groups", 0, "claims"], None, "claims"),
        (["groups", 0, "figure"], None, "figure"),
        (["groups", 0, "claims", 0], "The ATE discerns noise.", "The ATE discerns noise."),
        (["decisions", 0], "volume", "volume"),
        (["decisions", 0, "readings"], None, "readings"),
        (["decisions", 0, "readings"], [], "'volume' needs readings"),
        (["decisions", 0, "readings", 0], "volume n/10", "'volume': readings[0]"),
        (["decisions", 0, "claims"], [], "'volume' needs claims"),
        (["decisions", 0, "claims"], ["no-such-claim"], "names no claim: 'no-such-claim'"),
        (["decisions", 0, "readings", 0, "where"], {"sigma_t": [0.5]}, "length-maa-favours-large"),
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


def test_the_plan_holds_the_cells_and_metrics_of_every_claim_and_no_more() -> None:
    claims = load_claims()
    planned = plan(claims)
    assert {experiment for experiment, _ in planned} == {claim.experiment for claim in claims}
    for config, wanted in planned.values():
        assert set(wanted) <= set(cells(config))
    # Single cells, worked out by hand.
    _, wanted = planned["maa_vs_pas_outliers", ()]
    assert {cell.n_outliers for cell in wanted if 0.01 < cell.sigma_t < 0.1} == {0, 50}
    _, wanted = planned["trajectory_length", ("volume_per_camera=10",)]
    assert {tuple(metrics) for metrics in wanted.values()} == {("mAA",)}


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("metrics=[TAS]", "'metrics' is not open here"),
        ("experiment=outliers", "'experiment' is not open here"),
        ("n_outliers=[0,1]", "needs trials of outliers with n_outliers 10"),
        ("trials=0", "'trials'"),
        ("trails=1", "'trails'"),
    ],
)
def test_settings_that_leave_claims_undecided_are_refused(override: str, named: str) -> None:
    with pytest.raises(ConfigError) as caught:
        plan(load_claims(), [override])
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "change", "least"),
    [
        ("outliers-tas-discerns", {"level": ["n_cameras"]}, 2),
        ("outliers-tas-discerns", {"level": ["sigma_t", "n_cameras"]}, 2),
        ("outliers-tas-discerns", {"where": {"sigma_t": [0.05]}, "level": ["sigma_t"]}, 2),
        ("outliers-tas-discerns", {"statistic": "first step", "level": ["sigma_t"]}, 3),
    ],
)
def test_a_claim_needs_levels_to_compare(name: str, change: dict[str, Any], least: int) -> None:
    """Else it would have a verdict on nothing, after all trials."""
    claim = load_claims().claims[name]
    if least == 3:
        change = {**change, "where": {"n_outliers": [0], "sigma_t": [0.01, 0.1]}}
    with pytest.raises(ConfigError, match=f"'{name}' compares levels of .*, at least {least} of"):
        cells_of(replace(claim, **change), load(["experiment=outliers"]))


def test_a_replicate_has_the_trials_of_the_experiments(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replicate 0 is a part of what the figures show, bit for bit."""
    claims = load_claims()
    few = ("outliers-ate-blind", "outliers-range-tas", "thresholds-tas-lower")
    monkeypatch.setattr(
        type(claims), "__iter__", lambda self: iter([self.claims[name] for name in few])
    )
    settings = ["trials=2", "n_jobs=1"]
    table = run(plan(claims, settings))
    assert set(table["settings"]) == {""}
    config = load(["experiment=outliers", "metrics=[ATE,TAS]", *settings])
    whole = sweep(config).set_index(["n_outliers", "sigma_t", "trial"])
    part = table.set_index(["n_outliers", "sigma_t", "trial"])
    for metric in ("ATE", "TAS"):
        given = part[metric].dropna()
        assert len(given) == {"ATE": 5 * 2, "TAS": (20 + 3) * 2}[metric]
        assert (given == whole[metric].loc[given.index]).all()
