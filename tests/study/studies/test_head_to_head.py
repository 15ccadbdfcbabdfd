"""Head to head: metrics that are made up to be better or worse at ordering levels."""

import numpy as np
import pytest

from experiments.config import load_sweep, to_overrides
from experiments.tables import TableError
from studies.head_to_head import compare_orders, joined, plan

from .conftest import undescribed

SCATTER = {"ATE": 0.0, "DTE": 1e9, "mAA": 0.5, "TAS": 0.5}  # in steps of the noise


def value(metric, cell, trial, rng):
    """Follow the noise with a scatter that is smaller the more cameras there are."""
    shared = np.random.default_rng([trial, round(1000 * cell.sigma_t), cell.n_cameras]).normal()
    level = 100 * cell.sigma_t + SCATTER[metric] * 10 / cell.n_cameras * shared
    return float(-np.exp(level) if metric == "TAS" else -level if metric == "mAA" else level)


def test_metrics_are_ranked_by_the_order_of_neighbours(make_up):
    """TAS is a rescaled mAA. The ATE has no scatter, the DTE nothing else."""
    settings = ["experiment=trajectory_length", "sigma_t=[0.01,0.02,0.03]", "n_cameras=[5,10]"]
    trials = make_up(load_sweep([*settings, "trials=40"]), value=value)
    table = compare_orders({"trajectory_length": trials})
    assert [name for name in undescribed(compare_orders, table) if not name.startswith("at ")] == []
    assert list(table["metric"]) == ["ATE", "mAA", "TAS", "DTE"]
    ranking = table.set_index("metric")
    assert ranking.loc["ATE", ["order", "trials", "at 5 cameras"]].tolist() == [100, 6, 100]
    assert np.isnan(ranking.loc["ATE", "p"])
    assert ranking.loc["DTE", "order"] == pytest.approx(50, abs=10)
    assert ranking.loc["DTE", "trials"] > 100
    assert ranking.loc["DTE", "p"] < 0.001
    assert ranking.loc["DTE", "difference"] == pytest.approx(ranking.loc["DTE", "order"] - 100)
    # Normal steps of 1 with a scatter of 1 and of 1/2: orders of 76 and 92 %.
    at = ["order", "at 5 cameras", "at 10 cameras"]
    assert ranking.loc["mAA", at].tolist() == pytest.approx([84, 76, 92], abs=6)
    assert ranking.loc["mAA", at].tolist() == ranking.loc["TAS", at].tolist()


def test_the_order_at_each_number_of_outliers(make_up):
    """The DTE does not respond with 10 outliers; the trials are the mean of 6 and of many."""

    def blinded(metric, cell, _, rng):
        blind = metric == "DTE" and cell.n_outliers == 10
        return float(rng.normal()) if blind else cell.sigma_t + cell.n_outliers

    settings = ["experiment=outliers", "n_outliers=[0,10]", "sigma_t=[0.01,0.02]", "trials=40"]
    table = compare_orders({"outliers": make_up(load_sweep(settings), value=blinded)})
    noise = table[table["level"] == "noise"].set_index("metric")
    assert noise.loc["ATE", ["at 10 outliers", "trials"]].tolist() == [100, 6]
    assert noise.loc["DTE", "at 0 outliers"] == 100
    assert noise.loc["DTE", "at 10 outliers"] == pytest.approx(50, abs=15)
    assert noise.loc["DTE", "order"] == pytest.approx(75, abs=8)
    assert noise.loc["DTE", "trials"] > 6
    assert table.loc[table["level"] == "outliers", "at 10 outliers"].isna().all()


def fraction(metric, cell, trial, _):
    return len(metric) + trial / 7 + cell.sigma_r_deg


def test_scores_of_the_same_trials_are_joined(make_up):
    settings = {"trials": 2, "n_outliers": [0, 10]}
    half = load_sweep(to_overrides(plan(settings)["combined"]))
    sweep = load_sweep(["experiment=combined", *to_overrides(settings)])
    first, second = (make_up(each, value=fraction) for each in (sweep, half))
    both = joined([first, second])["combined"]
    assert both.sweep.metrics == [*sweep.metrics, *half.metrics]
    assert both.table["HalfAngle"].tolist() == second.table["HalfAngle"].tolist()
    assert both.table["TAS"].tolist() == first.table["TAS"].tolist()


def test_tables_of_other_trials_are_not_joined(make_up):
    shorter, more = (load_sweep(["experiment=combined", f"trials={n}"]) for n in (2, 3))
    with pytest.raises(TableError, match="has other settings than"):
        joined([make_up(sweep, value=fraction) for sweep in (shorter, more)])
