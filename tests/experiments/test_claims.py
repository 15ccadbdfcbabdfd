"""The claims are complete, well formed, and refused in one line where they are not."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from experiments.claims import CLAIMS_FILE, load_claims
from experiments.config import ConfigError, load
from experiments.replicate import plan, run
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
    for decision in load_claims().decisions:
        taken, *others = decision.readings
        for name in decision.claims:
            claim = load_claims().claims[name]
            assert taken.of(claim) == claim
            for reading in others:
                assert reading.of(claim) != claim


def test_replicates_can_be_set_but_one_is_none() -> None:
    assert load_claims(3).replicates == 3
    for wrong in (1, 0, "many", 2.5, True):
        with pytest.raises(ConfigError, match="'replicates' must be a whole number"):
            load_claims(wrong)  # type: ignore[arg-type]


BROKEN: list[tuple[dict[str, Any], str]] = [
    ({"statistic": "mean"}, "unknown statistic"),
    ({"level": []}, "needs 'level'"),
    ({"level": "sigma"}, "unknown level"),
    ({"experiment": "outlier"}, "unknown experiment"),
    ({"metric": "APE"}, "unknown metric 'APE'"),
    ({"metric": "TAS(threshold=1)"}, "no option 'threshold'"),
    ({"take": "median"}, "unknown 'take'"),
    ({"where": {"outliers": [1]}}, "may select cells by"),
    ({"where": {"n_outliers": 1}}, "needs a list of values"),
    ({"paper": -74}, "either a number of the paper or a criterion"),
    ({"criterion": None}, "either a number of the paper or a criterion"),
    ({"criterion": "about 0.5"}, "needs a criterion such as"),
    ({"criterion": "below five"}, "needs a criterion such as"),
    ({"remark": "-"}, "unknown key 'remark'"),
]


@pytest.mark.parametrize(("change", "reason"), BROKEN, ids=[reason for _, reason in BROKEN])
def test_a_broken_claim_is_named_in_one_line(
    tmp_path: Path, change: dict[str, Any], reason: str
) -> None:
    content = yaml.safe_load(CLAIMS_FILE.read_text())
    content["groups"][0]["claims"][0].update(change)
    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(ConfigError) as caught:
        load_claims(path=path)
    assert reason in str(caught.value)
    assert "outliers-ate-discerns" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["[", "claims: 3", ""])
def test_a_broken_file_is_named_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "claims.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"claims\.yaml") as caught:
        load_claims(path=path)
    assert "\n" not in str(caught.value)


def test_a_decision_about_an_unknown_claim_is_refused(tmp_path: Path) -> None:
    content = yaml.safe_load(CLAIMS_FILE.read_text())
    content["decisions"][0]["claims"] = ["no-such-claim"]
    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(ConfigError, match="'volume' names no claim: 'no-such-claim'"):
        load_claims(path=path)


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
        assert len(given) == {"ATE": 10 * 2, "TAS": (20 + 3) * 2}[metric]
        assert (given == whole[metric].loc[given.index]).all()
