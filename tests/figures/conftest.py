"""Trials of the paper's experiments, few of them, and figures drawn from them."""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from experiments.config import load_sweep
from experiments.sweep import run_sweeps
from experiments.tables import Record, Trials
from studies.paper import FIGURES, STUDY


@pytest.fixture(scope="session")
def run() -> Callable[..., Trials]:
    """Run an experiment, once for all tests: ``run("outliers", "sigma_t=[0.05]")``."""

    @cache
    def run_few(experiment: str, *overrides: str) -> Trials:
        settings = [f"experiment={experiment}", "trials=3", *overrides]
        sweep = load_sweep(settings)
        path = Path("results", "trials", f"{experiment}.csv")
        return Trials(path, run_sweeps([sweep]), Record((sweep,), {}))

    return run_few


@pytest.fixture(scope="session")
def draw(run: Callable[..., Trials]) -> Callable[..., Figure]:
    """Draw a figure of the paper from such trials."""

    @cache
    def draw_few(name: str, *overrides: str) -> Figure:
        trials = [run(experiment, *overrides) for experiment in FIGURES[name]]
        (module, function), *_ = [
            figure.draw.split(":") for figure in STUDY.figures if figure.name == name
        ]
        figure: Figure = getattr(import_module(module), function)(*trials)
        return figure

    return draw_few
