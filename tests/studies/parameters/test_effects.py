"""Effects of the values of an axis: statistics of the trials, with their errors."""

import numpy as np
import pandas as pd
import pytest

from studies.parameters.axes import Axis
from studies.parameters.effects import EFFECTS, _jackknife, effects, over_seeds
from studies.statistics import dependence, power

Tables = dict[str, pd.DataFrame]


def test_effects_are_the_statistics_of_the_trials(axes: list[Axis], tables: Tables) -> None:
    # One number of cameras, so that a group is what shares the number of outliers.
    tables["outliers"] = tables["outliers"][tables["outliers"]["n_cameras"] == 20]
    table = effects(axes, tables)
    assert len(table) == 18
    row = table[(table["axis"] == "tas_max_threshold") & (table["value"] == "0.5")].iloc[0]
    metric = "TAS(max_threshold=0.5)"
    outliers = tables["outliers"]
    expected = power(outliers, metric, ["sigma_t"], "mean")
    assert row["noise_power"] == pytest.approx(expected, abs=1e-6)
    expected = power(outliers, metric, ["n_outliers"], "smallest")
    assert row["outlier_power_smallest"] == pytest.approx(expected, abs=1e-6)
    expected = power(tables["majority"], metric, ["sigma_t"], "mean")
    assert row["majority_power"] == pytest.approx(expected, abs=1e-6)
    by_outliers = [group for _, group in outliers.groupby("n_outliers")]
    ranges = [np.ptp(group[metric]) for group in by_outliers]
    assert row["noise_range"] == pytest.approx(np.mean(ranges), abs=1e-6)
    ranges = [np.ptp(group.groupby("sigma_t")[metric].mean()) for group in by_outliers]
    assert row["noise_range_of_means"] == pytest.approx(np.mean(ranges), abs=1e-6)
    expected = dependence(tables["length"], metric, ["n_cameras"], "mean")
    assert row["camera_dependence"] == pytest.approx(expected, abs=1e-6)
    spread = [
        np.std([scene[f"TAS(max_threshold=0.5, seed={k})"] for k in range(10)], ddof=1)
        for _, scene in tables["seeds"].iterrows()
    ]
    assert row["seed_noise"] == pytest.approx(np.median(spread), abs=1e-6)
    assert (table.loc[table["metric"] == "RAS", "seed_noise"] == 0).all()


def test_the_papers_row_has_no_error_and_the_others_have(
    axes: list[Axis], table: pd.DataFrame, tables: Tables
) -> None:
    errors = table[[f"{name}_error" for name in EFFECTS]]
    paper = table["paper"] == "yes"
    assert paper.sum() == 9
    assert errors[paper].isna().all(axis=None)
    assert errors[~paper].notna().all(axis=None)
    one = {name: part[part["trial"] == 0] for name, part in tables.items()}
    assert effects(axes, one)[errors.columns].isna().all(axis=None)


def test_errors_are_those_of_the_difference_from_the_papers_value(
    axes: list[Axis], tables: Tables
) -> None:
    """Trials are paired: what scatters alike with either value is no error."""
    axis = axes[0]
    outliers = tables["outliers"]
    rng = np.random.default_rng(0)
    assert axis.name == "tas_max_threshold"
    for other in (0.0, rng.normal(size=len(outliers))):
        outliers["TAS"] = outliers["sigma_t"] + rng.normal(size=len(outliers))
        outliers[axis.columns["0.5"]] = outliers["TAS"] + 0.1 + other
        table = effects([axis], tables).set_index(["axis", "value"])
        differences = [
            np.subtract(
                *(
                    group.groupby("n_outliers")[column].agg(np.ptp).mean()
                    for column in (axis.columns["0.5"], "TAS")
                )
            )
            for k in range(3)
            for group in [outliers[outliers["trial"] != k]]
        ]
        expected = np.sqrt(2 * np.var(differences))
        error = table["noise_range_error"]["tas_max_threshold", "0.5"]
        assert error == pytest.approx(expected, abs=1e-6)
        assert (error > 0.01) == np.any(other)


def test_a_score_that_rises_with_noise_has_no_power(axes: list[Axis], tables: Tables) -> None:
    outliers = tables["outliers"]
    tables["outliers"] = outliers.assign(TAS=outliers["sigma_t"] + outliers["n_outliers"])
    row = effects(axes[:1], tables).set_index(["axis", "value"]).loc["tas_max_threshold", "1"]
    powers = [name for name in EFFECTS if name.endswith(("power", "power_smallest"))]
    assert (row[[name for name in powers if "majority" not in name]] < -0.7).all()


def test_what_does_not_vary_has_no_effect(axes: list[Axis], tables: Tables) -> None:
    tables["outliers"] = tables["outliers"][tables["outliers"]["n_outliers"] == 0]
    tables["length"] = tables["length"][tables["length"]["n_cameras"] == 20]
    table = effects(axes[:2], tables)
    assert table[["outlier_power", "camera_dependence"]].isna().all(axis=None)
    assert table["noise_power"].notna().all()


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    sample = np.random.default_rng(0).normal(size=10)
    means = [np.delete(sample, i).mean() for i in range(10)]
    assert _jackknife(means) == pytest.approx(sample.std(ddof=1) / np.sqrt(10))


def test_seeds_of_a_metric() -> None:
    trials = pd.DataFrame({"TAS": [1], "TAS(seed=0)": [2], "TAS(seed=1)": [3], "RAS": [4]})
    assert list(over_seeds(trials, "TAS")) == ["TAS(seed=0)", "TAS(seed=1)"]
    assert over_seeds(trials, "RAS").empty
