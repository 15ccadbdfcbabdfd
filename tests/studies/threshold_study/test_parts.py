"""The parts of the threshold study: their trials, and what is refused."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from experiments.command import CommandError
from experiments.config import ConfigError, load, load_sweep
from experiments.sweep import run_sweeps
from experiments.tables import Record, TableError, Trials
from studies.axes import Axis, check_parts
from studies.threshold_study import STUDY
from studies.threshold_study.maps import THRESHOLDS


def test_an_axis_of_no_kind_has_no_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "threshold_study.yaml"
    path.write_text(THRESHOLDS.read_text().replace("  tas_quantile:", "  rank_order:"))
    monkeypatch.setattr("studies.threshold_study.THRESHOLDS", path)
    with pytest.raises(ConfigError, match="'rank_order' must have a name that starts with tas_, "):
        STUDY.plan([])


def test_trials_are_those_of_the_experiment(
    parts: dict[str, Trials], small_study: Sequence[str]
) -> None:
    sweep = load_sweep(["experiment=maa_vs_pas_outliers", *small_study[:5]])
    plain = run_sweeps([sweep], load(["backend=sequential"])[1])
    ours = parts["outliers"].table
    pd.testing.assert_series_equal(ours["PAS"], plain["PAS"], check_exact=True)
    assert {"TAS", "TAS(max_threshold=0.5)", "RAS(n_thresholds=10)"} <= set(ours)


def test_parts_are_complete_and_have_all_values(axes: list[Axis], parts: dict[str, Trials]) -> None:
    check_parts(THRESHOLDS, axes, parts)
    few = {name: part for name, part in parts.items() if name not in ("length", "seeds")}
    with pytest.raises(CommandError, match="threshold_study needs the trials of length, too"):
        check_parts(THRESHOLDS, axes, few)
    for name, metric in (("length", "RAS(n_thresholds=10)"), ("seeds", "TAS(order=0.3, seed=0)")):
        sweep = parts[name].sweep
        others = replace(sweep, metrics=[name for name in sweep.metrics if name != metric])
        part = Trials(Path(f"{name}.csv"), parts[name].table, Record((others,), {}))
        with pytest.raises(TableError) as caught:
            check_parts(THRESHOLDS, axes, {**parts, name: part})
        line = f"{name}.csv has no column {metric}; run: snakemake {name}.csv"
        assert str(caught.value) == line
