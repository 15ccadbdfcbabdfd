"""Axes and parts of the parameter studies: their values, and which are refused."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.config import ConfigError, load, load_sweep
from experiments.sweep import run_sweeps
from studies.axes import Axis, axes_of, plan
from studies.study import Table
from studies.threshold_study import THRESHOLDS

Tables = Mapping[str, Table]


def axes_in(path: Path, tables: Tables) -> dict[str, Axis]:
    metrics = {name: table.sweeps[0].metrics for name, table in tables.items()}
    return {axis.name: axis for axis in axes_of(path, metrics)}


@pytest.fixture(scope="module")
def threshold() -> Tables:
    return plan(THRESHOLDS)


def test_the_papers_values_are_the_defaults_of_the_library(threshold: Tables) -> None:
    # `Axis.of` leaves the option out, so a wrong value here would compare it with itself.
    axes = axes_in(THRESHOLDS, threshold).values()
    written = {f"{axis.metric}({axis.option}={axis.paper})": axis.metric for axis in axes}
    assert len(written) == 9
    small = load_sweep(["experiment=outliers", "trials=1", "n_outliers=[0,3]", "sigma_t=[0.05]"])
    sweep = replace(small, metrics=[*written, "TAS", "RAS", "PAS"])
    trials = run_sweeps([sweep], load(["n_jobs=1"])[1])
    for metric, plain in written.items():
        assert (trials[metric] == trials[plain]).all()


def test_an_axis_can_be_given_and_keeps_the_papers_value() -> None:
    given = plan(THRESHOLDS, ["tas_max_threshold=[3, 0.5]", "pas_weight=[0.2]"])
    axes = axes_in(THRESHOLDS, given)
    assert axes["tas_max_threshold"].values == ("0.5", "1", "3")
    assert axes["pas_weight"].values == ("0.2", "0.5")
    assert "TAS(max_threshold=3)" in given["outliers"].sweeps[0].metrics
    assert given["outliers"].sweeps[0].trials == 50
    seeds = given["seeds"].sweeps[0].metrics
    assert {"TAS(max_threshold=3, seed=9)", "TAS(seed=0)", "PAS(weight=0.2, seed=5)"} <= set(seeds)
    assert all("seed=" in metric and "RAS" not in metric for metric in seeds)


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("tas_max_threshold=2", "'tas_max_threshold' must be a list in brackets"),
        ("tas_max_threshold=[-2]", "'tas_max_threshold': metric 'TAS(max_threshold=-2)': "),
        ("tas_max_treshold=[2]", "unknown setting 'tas_max_treshold'"),
        ("tas_max_threshold=[1.0]", "'tas_max_threshold' needs another value than the paper's 1"),
        ("metrics=[TAS]", "setting 'metrics' cannot be set: the study decides it"),
    ],
)
def test_wrong_settings_are_named_in_one_line(override: str, named: str) -> None:
    with pytest.raises(ConfigError) as caught:
        plan(THRESHOLDS, [override])
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)
