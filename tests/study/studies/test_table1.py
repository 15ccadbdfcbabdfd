"""Table 1 follows from the trials: other trials give another table."""

from dataclasses import replace

import pytest

from experiments.config import experiment_names, load_sweep
from experiments.metrics import METRICS
from experiments.tables import TableError
from studies.table1 import ADDED, EXPERIMENTS_OF, LENGTHS, PAPER, PROPERTIES, compare

GRID = ["sigma_t=[0.02,0.06,0.1]", "n_outliers=[0,1,10,50]"]
SETTINGS = {
    "outliers": GRID,
    "collinear": GRID,
    "combined": ["sigma_t=[0.05]", "sigma_r_deg=[3]"],
}


def sweep_of(name):
    return load_sweep([f"experiment={name}", "trials=3", *SETTINGS.get(name, [])])


SCALE, OUTLIER, LINE, LONG = PROPERTIES


def nowhere(metric, cell):
    return False


def trials_of(make_up, *, blind=nowhere, turned=nowhere):
    """Make up metrics that get worse with noise, but for cells where they do not.

    There they are blind, or get better instead.
    """

    def value(metric, cell, trial, rng):
        value = 10 * cell.sigma_t + cell.sigma_r_deg / 10 + 0.01 * rng.random()
        value *= -1 if METRICS[metric].larger_is_better != turned(metric, cell) else 1
        return 0.5 if blind(metric, cell) else value

    return {
        name: make_up(sweep_of(name), value=value, path=f"{name}.csv")
        for name in experiment_names()
    }


def table_of(make_up, **spoiled):
    return compare(trials_of(make_up, **spoiled)).set_index(["metric", "property"])


@pytest.fixture(scope="module")
def table(make_up):
    """The table of metrics that get worse with noise everywhere."""
    return table_of(make_up)


def test_metrics_that_get_worse_with_noise_pass(table):
    assert (table.loc[(slice(None), [OUTLIER, LINE]), "ours"] != "no").all()
    assert table.loc[("ATE", OUTLIER), "agrees"] == "no"
    assert table.loc[("TAS", OUTLIER), "agrees"] == "yes"


@pytest.mark.parametrize(
    ("n_outliers", "with_outliers", "on_a_line"),
    [(0, "yes", "no"), (1, "no", "yes"), (10, "no", "yes"), (50, "yes", "yes")],
)
def test_one_number_of_outliers_is_enough_to_fail(make_up, n_outliers, with_outliers, on_a_line):
    """One to ten count against outliers, on a line only zero, and more nowhere."""
    table = table_of(make_up, blind=lambda metric, cell: cell.n_outliers == n_outliers)
    for metric in PAPER:
        assert table.loc[(metric, OUTLIER), "ours"] == with_outliers
    for metric in EXPERIMENTS_OF.keys() - ADDED:
        assert table.loc[(metric, LINE), "ours"] == on_a_line


@pytest.mark.parametrize(("share", "answer"), [(0.1, "yes"), (0.9, "no")])
def test_dependence_on_the_length_is_a_share_of_what_the_noise_moves(make_up, share, answer):
    """Either direction counts, and both together: it rises up to 40 cameras and falls again."""
    names = [name for name in EXPERIMENTS_OF if name not in ADDED]
    trials = trials_of(make_up)
    hump = 9 * share / (1 - share)  # the noise moves by 9, and all together by 9 + hump
    for name in LENGTHS:
        table = trials[name].table
        level = table["sigma_t"].rank(method="dense") - 1  # from 0 to 9
        for metric in (metric for metric in names if EXPERIMENTS_OF[metric][2] == name):
            table[metric] = level + hump * (table["n_cameras"] == 40)
    answers = compare(trials).set_index(["metric", "property"])
    assert (answers.loc[(names, LONG), "ours"] == answer).all()


def test_the_ate_alone_needs_metric_scale(table):
    answers = table.xs(SCALE, level="property")
    assert {metric for metric in PAPER if answers["ours"][metric] == "no"} == {"ATE"}
    assert answers["value"]["ATE"] == pytest.approx(999)
    assert (answers["experiment"] == "combined").all()


@pytest.mark.parametrize(
    ("name", "change", "problem"),
    [
        ("outliers", {"sigma_t": [0.05]}, "has only one noise level"),
        ("outliers", {"n_outliers": [0, 50]}, "has no trials with 1 to 10% outliers"),
        ("collinear", {"n_outliers": [1, 50]}, "has no trials without outliers"),
        ("trajectory_length", {"n_cameras": [50]}, "has one number of cameras"),
    ],
)
def test_trials_that_cannot_tell_are_refused(make_up, name, change, problem):
    sweep = replace(sweep_of(name), **change)
    other = make_up(sweep, value=lambda *_: 0.5, path=f"{name}.csv")
    with pytest.raises(TableError, match=f"^{name}.csv {problem}.*; run: snakemake {name}.csv$"):
        compare(trials_of(make_up) | {name: other})
