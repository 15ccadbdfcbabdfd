"""Axes and parts of the parameter studies: their values, and which are refused."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from experiments.command import CommandError
from experiments.config import ConfigError, load, load_sweep
from experiments.sweep import run_sweeps
from experiments.tables import Record, TableError, Trials
from studies.parameters.axes import (
    STUDIES,
    Axis,
    axes_of,
    axis_names,
    check_parts,
    is_seeded,
    load_parameters,
    study_file,
)
from studies.study import Study


def axes_in(study: Study, part: str = "outliers") -> dict[str, Axis]:
    metrics = study.tables[part].sweeps[0].metrics
    return {axis.name: axis for axis in axes_of(study.name.removesuffix("_study"), metrics)}


@pytest.fixture(scope="module")
def threshold() -> Study:
    return load_parameters("threshold")


@pytest.fixture(scope="module")
def registration() -> Study:
    return load_parameters("registration", ["tas_max_threshold=[3]"])  # of the other study


def test_the_papers_values_are_the_defaults_of_the_library(threshold: Study) -> None:
    # `Axis.column` leaves the option out, so a wrong value here would compare it with itself.
    axes = axes_in(threshold).values()
    written = {f"{axis.metric}({axis.option}={axis.paper})": axis.metric for axis in axes}
    assert len(written) == 9
    small = load_sweep(["experiment=outliers", "trials=1", "n_outliers=[0,3]", "sigma_t=[0.05]"])
    sweep = replace(small, metrics=[*written, "TAS", "RAS", "PAS"])
    trials = run_sweeps([sweep], load(["backend=sequential"])[1])
    for metric, plain in written.items():
        assert (trials[metric] == trials[plain]).all()


def test_axes_and_their_values(threshold: Study, registration: Study) -> None:
    axes = axes_in(threshold)
    assert set(axes) == set(axis_names()) - {"tas_registration"}
    assert axes["tas_max_threshold"].values == ("0.25", "0.5", "1", "2", "4")
    assert axes["tas_n_thresholds"].values == ("5", "10", "100", "1000", "inf")
    assert axes["registration_prescreen"].values == ("0.03", "0.1", "0.3", "inf")
    (axis,) = axes_in(registration).values()
    assert (axis.values, axis.paper) == (("pcr99", "refined"), "pcr99")


def test_an_axis_can_be_given_and_keeps_the_papers_value() -> None:
    given = load_parameters("threshold", ["tas_max_threshold=[3, 0.5]", "pas_weight=[0.2]"])
    axes = axes_in(given)
    assert axes["tas_max_threshold"].values == ("0.5", "1", "3")
    assert axes["pas_weight"].values == ("0.2", "0.5")
    assert "TAS(max_threshold=3)" in given.tables["outliers"].sweeps[0].metrics
    assert given.tables["outliers"].sweeps[0].trials == 50
    seeds = given.tables["seeds"].sweeps[0].metrics
    assert {"TAS(max_threshold=3, seed=9)", "TAS(seed=0)", "PAS(weight=0.2, seed=5)"} <= set(seeds)
    assert all("seed=" in metric and "RAS" not in metric for metric in seeds)


def test_a_setting_given_wins_over_that_of_a_part() -> None:
    study = load_parameters("threshold", ["trials=4", "n_outliers=[7]"])
    for table in study.tables.values():
        assert (table.sweeps[0].trials, table.sweeps[0].n_outliers) == (4, [7])


def test_a_value_counts_once_however_it_is_written() -> None:
    given = ["tas_max_threshold=[1.0,0.50,5e-1]", "registration_order=[0.1234567]"]
    axes = axes_in(load_parameters("threshold", given))
    assert axes["registration_order"].values == ("0.1", "0.1234567")
    assert axes["tas_max_threshold"].values == ("0.5", "1")


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("tas_max_threshold=2", "'tas_max_threshold' must be a list in brackets"),
        ("tas_max_threshold=[2,]", "'tas_max_threshold' must be a list in brackets"),
        ("tas_max_threshold=[-2]", "'tas_max_threshold': metric 'TAS(max_threshold=-2)': "),
        ("tas_max_threshold=[two]", "max_threshold should be a valid number, "),
        ("tas_max_treshold=[2]", "unknown setting 'tas_max_treshold'; the axes of this study are"),
        ("tas_max_threshold=[1.0]", "'tas_max_threshold' needs another value than the paper's 1"),
        ("metrics=[TAS]", "unknown setting 'metrics'"),
        ("experiment=outliers", "unknown setting 'experiment'"),
        ("trials=0", "'trials': should be greater than or equal to 1, not 0"),
        ("trials", "'trials' is not a setting"),
    ],
)
def test_wrong_settings_are_named_in_one_line(override: str, named: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_parameters("threshold", [override])
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_axis_of_no_kind_has_no_table(monkeypatch: pytest.MonkeyPatch) -> None:
    axis = {"metric": "TAS", "option": "order", "paper": 0.1, "values": [0.2]}
    threshold = study_file("threshold")
    monkeypatch.setattr(
        "studies.parameters.axes.read_yaml",
        lambda path, kind: kind(axes={"rank_order": axis} if path == threshold else {}, trials={}),
    )
    with pytest.raises(ConfigError, match="'rank_order' must have a name that starts with tas_, "):
        load_parameters("threshold")


def test_studies_and_axes_that_are_none_are_refused() -> None:
    with pytest.raises(ConfigError, match="'tas_registration' needs another value than the"):
        load_parameters("registration", ["tas_registration=[pcr99]"])
    known = ", ".join(STUDIES)
    with pytest.raises(ConfigError, match=f"unknown study 'thresholds'; the studies are {known}"):
        load_parameters("thresholds")


def test_trials_are_those_of_the_experiment(
    parts: dict[str, Trials], small_study: Sequence[str]
) -> None:
    sweep = load_sweep(["experiment=maa_vs_pas_outliers", *small_study[:5]])
    plain = run_sweeps([sweep], load(["backend=sequential"])[1])
    ours = parts["outliers"].table
    pd.testing.assert_series_equal(ours["PAS"], plain["PAS"], check_exact=True)
    assert {"TAS", "TAS(max_threshold=0.5)", "RAS(n_thresholds=10)"} <= set(ours)


def test_inputs_of_the_registration_study(registration: Study) -> None:
    """None, 30 %, 50 % and 90 % of the cameras are lost."""
    sweeps = {name: table.sweeps[0] for name, table in registration.tables.items()}
    inputs = {name: sweep for name, sweep in sweeps.items() if is_seeded(sweep.metrics)}
    for name, sweep in inputs.items():
        (n,) = sweep.n_cameras
        shares = [round(k / n, 2) for k in sweep.n_outliers]
        assert shares == pytest.approx([0, 0.3, 0.5, 0.9], abs=0.015)
        assert len(sweep.metrics) == 2 * 10
        assert name == f"{sweep.geometry}_{n}"
    assert set(inputs) == {
        f"{path}_{n}" for path in ("cube", "line", "uneven") for n in (37, 100, 500)
    }
    assert set(sweeps) - set(inputs) == {"outliers", "collinear", "trajectory_length"}


def test_parts_are_complete_and_have_all_values(axes: list[Axis], parts: dict[str, Trials]) -> None:
    check_parts("threshold", axes, parts)
    few = {name: part for name, part in parts.items() if name not in ("length", "seeds")}
    with pytest.raises(CommandError, match="study needs the trials of length, seeds, too"):
        check_parts("threshold", axes, few)
    for name, metric in (("length", "RAS(n_thresholds=10)"), ("seeds", "TAS(order=0.3, seed=0)")):
        sweep = parts[name].sweep
        others = replace(sweep, metrics=[one for one in sweep.metrics if one != metric])
        part = Trials(Path(f"{name}.csv"), parts[name].table, Record((others,), {}))
        with pytest.raises(TableError) as caught:
            check_parts("threshold", axes, {**parts, name: part})
        line = f"{name}.csv has no column {metric}; run: snakemake {name}.csv"
        assert str(caught.value) == line
