"""Scenarios beyond the paper: how they are read, what is found, and the figure."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from alignscores.yaml_files import load_yaml
from experiments.config import ConfigError, load_sweep, to_overrides
from experiments.tables import Record, Trials
from studies.beyond import SCENARIOS as OURS
from studies.beyond import draw, findings, plan, study_name


def sweeps(**settings):
    return {name: load_sweep(to_overrides(table)) for name, table in plan(settings).items()}


def write(directory, text, name="mine.yaml"):
    path = directory / name
    path.write_text(text)
    return path


def test_a_file_of_your_own_takes_the_rest_from_beyond(tmp_path):
    path = write(
        tmp_path,
        "settings: {trials: 7, n_outliers: [0, 5], tas: {quantile: 0.9}}\n"
        "scenarios:\n"
        "  circle: {geometry: orbit}\n"
        "  pieces: {outliers: cluster, trials: 3}\n",
    )
    assert study_name(path) == "beyond_mine"
    circle, pieces = sweeps(scenarios=path, seed=4).values()
    assert (circle.name, circle.geometry, circle.trials) == ("beyond_mine/circle", "orbit", 7)
    assert (pieces.name, pieces.outliers, pieces.trials) == ("beyond_mine/pieces", "cluster", 3)
    for config in (circle, pieces):
        assert (config.seed, config.n_outliers) == (4, [0, 5])
        assert config.sigma_t == load_yaml(OURS)["settings"]["sigma_t"]
    quick = sweeps(scenarios=path, trials=1, tas={"order": 0.2})["pieces"]
    assert quick.trials == 1  # the command line wins
    assert (quick.tas["order"], quick.tas["quantile"]) == (0.2, 0.9)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "scenarios is missing"),
        ("scenarios: {a: {}", "cannot be read"),
        ("scenarios: {a b: {}}", "scenarios has the key 'a b', which may have only letters"),
        ("scenarios: {a: {geometry: sphere}}", "scenarios.a: setting 'geometry': must be one of"),
        ("scenarios: {a: {noise: product}}", "scenarios.a: needs noise=paired"),
        (
            "scenarios: {a: {output: x.csv}}",
            "scenarios.a may not set output, which holds for all studies",
        ),
        ("settings: {n_jobs: 1}\nscenarios: {a: {}}", "settings may not set n_jobs"),
        (
            "scenarios: {a: {sigma_t: [0.1], sigma_r_deg: [3], n_outliers: [0]}}",
            "scenarios.a: needs two levels of noise",
        ),
        ("scenarios: {a: {outliers: cluster, n_outliers: [99]}}", "at least 4 inliers"),
    ],
)
def test_a_file_at_fault_is_named_in_one_line(tmp_path, text, named):
    path = write(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        plan({"scenarios": path})
    assert named in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_whose_name_would_not_do_for_results_is_refused(tmp_path):
    path = write(tmp_path, "scenarios: {a: {}}", "my study.yaml")
    with pytest.raises(ConfigError, match="the name 'beyond_my study' may have only letters"):
        plan({"scenarios": path})


def scenario(*overrides):
    levels = ["n_outliers=[0,10,20,30,50]", "sigma_t=[0.01,0.03,0.05,0.07,0.1]"]
    settings = [*levels, "sigma_r_deg=[1,3,5,7,10]", "trials=20", "metrics=[ATE,TAS,RAS,PAS]"]
    values = {override.partition("=")[0]: override for override in (*settings, *overrides)}
    return load_sweep(["experiment=maa_vs_pas_outliers", *values.values()])


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
    # One cell row of the grid without a response is enough.
    made_up["TAS"] = tas
    blind = made_up["n_outliers"] == 50
    made_up.loc[blind, "TAS"] = 0.3
    assert judge(made_up, sweep)["noise_order"]["TAS"] == 50


def test_a_single_level_is_judged_by_the_other_alone(make_up):
    sweep = scenario("n_outliers=[10]")
    table = judge(trials(make_up, sweep), sweep)
    assert table["outlier_order"].isna().all()
    assert table["verdict"]["TAS"] == "orders noise"


SCENARIOS = {
    "paper": ("cube", "gaussian", "uniform", 10.0),
    "strong_drift": ("car", "drift", "uniform", 10.0),
    "far": ("cube", "gaussian", "uniform", 1000.0),
}
ORDERS = {"ATE": (40, 66.5), "TAS(registration=refined)": (95, 67), "RAS": (70, float("nan"))}


@pytest.fixture(scope="module")
def table():
    keys = ("geometry", "error", "outliers", "outlier_side")
    return pd.DataFrame(
        [
            {"scenario": name, **dict(zip(keys, setting, strict=True))}
            | {"metric": metric, "noise_order": noise, "outlier_order": outliers}
            for name, setting in SCENARIOS.items()
            for metric, (noise, outliers) in ORDERS.items()
        ]
    )


def texts(axes):
    shown = [text.get_text() for text in axes.texts]
    return [text for text in shown if text[-1:].isdigit()]


def test_cells_hold_the_orders_and_what_fails_has_no_colour(table):
    noise, outliers = draw(table).axes
    assert texts(noise) == ["40", "95", "70"] * 3
    assert texts(outliers) == ["66", "67"] * 3  # one level of outliers: nothing to tell
    for axes, coloured in ((noise, [False, True, True]), (outliers, [False, True, False])):
        mesh = axes.collections[0]
        assert (~mesh.get_array().mask).tolist() == [coloured] * 3
