"""Statistics of trials against values worked out by hand."""

import math

import numpy as np
import pandas as pd
import pytest

from experiments import statistics


def trials(**columns: list[float]) -> pd.DataFrame:
    n = len(next(iter(columns.values())))
    settings = {"n_cameras": 100, "n_outliers": 0, "sigma_t": 0.01, "sigma_r_deg": 3.0}
    return pd.DataFrame({key: [value] * n for key, value in settings.items()} | columns)


def test_range_change_counts_single_trials_or_means() -> None:
    table = trials(sigma_t=[1, 1, 2, 2], A=[0, 4, 2, 6], B=[1, 2, 2, 3])
    assert statistics.relative_range(table, "B", "A") == pytest.approx(100 * (2 / 6 - 1))
    means = statistics.cell_means(table)
    assert statistics.relative_range(means, "B", "A") == pytest.approx(100 * (1 / 2 - 1))
    assert math.isnan(statistics.range_change(pd.Series([1.0, 1.0]), pd.Series([1.0, 2.0])))


def test_power_is_taken_where_all_other_settings_are_the_same() -> None:
    # Within either number of outliers the metric follows the noise; over all trials it does not.
    table = trials(
        n_outliers=[0, 0, 0, 50, 50, 50], sigma_t=[1, 2, 3, 1, 2, 3], TAS=[0.9, 0.8, 0.7, 3, 2, 1]
    )
    assert statistics.power(table, "TAS", ["sigma_t"], "smallest") == pytest.approx(1)
    assert statistics.power(table.assign(n_outliers=0), "TAS", ["sigma_t"], "smallest") < 0.9


@pytest.mark.parametrize(("take", "value"), [("smallest", 0), ("largest", 1), ("mean", 0.5)])
def test_power_takes_the_smallest_the_largest_or_the_mean(take: str, value: float) -> None:
    table = trials(n_outliers=[0, 0, 1, 1], sigma_t=[1, 2, 1, 2], ATE=[1, 2, 5, 5])
    assert statistics.power(table, "ATE", ["sigma_t"], take) == pytest.approx(value)
    both = statistics.power(table, "ATE", ["sigma_t", "n_outliers"], "smallest")
    assert both == 0


def test_settings_that_rise_together_are_one_level() -> None:
    table = trials(sigma_t=[1, 2, 3], sigma_r_deg=[10, 20, 30], PAS=[3, 2, 1])
    assert statistics.power(table, "PAS", ["sigma_t"], "smallest") == pytest.approx(1)


def test_favour_knows_what_is_better() -> None:
    values = [0.1, 0.2, 0.3]
    fine = "mAA(n_thresholds=10)"
    table = trials(**{"n_cameras": [10, 20, 30], "mAA": values, fine: values, "DTE": values})
    assert statistics.favour(table, fine, "n_cameras", "mean") == pytest.approx(1)
    assert statistics.favour(table, "mAA", "n_cameras", "mean") == pytest.approx(1)
    assert statistics.favour(table, "DTE", "n_cameras", "mean") == pytest.approx(-1)


def test_dependence_is_a_share_of_the_range_of_means() -> None:
    table = trials(n_cameras=[10, 20, 10, 20], sigma_t=[1, 1, 2, 2], DTE=[1, 2, 4, 5])
    assert statistics.dependence(table, "DTE", "n_cameras", "mean") == pytest.approx(25)
    assert statistics.dependence(table, "DTE", "sigma_t", "mean") == pytest.approx(75)


def test_first_step_is_a_share_of_the_whole_change() -> None:
    table = trials(n_outliers=[50, 0, 1, 20], TAS=[0.5, 0.9, 0.8, 0.7])
    assert statistics.first_step(table, "TAS", "n_outliers", "mean") == pytest.approx(25)


def test_correlation_is_zero_where_nothing_varies() -> None:
    assert statistics.correlation(pd.Series([1.0, 1.0]), pd.Series([1.0, 2.0])) == 0.0
    values = pd.Series(np.arange(5.0))
    assert statistics.correlation(values, values) == pytest.approx(1)
