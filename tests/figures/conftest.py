"""Trials of the paper's experiments, few of them, and figures drawn from them."""

from functools import cache
from pathlib import Path

import pytest

from experiments.config import load_sweep
from experiments.sweep import run_sweeps
from experiments.tables import Record, Trials
from figures import histogram, maa_vs_pas, noise, style

FIGURES = {  # of the paper, each with the experiments whose trials it shows
    "histogram": ("combined",),
    "outliers": ("outliers",),
    "collinear": ("collinear",),
    "trajectory_length": ("trajectory_length",),
    "rotations": ("rotations",),
    "combined": ("combined",),
    "maa_vs_pas": ("maa_vs_pas_outliers", "maa_vs_pas_length", "maa_vs_pas_collinear"),
}


@pytest.fixture(autouse=True)
def _style():
    """Draw as ``python -m figures`` does."""
    with style.applied():
        yield


@pytest.fixture(scope="session")
def run():
    """Run an experiment, once for all tests: ``run("outliers", "sigma_t=[0.05]")``."""

    @cache
    def run_few(experiment, *overrides):
        settings = [f"experiment={experiment}", "trials=3", *overrides]
        sweep = load_sweep(settings)
        path = Path("results", "trials", f"{experiment}.csv")
        return Trials(path, run_sweeps([sweep]), Record((sweep,), {}))

    return run_few


@pytest.fixture(scope="session")
def draw(run):
    """Draw a figure of the paper from such trials."""

    @cache
    def draw_few(name, *overrides):
        trials = [run(experiment, *overrides) for experiment in FIGURES[name]]
        modules = {"histogram": histogram.draw, "maa_vs_pas": maa_vs_pas.draw}
        figure = (modules.get(name) or getattr(noise, name))(*trials)
        return figure

    return draw_few
