"""Statistics of trials against values worked out by hand."""

import math

import numpy as np
import pandas as pd
import pytest

from studies import statistics


def trials(**columns):
    n = len(next(iter(columns.values())))
    settings = {"n_cameras": 100, "n_outliers": 0, "sigma_t": 0.01, "sigma_r_deg": 3.0}
    return pd.DataFrame({key: [value] * n for key, value in settings.items()} | columns)


def test_range_change_goes_from_some_cells_to_others():
    table = trials(sigma_t=[1, 1, 2, 2], PAS=[0.2, 0.8, 0.4, 0.7])
    up, down = ({"sigma_t": [1]}, {"sigma_t": [2]}), ({"sigma_t": [2]}, {"sigma_t": [1]})
    assert statistics.range_change(table, "PAS", *up) == pytest.approx(-50)
    assert statistics.range_change(table, "PAS", *down) == pytest.approx(100)
    assert statistics.range_change_size(table, "PAS", *up) == pytest.approx(50)
    assert math.isnan(statistics.range_change(table.assign(PAS=1), "PAS", *up))


def test_power_is_taken_where_all_other_settings_are_the_same():
    # Within either number of outliers the metric follows the noise; over all trials it does not.
    table = trials(
        n_outliers=[0, 0, 0, 50, 50, 50], sigma_t=[1, 2, 3, 1, 2, 3], TAS=[0.9, 0.8, 0.7, 3, 2, 1]
    )
    assert statistics.power(table, "TAS", ["sigma_t"], "smallest") == pytest.approx(1)
    assert statistics.power(table.assign(n_outliers=0), "TAS", ["sigma_t"], "smallest") < 0.9


@pytest.mark.parametrize(
    ("summary", "value", "of_both"), [("smallest", 0, -1), ("largest", 1, 1), ("mean", 0.5, 0)]
)
def test_power_takes_the_smallest_the_largest_or_the_mean(summary, value, of_both):
    table = trials(n_outliers=[0, 0, 1, 1], sigma_t=[1, 2, 1, 2], ATE=[1, 2, 0.5, 0.5])
    assert statistics.power(table, "ATE", ["sigma_t"], summary) == pytest.approx(value)
    both = statistics.powers(table, "ATE", ["sigma_t", "n_outliers"])
    assert both == pytest.approx([1, 0, -1, -1])
    improvement = statistics.improvement(table, "ATE", ["sigma_t", "n_outliers"], summary)
    assert improvement == pytest.approx({"smallest": -1, "largest": 1, "mean": 0.25}[summary])
    result = statistics.power(table, "ATE", ["sigma_t", "n_outliers"], summary)
    assert result == pytest.approx(np.mean(both) if summary == "mean" else of_both)


def test_dependence_is_a_share_of_the_range_of_means():
    table = trials(n_cameras=[10, 20, 10, 20], sigma_t=[1, 1, 2, 2], DTE=[1, 2, 4, 5])
    assert statistics.dependence(table, "DTE", ["n_cameras"], "mean") == pytest.approx(25)
    assert statistics.dependence(table, "DTE", ["sigma_t"], "mean") == pytest.approx(75)


def test_dependence_sees_what_rises_and_falls_again():
    """Kendall's tau does not: its pairs up and down cancel."""
    table = trials(n_cameras=[10, 40, 200] * 2, sigma_t=[1] * 3 + [2] * 3, TAS=[3, 2, 3, 1, 0, 1])
    assert statistics.dependence(table, "TAS", ["n_cameras"], "mean") == pytest.approx(100 / 3)
    assert statistics.improvement(table, "TAS", ["n_cameras"], "mean") == pytest.approx(0)


def test_joint_power_is_that_of_the_weaker_level():
    """Perfect with the noise, wrong in one of two groups with the outliers."""
    table = trials(sigma_t=[1, 1, 2, 2], n_outliers=[0, 10, 0, 10], DTE=[1.0, 2.0, 4.0, 3.0])
    for levels in (["sigma_t", "n_outliers"], ["n_outliers", "sigma_t"]):
        assert statistics.joint_power(table, "DTE", levels, "mean") == 0
    assert statistics.joint_power(table, "DTE", ["sigma_t"], "mean") == 1


def test_initial_response_is_a_share_of_the_whole_change():
    table = trials(n_outliers=[50, 0, 1, 20], TAS=[0.5, 0.9, 0.8, 0.7])
    assert statistics.initial_response(table, "TAS", ["n_outliers"], "mean") == pytest.approx(25)


def test_correlation_is_zero_where_nothing_varies():
    assert statistics.correlation(pd.Series([1.0, 1.0]), pd.Series([1.0, 2.0])) == 0.0
    values = pd.Series(np.arange(5.0))
    assert statistics.correlation(values, values) == pytest.approx(1)


def test_a_missing_value_does_not_count_as_no_correlation():
    values = pd.Series([1.0, np.nan, 3.0])
    assert math.isnan(statistics.correlation(values, pd.Series([1.0, 2.0, 3.0])))
    table = trials(n_outliers=[0, 0, 1, 1], sigma_t=[1, 2, 1, 2], ATE=[1, 2, np.nan, 5])
    for summary in statistics.SUMMARIES:
        assert math.isnan(statistics.power(table, "ATE", ["sigma_t"], summary))


def test_change_of_the_order_from_some_cells_to_others():
    """Orders of 62.5 % and of 100 %."""
    table = trials(sigma_t=np.repeat([1, 2, 3], 2), TAS=[-1, -2, -2, -3, -1, -3])
    assert statistics.order_percentages(table, "TAS", ["sigma_t"]) == pytest.approx([62.5])
    before, after = {"n_outliers": [0]}, {"n_outliers": [9]}
    both = pd.concat([table, table.assign(n_outliers=9, TAS=-table["sigma_t"])])
    change = statistics.order_change_size(both, "TAS", ["sigma_t"], "mean", before, after)
    assert change == pytest.approx(37.5)
