from dataclasses import replace

import numpy as np
import pytest

from experiments.tables import TableError
from figures import noise
from figures.curves import Curves


@pytest.mark.parametrize(
    ("overrides", "problem"),
    [
        (["metrics=[ATE,TAS]"], "has no column DTE"),
        (["sigma_r_deg=[1.0,2.0]"], "has 2 values of sigma_r_deg; the figure"),
        (["n_cameras=[50,100]"], "has 2 values of n_cameras; the figure"),
    ],
)
def test_trials_that_do_not_fit_are_refused(run, overrides, problem):
    small = ["n_outliers=[0,10]", "sigma_t=[0.05]", "trials=1"]
    with pytest.raises(TableError, match=f"^results/trials/outliers.csv {problem}.*snakemake"):
        noise.outliers(run("outliers", *small, *overrides))


def test_noise_that_does_not_rise_together_is_refused(run):
    levels = ["sigma_t=[0.01,0.02]", "sigma_r_deg=[1.0,2.0]"]
    trials = run("maa_vs_pas_outliers", *levels, "n_outliers=[0]", "noise=product")
    with pytest.raises(TableError, match="varies sigma_t and sigma_r_deg independently"):
        Curves(trials, ("mAA", "PAS"), "n_outliers", ("sigma_t", "sigma_r_deg"))


@pytest.mark.parametrize("value", [np.nan, np.inf, "broken"])
def test_values_that_are_no_numbers_are_refused(run, value):
    trials = run("outliers")
    table = trials.table.astype({"TAS": object})
    table.loc[7, "TAS"] = value
    with pytest.raises(TableError, match="values of TAS that are not finite"):
        noise.outliers(replace(trials, table=table))
