import importlib
import subprocess
import sys

import pytest

from experiments.config import experiment_names
from figures import FIGURES


def test_the_names_are_the_ones_that_others_rely_on():
    assert list(FIGURES) == [
        "histogram",
        "outliers",
        "collinear",
        "trajectory_length",
        "rotations",
        "combined",
        "maa_vs_pas",
    ]


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_has_a_module_with_one_public_function(name):
    module = importlib.import_module(f"figures.{name}")
    assert callable(module.draw)
    assert module.__all__ == ["draw"]


def test_the_figures_show_every_experiment_there_is():
    shown = {experiment for experiments in FIGURES.values() for experiment in experiments}
    assert shown == set(experiment_names())


def test_the_registry_costs_no_import():
    # Snakemake reads it before anything runs.
    code = (
        "import sys, figures\n"
        "heavy = {'matplotlib', 'numpy', 'pandas'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
