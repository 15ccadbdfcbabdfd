"""A small threshold study that has been run."""

import pandas as pd
import pytest

from experiments.config import load
from experiments.sweep import run_sweeps
from experiments.tables import Record, Trials
from studies.axes import Axis, axes_of, plan
from studies.threshold_study import THRESHOLDS
from studies.threshold_study.effects import effects

SMALL = [
    "n_outliers=[0,3]",
    "sigma_t=[0.02,0.06]",
    "sigma_r_deg=[2,6]",
    "trials=3",
    "n_cameras=[20,30]",
    "tas_max_threshold=[0.5]",
    "tas_quantile=[0.9]",
    "tas_n_thresholds=[inf]",
    "ras_max_threshold_deg=[5]",
    "ras_n_thresholds=[10]",
    "pas_weight=[1]",
    "registration_n_hypotheses=[30]",
    "registration_prescreen=[inf]",
    "registration_order=[0.3]",
]


@pytest.fixture(scope="session")
def parts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Trials]:
    """The trials of its parts; not to be changed."""
    execution = load(["n_jobs=1"])[1]
    folder = tmp_path_factory.mktemp("threshold_study")
    return {
        name: Trials(
            folder / f"{name}.csv", run_sweeps(table.sweeps, execution), Record(table.sweeps, {})
        )
        for name, table in plan(THRESHOLDS, SMALL).items()
    }


@pytest.fixture
def tables(parts: dict[str, Trials]) -> dict[str, pd.DataFrame]:
    """Copies of the tables, to be changed."""
    return {name: part.table.copy() for name, part in parts.items()}


@pytest.fixture(scope="session")
def axes(parts: dict[str, Trials]) -> list[Axis]:
    return axes_of(THRESHOLDS, {name: part.record.metrics for name, part in parts.items()})


@pytest.fixture(scope="session")
def table(axes: list[Axis], parts: dict[str, Trials]) -> pd.DataFrame:
    """The effects; not to be changed."""
    return effects(axes, {name: part.table for name, part in parts.items()})
