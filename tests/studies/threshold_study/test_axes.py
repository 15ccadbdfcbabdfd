"""Axes: their values, and which are refused."""

import pytest

from experiments.config import ConfigError
from experiments.metrics import MetricOptions, Trials, with_options
from studies.threshold_study.axes import axes_of, plan


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
