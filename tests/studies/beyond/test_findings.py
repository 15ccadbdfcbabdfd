"""Findings follow from the trials alone."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from experiments.config import load_sweep
from experiments.tables import Record, Trials
from studies.beyond.findings import findings


def scenario(*overrides):
    levels = ["n_outliers=[0,10,20,30,50]", "sigma_t=[0.01,0.03,0.05,0.07,0.1]"]
    settings = [*levels, "sigma_r_deg=[1,3,5,7,10]", "trials=20", "metrics=[ATE,TAS,RAS,PAS]"]
    own = {override.partition("=")[0]: override for override in (*settings, *overrides)}
    return load_sweep(["experiment=maa_vs_pas_outliers", *own.values()])


@pytest.fixture(scope="module")
def sweep():
    return scenario()


def trials(make_up, sweep):
    """Make up trials: a metric that orders both, one that orders nothing, one each."""
    table = make_up(sweep, value=lambda *_: 0).table
    scatter = np.random.default_rng(0).normal(0, 0.01, (4, len(table)))
    noise, outliers = table["sigma_t"] / 0.1, table["n_outliers"] / 50
    table["ATE"] = 1 + scatter[0]
    table["TAS"] = 1 - noise / 2 - outliers / 4 + scatter[1]
    table["RAS"] = 1 - noise / 2 + scatter[2]
    table["PAS"] = 1 - outliers / 4 + scatter[3]
    return table


@pytest.fixture
def made_up(make_up, sweep):
    return trials(make_up, sweep)


def judge(table, sweep):
    scenarios = {"made up": Trials(Path("made_up.csv"), table, Record((sweep,), {}))}
    return findings(scenarios).set_index("metric")


def test_verdicts_say_what_a_metric_orders(made_up, sweep):
    table = judge(made_up, sweep)
    assert list(table.columns) == [
        *("scenario", "geometry", "error", "outliers", "outlier_side", "every", "n_cameras"),
        *("noise_order", "outlier_order", "mean", "verdict"),
    ]
    assert table["verdict"].to_dict() == {
        "ATE": "orders nothing",
        "TAS": "orders noise and outliers",
        "RAS": "orders noise",
        "PAS": "orders outliers",
    }
    assert table["mean"]["ATE"] == pytest.approx(1, abs=0.01)


def test_order_is_the_smallest_over_the_other_setting_and_knows_the_direction(made_up, sweep):
    table, tas = judge(made_up, sweep), made_up["TAS"].copy()
    for metric in ("TAS", "RAS"):
        shares = []
        for _, group in made_up.groupby("n_outliers"):
            levels = [-rows.to_numpy() for _, rows in group.groupby("sigma_t")[metric]]
            shares.append(np.mean([(low[:, None] < high).mean() for low, high in pairwise(levels)]))
        assert table["noise_order"][metric] == pytest.approx(100 * min(shares))
    # The same metric turned round gets better with noise: that is no order.
    made_up["TAS"] = 1 - made_up["TAS"]
    turned = judge(made_up, sweep)
    assert turned["noise_order"]["TAS"] < 10
    assert turned["verdict"]["TAS"] == "orders nothing"
    # One cell row of the grid in which it is blind is enough.
    made_up["TAS"] = tas
    blind = made_up["n_outliers"] == 50
    made_up.loc[blind, "TAS"] = 0.3
    assert judge(made_up, sweep)["noise_order"]["TAS"] == 50


def test_a_single_level_is_judged_by_the_other_alone(make_up):
    sweep = scenario("n_outliers=[10]")
    table = judge(trials(make_up, sweep), sweep)
    assert table["outlier_order"].isna().all()
    assert table["verdict"]["TAS"] == "orders noise"
