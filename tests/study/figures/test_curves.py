import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb

from figures import paper
from figures.curves import draw_trials

SERIES = {"trajectory_length": "n_cameras", "combined": "sigma_r_deg"}
COUNTS = ["0", "1", "10", "20", "30", "40", "50"]


def panels(figure):
    return {axes.get_title(loc="left"): axes for axes in figure.axes}


def texts(legend):
    return [text.get_text() for text in legend.get_texts()]


def keys(figure):
    """Return the keys of colours, one a block of panels."""
    return [legend for part in figure.subfigs for legend in part.legends]


@pytest.mark.parametrize(
    "name", ["outliers", "collinear", "trajectory_length", "rotations", "combined"]
)
def test_the_lines_are_the_means_of_the_trials(draw, run, name):
    series = SERIES.get(name, "n_outliers")
    level = "sigma_r_deg" if name == "rotations" else "sigma_t"
    means = run(name).table.groupby([series, level]).mean(numeric_only=True)
    for title, axes in panels(draw(name)).items():
        lines = [line.get_ydata() for line in axes.lines]
        np.testing.assert_allclose(lines, means[title.split()[0]].unstack(), rtol=1e-12)


def test_the_strokes_are_the_range_of_the_trials(draw, run):
    axes = panels(draw("outliers"))["TAS ↑"]
    groups = run("outliers").table.groupby(["n_outliers", "sigma_t"])["TAS"]
    drawn = [stroke.get_segments() for stroke in axes.collections]
    for end, name in enumerate(("min", "max")):
        heights = [segment[end, 1] for series in drawn for segment in series]
        np.testing.assert_allclose(heights, groups.agg(name), rtol=1e-12)


def test_grey_and_bars_are_the_ranges_over_all_trials(draw, run):
    grey, bars = panels(draw("outliers"))["mAA ↑"].containers
    for drawn, by in ((grey, "sigma_t"), (bars, "n_outliers")):
        groups = run("outliers").table.groupby(by)["mAA"]
        np.testing.assert_allclose([patch.get_y() for patch in drawn], groups.min())
        ranges = groups.max() - groups.min()
        np.testing.assert_allclose([patch.get_height() for patch in drawn], ranges)


def test_the_key_has_the_colours_of_lines_and_bars(draw):
    (key,) = keys(draw("outliers"))
    assert key.get_title().get_text() == "Random positions: number of outliers"
    assert texts(key) == COUNTS
    colours = [to_rgb(line.get_color()) for line in key.get_lines()]
    for axes in draw("outliers").axes:
        assert [to_rgb(line.get_color()) for line in axes.lines] == colours
        assert [to_rgb(bar.get_facecolor()) for bar in axes.containers[1]] == colours


def test_neighbouring_curves_differ_without_colour(draw):
    (key,) = keys(draw("outliers"))
    for drawn in (key, *draw("outliers").axes):
        dashed = [line.get_linestyle() == "--" for line in drawn.get_lines()]
        assert dashed == [False, True, False, True, False, True, False]


def test_curves_that_coincide_are_stripes(draw):
    for axes in draw("combined").axes:
        widths = [line.get_linewidth() for line in axes.lines]
        assert (np.diff(widths) < -0.2).all()  # each later one, above, is narrower


def test_units_directions_and_scales_are_those_of_the_metrics(draw):
    shown = {}
    for name in ("collinear", "rotations", "combined"):
        for title, axes in panels(draw(name)).items():
            formatted = axes.yaxis.get_major_formatter()(2.0)
            shown[title] = (axes.get_title(loc="right"), formatted, axes.get_yscale())
            if title.endswith("↑"):
                assert axes.get_ylim() == (0, 1)
    angles = ("Median-1", "Mean-1", "RMS-1", "Median-2", "Mean-2", "RMS-2", "DRE")
    assert shown == {
        **{f"{name} ↓": ("", "2°", "linear") for name in angles},
        **{f"{name} ↑": ("", "2", "linear") for name in ("mAA", "TAS", "RAS", "PAS")},
        "ATE ↓": ("units", "2", "linear"),
        "DTE ↓": ("", "2", "linear"),
    }
    collinear = panels(draw("collinear"))
    assert collinear["ATE ↓"].get_title(loc="right") == "units, log scale"
    assert collinear["DTE ↓"].get_yscale() == "log"


def test_a_logarithmic_axis_has_no_bars_whose_heights_would_be_ratios(draw):
    collinear = panels(draw("collinear"))
    assert [len(collinear[name].containers) for name in ("ATE ↓", "TAS ↑")] == [1, 2]
    for name, bars in (("collinear", "of this colour (linear axes)"), ("outliers", "colour")):
        (explained,) = draw(name).legends
        assert texts(explained)[-1].endswith(bars)


def test_figure_7_has_a_block_for_each_experiment(draw, run):
    figure = draw("maa_vs_pas")
    assert [key.get_title().get_text() for key in keys(figure)] == [
        "(a) Random poses: number of outliers",
        "(b) Random poses: number of cameras",
        "(c) Collinear poses: number of outliers",
    ]
    _, experiments = paper.FIGURES["maa_vs_pas"]
    series = ("n_outliers", "n_cameras", "n_outliers")
    for part, experiment, by in zip(figure.subfigs, experiments, series, strict=True):
        means = run(experiment).table.groupby([by, "sigma_t"]).mean(numeric_only=True)
        for axes, metric in zip(part.axes, ("mAA", "PAS"), strict=True):
            lines = [line.get_ydata() for line in axes.lines]
            np.testing.assert_allclose(lines, means[metric].unstack(), rtol=1e-12)
        labels = [text.get_text() for text in part.axes[-1].get_xticklabels()]
        assert labels[0] == "0.01\n1°"
        assert labels[-1] == "all"


@pytest.mark.parametrize(
    ("changes", "x", "key", "curves"),
    [
        ({"sigma_t": 0.05}, "number of outliers\n(not to scale)", "number of cameras", 1),
        ({"n_outliers": 10}, "σₜ (units)", "number of outliers", 1),
        ({"sigma_t": 0.05, "n_outliers": 10}, "σₜ (units)", "number of outliers", 1),
    ],
)
def test_what_varies_has_the_axes(run, changes, x, key, curves):
    trials = run("outliers").table
    for name, value in changes.items():
        trials = trials[trials[name] == value]
    figure = draw_trials(trials, ["TAS"])
    figure.draw_without_rendering()
    (axes,) = figure.axes
    assert axes.get_xlabel() == x
    assert [legend.get_title().get_text() for legend in keys(figure)] == [key]
    assert len(axes.lines) == curves


def test_each_combination_of_the_other_settings_has_panels(run):
    trials = run("outliers").table
    both = pd.concat([trials.assign(settings=""), trials.assign(settings="tas.max_threshold=2")])
    figure = draw_trials(both)
    titles = [key.get_title().get_text() for key in keys(figure)]
    names = ("default", "tas.max_threshold=2")
    assert titles == [f"settings = {name}: number of outliers" for name in names]
    assert len(figure.axes) == 8
    (explained,) = figure.legends
    assert "mean of 3 trials" in texts(explained)
    repeated = pd.concat([trials.assign(settings=f"seed={seed}") for seed in range(13)])
    with pytest.raises(ValueError, match="13 combinations of settings do not fit"):
        draw_trials(repeated)


def test_other_metrics_are_drawn_and_missing_values_are_counted(run):
    trials = run("outliers").table
    trials = trials.assign(mine=trials["TAS"] - 0.5, TAS=trials["TAS"].mask(trials["trial"] == 0))
    trials = trials.assign(**{"TAS(max_threshold=2, quantile=0.5)": np.inf})
    figure = draw_trials(trials, ["mine", "TAS", "TAS(max_threshold=2, quantile=0.5)"])
    figure.draw_without_rendering()
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "mine",
        "TAS ↑\n(70 trials without a value)",
        "TAS ↑\nmax_threshold=2\nquantile=0.5\n(210 trials without a value)",
    ]
    low, _ = figure.axes[0].get_ylim()
    assert low < 0


def test_many_values_have_a_tick_each_only_where_labels_fit(run):
    trials = run("outliers").table
    fine = trials.assign(sigma_t=trials["sigma_t"] / 799)
    (axes,) = draw_trials(fine, ["TAS"]).axes
    labels = [text.get_text() for text in axes.get_xticklabels()]
    assert sum(map(len, labels)) < 30


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda table: table.drop(columns="DTE"), "has no column DTE"),
        (lambda table: table.drop(columns="n_outliers"), "has no column n_outliers"),
        (lambda table: table[:0], "has no row"),
        (lambda table: table.assign(TAS="broken"), "has 'broken' in column TAS, not a number"),
        (lambda table: table.assign(sigma_t=np.nan), "has 'nan' in column sigma_t, not a number"),
    ],
)
def test_trials_that_do_not_fit_are_refused(run, change, problem):
    with pytest.raises(ValueError, match=f"^{problem}$"):
        paper.outliers(change(run("outliers").table))
