"""The study of thresholds: its axes, the effects of their values, and the figure."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.config import ConfigError, load_sweep, to_overrides
from experiments.metrics import MetricOptions, Trials, with_options
from studies.order import orders
from studies.statistics import dependence
from studies.thresholds import axes_of, draw, effects, plan

from .conftest import undescribed

GRID = {"n_outliers": [0, 3], "sigma_t": [0.02, 0.06], "sigma_r_deg": [2.0, 6.0], "trials": 30}
VALUES = {"tas_max_threshold": [0.5], "tas_n_thresholds": [5]}


def falls(metric, cell, trial, rng):
    """Fall with noise and outliers, and scatter."""
    return 1 - 5 * cell.sigma_t - 0.05 * cell.n_outliers + 0.05 * rng.normal()


@pytest.fixture(scope="session")
def parts(make_up):
    """The trials of its parts."""
    cameras = {"length": [20, 30]}
    sweeps = {
        name: replace(load_sweep(to_overrides(settings)), n_cameras=cameras.get(name, [20]), **GRID)
        for name, settings in plan(VALUES).items()
    }
    return {name: make_up(sweep, value=falls) for name, sweep in sweeps.items()}


@pytest.fixture
def tables(parts):
    """Copies of the tables, to be changed."""
    return {name: part.table.copy() for name, part in parts.items()}


@pytest.fixture(scope="session")
def axes(parts):
    return axes_of(parts["outliers"].record.metrics)


@pytest.fixture(scope="session")
def table(axes, parts):
    """The effects; not to be changed."""
    return effects(axes, {name: part.table for name, part in parts.items()})


def test_the_papers_values_are_the_defaults_of_the_metrics():
    """Their columns have no option, so another value here would be compared with itself."""
    axes = axes_of(plan({})["outliers"]["metrics"])
    assert len(axes) == 9
    trials = Trials([], [], [], MetricOptions())
    for axis in axes:
        explicit = with_options(axis.metric, {axis.option: axis.paper})
        assert trials.options(explicit) == trials.options(axis.metric)


def test_an_axis_can_be_given_and_keeps_the_papers_value():
    # Snakemake reads lists as strings.
    metrics = plan({"tas_max_threshold": ["3", "0.5"], "pas_weight": [0.2]})["outliers"]["metrics"]
    axes = {axis.name: axis for axis in axes_of(metrics)}
    assert axes["tas_max_threshold"].values == ("0.5", "1", "3")
    assert axes["pas_weight"].values == ("0.2", "0.5")
    assert "TAS(max_threshold=3)" in metrics


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        ({"tas_max_threshold": 2}, "'tas_max_threshold' must be a list in brackets"),
        ({"tas_max_threshold": [-2]}, "'tas_max_threshold': metric 'TAS(max_threshold=-2)': "),
        ({"tas_max_threshold": [1.0]}, "'tas_max_threshold' needs another value than the paper's"),
        ({"metrics": ["TAS"]}, "setting 'metrics' cannot be set: the study decides it"),
    ],
)
def test_wrong_settings_are_named_in_one_line(setting, named):
    with pytest.raises(ConfigError) as caught:
        plan(setting)
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


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
        percentages = [100 * order for order in orders(tables[part], metric, level)]
        assert row[column] == pytest.approx(np.mean(percentages))
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
    first = {name: part[part["trial"] == 0] for name, part in tables.items()}
    assert effects(axes, first)[columns].isna().all(axis=None)


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


def test_every_value_is_shown_and_named_and_the_papers_is_bold(axes, table):
    table = table.assign(outlier_order=np.nan)  # as where one number of outliers is run
    figure = draw(table)
    figure.draw_without_rendering()
    shown = [
        np.isfinite(
            [x for line in each.lines if line.get_marker() == "o" for x in line.get_xdata()]
        )
        for each in figure.axes
    ]
    assert [mask.sum() for mask in shown] == [len(table), 0, *[len(table)] * 3]
    labels = figure.axes[0].get_yticklabels()
    bold = [label.get_text() for label in labels if label.get_fontweight() == "bold"]
    assert bold[len(axes) :] == [axis.paper for axis in axes]
    assert "off" in [label.get_text() for label in labels]
