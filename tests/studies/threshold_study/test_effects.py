"""Effects of the values of an axis: statistics of the trials, with their errors."""

import numpy as np
import pytest

from studies.order import orders
from studies.statistics import dependence
from studies.threshold_study.effects import effects

from ..conftest import undescribed


def row_of(table, axis, value):
    return table[(table["axis"] == axis) & (table["value"] == value)].iloc[0]


def test_effects_are_the_statistics_of_the_trials(table, tables):
    assert undescribed(effects, table) == []
    row, metric = row_of(table, "tas_max_threshold", "0.5"), "TAS(max_threshold=0.5)"
    for part, level, column in (
        ("outliers", "sigma_t", "noise_order"),
        ("outliers", "n_outliers", "outlier_order"),
        ("majority", "sigma_t", "majority_order"),
    ):
        found = [100 * one for one in orders(tables[part], metric, level)]
        assert row[column] == pytest.approx(np.mean(found))
    groups = [group for _, group in tables["outliers"].groupby("n_outliers")]
    ranges = [np.ptp(group.groupby("sigma_t")[metric].mean()) for group in groups]
    assert row["noise_range"] == pytest.approx(np.mean(ranges))
    expected = dependence(tables["length"], metric, ["n_cameras"], "mean")
    assert row["camera_dependence"] == pytest.approx(expected)


def test_the_papers_row_has_no_error_and_the_others_have(axes, table, tables):
    columns = [column for column in table if column.endswith(("_error", "_p"))]
    paper = table["paper"] == "yes"
    assert table.loc[paper, columns].isna().all(axis=None)
    assert table.loc[~paper, columns].notna().all(axis=None)
    one = {name: part[part["trial"] == 0] for name, part in tables.items()}
    assert effects(axes, one)[columns].isna().all(axis=None)


def test_errors_are_those_of_the_difference_from_the_papers_value(axes, tables):
    """Trials are paired: what scatters alike with either value is no error."""
    first, outliers = axes[:1], tables["outliers"]
    metric = first[0].columns["0.5"]
    noise = np.random.default_rng(0).normal(size=len(outliers))
    tables["outliers"] = outliers.assign(**{metric: outliers["TAS"] + 0.1})
    assert row_of(effects(first, tables), "tas_max_threshold", "0.5")["noise_range_p"] == 1
    tables["outliers"] = outliers.assign(**{metric: 100 * outliers["sigma_t"] + noise})
    row = row_of(effects(first, tables), "tas_max_threshold", "0.5")
    # The mean of two groups, each the difference of two means of 30 trials.
    assert row["noise_range_error"] == pytest.approx(np.sqrt(2 / 30 / 2), rel=0.4)
