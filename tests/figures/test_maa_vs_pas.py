import numpy as np

from .conftest import FIGURES

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
