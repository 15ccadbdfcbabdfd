"""Findings follow from the trials alone."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import kendalltau

from experiments.config import Config
from experiments.findings import findings, main
from experiments.scenarios import load_scenario
from experiments.sweep import cells
from experiments.tables import write_trials

METRICS = "metrics=[ATE,TAS,RAS,PAS]"


def scenario(*overrides: str) -> Config:
    return load_scenario("paper", overrides=["trials=20", METRICS, *overrides])


def trials(config: Config) -> pd.DataFrame:
    """Make up trials: a metric that orders both, one that orders nothing, one each."""
    rows = [vars(cell) | {"trial": i} for cell in cells(config) for i in range(config.trials)]
    table = pd.DataFrame(rows)
    scatter = np.random.default_rng(0).normal(0, 0.01, (4, len(table)))
    noise, outliers = table["sigma_t"] / 0.1, table["n_outliers"] / 50
    table["ATE"] = 1 + scatter[0]
    table["TAS"] = 1 - noise / 2 - outliers / 4 + scatter[1]
    table["RAS"] = 1 - noise / 2 + scatter[2]
    table["PAS"] = 1 - outliers / 4 + scatter[3]
    keys = {"experiment": config.name, "geometry": config.geometry, "replicate": 0}
    return table.assign(**keys)


def judge(table: pd.DataFrame, config: Config) -> pd.DataFrame:
    return findings({"made up": table}, {"made up": config}).set_index("metric")


def test_verdicts_tell_what_a_metric_orders() -> None:
    config = scenario()
    table = judge(trials(config), config)
    assert table["verdict"].to_dict() == {
        "ATE": "orders nothing",
        "TAS": "orders noise and outliers",
        "RAS": "orders noise",
        "PAS": "orders outliers",
    }
    assert table["mean"]["ATE"] == pytest.approx(1, abs=0.01)
    (sentence,) = set(table["finding"])
    assert sentence.startswith(
        "TAS orders noise and outliers; RAS orders noise; PAS orders outliers; ATE orders nothing. "
    )
    assert " RAS fails on outliers (tau " in sentence
    assert " PAS fails on noise (tau " in sentence
    assert "TAS fails" not in sentence
    assert "near" not in sentence
    assert "TAS is no worse" not in sentence


def test_power_is_the_smallest_over_the_other_setting_and_knows_the_direction() -> None:
    config = scenario()
    made_up = trials(config)
    table = judge(made_up, config)
    for metric in ("TAS", "RAS"):
        taus = [
            kendalltau(-group[metric], group["sigma_t"]).statistic
            for _, group in made_up.groupby("n_outliers")
        ]
        assert table["noise_power"][metric] == pytest.approx(min(taus))
    # The same metric turned round gets better with noise: that is no order.
    made_up["TAS"] = 1 - made_up["TAS"]
    turned = judge(made_up, config)
    assert turned["noise_power"]["TAS"] < -0.5
    assert turned["verdict"]["TAS"] == "orders nothing"
    # One cell row of the grid in which it is blind is enough.
    made_up["TAS"] = trials(config)["TAS"]
    blind = made_up["n_outliers"] == 50
    made_up.loc[blind, "TAS"] = 0.3
    assert judge(made_up, config)["noise_power"]["TAS"] == 0


def test_a_score_that_is_used_up_or_rises_with_outliers_is_told() -> None:
    config = scenario()
    made_up = trials(config)
    made_up["TAS"] -= 0.45
    made_up["PAS"] += 0.3 * (made_up["n_outliers"] == 50)
    (sentence,) = set(judge(made_up, config)["finding"])
    assert "At the strongest noise, with 0 outliers, TAS (0.05) is near 0." in sentence
    assert "PAS is no worse with 50 outliers than with 30 (mean 1.05 and 0.85)." in sentence
    assert "TAS is no worse" not in sentence


def test_a_single_level_is_judged_by_the_other_alone() -> None:
    config = scenario("n_outliers=[10]")
    table = judge(trials(config), config)
    assert table["outlier_power"].isna().all()
    assert table["verdict"]["TAS"] == "orders noise"
    assert "fails on outliers" not in table["finding"].iloc[0]


def test_the_command_writes_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "own.yaml"
    file.write_text("settings: {trials: 20, metrics: [TAS, ATE]}\nscenarios: {a: {}}\n")
    arguments = ["--scenarios", str(file), f"results_dir={tmp_path}"]
    assert main(arguments) == 1
    error = capsys.readouterr().err
    assert f"{tmp_path}/trials/beyond_own/a.csv does not exist" in error
    assert error.count("\n") == 1

    config = load_scenario("a", file, [f"results_dir={tmp_path}"])
    made_up = trials(scenario())
    write_trials(config, made_up.assign(experiment=config.name))
    assert main(arguments) == 0
    table = pd.read_csv(tmp_path / "tables" / "beyond_own.csv")
    assert list(table["metric"]) == ["TAS", "ATE"]
    assert list(table.columns) == [
        "scenario",
        "geometry",
        "error",
        "outliers",
        "outlier_side",
        "metric",
        "noise_power",
        "outlier_power",
        "mean",
        "verdict",
        "finding",
    ]
    assert (
        table["finding"].str.startswith("TAS orders noise and outliers; ATE orders nothing.").all()
    )

    write_trials(config, made_up.assign(experiment=config.name).drop(columns="ATE"))
    assert main(arguments) == 1
    assert "a.csv has no column ATE" in capsys.readouterr().err


def test_wrong_settings_end_with_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trials=0"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
