"""Head to head: metrics that are made up to be better or worse at putting levels in order."""

from collections.abc import Callable
from dataclasses import replace
from math import inf

import numpy as np
import pytest

from experiments.config import load_sweep
from experiments.grid import Cell
from experiments.tables import TableError, Trials
from studies.head_to_head import plan
from studies.head_to_head.rankings import compare_orders, rankings, side_by_side

from ..conftest import undescribed

MakeUp = Callable[..., Trials]

SCATTER = {"ATE": 0.0, "DTE": 1e9, "mAA": 0.5, "TAS": 0.5}  # in steps of the noise


def value(metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    """Follow the noise with a scatter that is smaller the more cameras there are."""
    shared = np.random.default_rng([trial, round(1000 * cell.sigma_t), cell.n_cameras]).normal()
    level = 100 * cell.sigma_t + SCATTER[metric] * 10 / cell.n_cameras * shared
    return float(-np.exp(level) if metric == "TAS" else -level if metric == "mAA" else level)


def test_metrics_are_ranked_by_the_order_of_neighbours(make_up: MakeUp) -> None:
    """TAS is a rescaled mAA. The ATE has no scatter, the DTE nothing else."""
    settings = ["experiment=trajectory_length", "sigma_t=[0.01,0.02,0.03]", "n_cameras=[5,10]"]
    trials = make_up(load_sweep([*settings, "trials=40"]), value=value)
    table = compare_orders({"trajectory_length": trials})
    assert undescribed(compare_orders, table) == []
    assert set(table["level"]) == {"noise"}
    alone = table[table["versus"].isna()].set_index("metric")
    assert alone.loc["ATE", ["order", "trials", "cameras"]].tolist() == [100, 6, 5]
    assert alone.loc["DTE", "order"] == pytest.approx(50, abs=10)
    assert alone.loc["DTE", "trials"] > 100
    assert alone.loc["DTE", "cameras"] == inf
    # Normal steps of 1 with a scatter of 1 and of 1/2: orders of 76 and 92 %.
    assert alone.loc["mAA", "order"] == pytest.approx(84, abs=5)
    assert alone.loc["mAA", "cameras"] == 10
    assert (alone["low"] <= alone["order"]).all()
    pairs = table[table["versus"].notna()].set_index(["metric", "versus"])
    assert len(pairs) == 6
    same = pairs.loc[("mAA", "TAS")]
    assert same[["order", "low", "high", "p"]].tolist() == [0, 0, 0, 1]
    other = pairs.loc[("ATE", "DTE")]
    assert other["order"] == pytest.approx(100 - alone.loc["DTE", "order"], abs=0.011)
    assert other["p"] < 0.001
    (ranking,) = rankings(table)
    assert [place["metric"] for place in ranking["places"]] == ["ATE", "mAA", "TAS", "DTE"]
    maa = f"{alone.loc['mAA', 'order']:.1f}"
    assert f"ATE 100.0 > mAA {maa} = TAS {maa} > DTE" in ranking["in_words"]


def test_the_order_at_each_number_of_outliers(make_up: MakeUp) -> None:
    """The DTE is blind with 10 outliers; the trials that it takes are the mean of 6 and of none."""

    def blinded(metric: str, cell: Cell, _: int, rng: np.random.Generator) -> float:
        blind = metric == "DTE" and cell.n_outliers == 10
        return float(rng.normal()) if blind else cell.sigma_t + cell.n_outliers

    settings = ["experiment=outliers", "n_outliers=[0,10]", "sigma_t=[0.01,0.02]", "trials=40"]
    table = compare_orders({"outliers": make_up(load_sweep(settings), value=blinded)})
    apart = table[table["outliers"].notna()].set_index(["level", "metric", "outliers"])
    assert set(apart.index.get_level_values("level")) == {"noise"}
    assert apart.loc[("noise", "ATE", 10), ["order", "trials"]].tolist() == [100, 6]
    assert apart.loc[("noise", "DTE", 0), "order"] == 100
    assert apart.loc[("noise", "DTE", 10), "order"] == pytest.approx(50, abs=15)
    (ranking,) = (found for found in rankings(table) if found["level"] == "noise")
    places = {place["metric"]: place for place in ranking["places"]}
    assert places["ATE"]["trials"] == 6
    assert places["DTE"]["trials"] > 6
    assert places["DTE"]["order"] == pytest.approx(75, abs=8)


def fraction(metric: str, cell: Cell, trial: int, _: np.random.Generator) -> float:
    return len(metric) + trial / 7 + cell.sigma_r_deg


def test_scores_of_the_same_trials_are_joined(make_up: MakeUp) -> None:
    given = ["trials=2", "n_outliers=[0,10]"]
    (half,) = plan(given)["combined"].sweeps
    sweep = load_sweep(["experiment=combined", *given])
    assert replace(half, metrics=sweep.metrics) == sweep
    first, second = (make_up(each, value=fraction) for each in (sweep, half))
    joined = side_by_side([first, second])["combined"]
    assert joined.sweep.metrics == [*sweep.metrics, *half.metrics]
    assert joined.table["HalfAngle"].tolist() == second.table["HalfAngle"].tolist()
    assert joined.table["TAS"].tolist() == first.table["TAS"].tolist()


def test_tables_of_other_trials_are_not_joined(make_up: MakeUp) -> None:
    few, more = (load_sweep(["experiment=combined", f"trials={n}"]) for n in (2, 3))
    with pytest.raises(TableError, match="has other settings than"):
        side_by_side([make_up(sweep, value=fraction) for sweep in (few, more)])
