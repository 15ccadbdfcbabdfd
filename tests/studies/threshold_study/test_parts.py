"""The parts of the threshold study: their trials, and what is refused."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pytest

from experiments.config import ConfigError, load, load_sweep
from experiments.sweep import run_sweeps
from experiments.tables import Trials
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
