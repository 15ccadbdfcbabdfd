import numpy as np
import pytest

from experiments.tables import TableError
from figures import maa_vs_pas
from studies.paper import FIGURES

EXPERIMENTS = FIGURES["maa_vs_pas"]


def test_it_has_a_column_for_each_experiment(draw, run):
    axes = draw("maa_vs_pas").axes
    assert [panel.get_title(loc="left") for panel in axes] == ["mAA"] * 3 + ["PAS"] * 3
    series = ["n_outliers", "n_cameras", "n_outliers"]
    for i, panel in enumerate(axes):
        trials = run(EXPERIMENTS[i % 3]).table.groupby([series[i % 3], "sigma_t"])
        lines = [line.get_ydata() for line in panel.lines if line.get_marker()]
        means = trials[panel.get_title(loc="left")].mean().unstack()
        np.testing.assert_allclose(lines, means, rtol=1e-12)


def test_the_table_at_fault_is_named(run):
    outliers, length, collinear = EXPERIMENTS
    without = run(length, "metrics=[mAA]", "n_cameras=[10]")
    with pytest.raises(
        TableError, match=r"^results/trials/maa_vs_pas_length.csv has no column PAS"
    ):
        maa_vs_pas.draw(run(outliers), without, run(collinear))
