import numpy as np
import pytest

from experiments.config import load_sweep
from experiments.sweep import run_sweeps
from figures.paper import histogram


@pytest.mark.parametrize("seed", [0, 3])
def test_it_is_that_of_the_trial_in_the_table(seed):
    cell = ["sigma_t=[0.03]", "sigma_r_deg=[3.0]", "trials=1"]
    sweep = load_sweep(["experiment=combined", *cell, f"seed={seed}"])
    trials = run_sweeps([sweep])
    figure = histogram(sweep)
    for axes, (metric, largest) in zip(figure.axes, {"TAS": 1, "RAS": 10}.items(), strict=True):
        assert axes.get_xlim() == pytest.approx((0, largest))  # in units of d, in degrees
        score = trials[metric][0]
        assert f"{metric} = {score:.3f}" in [text.get_text() for text in axes.texts]
        values, edges, _ = axes.patches[0].get_data()
        share = np.sum(values * np.diff(edges)) / (axes.get_xlim()[1] * axes.get_ylim()[1])
        assert share == pytest.approx(score, abs=1e-12)
