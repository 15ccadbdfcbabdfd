import importlib
from functools import cache
from itertools import combinations

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from experiments.config import load
from figures import FIGURES, collinear, histogram, maa_vs_pas, outliers, style
from figures.panels import ANGLES, LENGTHS, NAMES, SCORES
from figures.tables import FigureError, Sweep

WIDTHS = dict.fromkeys(FIGURES, style.COLUMN) | dict.fromkeys(
    ("rotations", "combined", "maa_vs_pas"), style.PAGE
)
SERIES = {"trajectory_length": "n_cameras", "combined": "sigma_r_deg"}


@pytest.fixture(scope="module")
def draw(table):
    @cache
    def draw(name, *overrides):
        module = importlib.import_module(f"figures.{name}")
        if name == "histogram":
            return module.draw(load(["experiment=combined", *overrides]))
        return module.draw(*(table(experiment, *overrides) for experiment in FIGURES[name]))

    return draw


def render(figure):
    with style.applied():
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        return canvas.get_renderer()


def panels(figure):
    return {axes.get_title(loc="left"): axes for axes in figure.axes}


def mean_lines(axes):
    return {line.get_label(): line.get_ydata() for line in axes.lines if line.get_marker()}


@pytest.mark.parametrize("name", FIGURES)
def test_texts_are_legible_and_neither_clipped_nor_in_each_others_way(draw, name):
    figure = draw(name)
    renderer = render(figure)
    boxes = [(text, text.get_window_extent(renderer)) for text in visible_texts(figure)]
    assert len(boxes) > 10
    for text, box in boxes:
        assert text.get_fontsize() >= 6, text
        assert (box.min >= figure.bbox.min).all(), text
        assert (box.max <= figure.bbox.max).all(), text
    for (text, box), (other_text, other) in combinations(boxes, 2):
        overlap = np.minimum(box.max, other.max) - np.maximum(box.min, other.min)
        assert overlap.min() <= 2, (text, other_text)  # pixels of 1/100 inch: boxes have margins


def visible_texts(figure):
    # The labels of ticks outside of an axis exist, but are not drawn.
    hidden = {
        tick.label1
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for tick in axis.get_major_ticks()
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
    }
    texts = set(figure.findobj(Text)) - hidden
    return [text for text in texts if text.get_visible() and text.get_text()]


@pytest.mark.parametrize("name", FIGURES)
def test_it_has_the_width_that_it_is_printed_in(draw, name):
    assert draw(name).get_figwidth() == WIDTHS[name]


@pytest.mark.parametrize("name", [name for name in FIGURES if len(FIGURES[name]) == 1])
def test_the_lines_are_the_means_of_the_trials(draw, table, name):
    trials = table(name)
    series = SERIES.get(name, "n_outliers")
    level = "sigma_r_deg" if name == "rotations" else "sigma_t"
    for metric, axes in panels(draw(name)).items():
        lines = list(mean_lines(axes).values())
        groups = trials.groupby(series)
        assert len(lines) == len(groups)
        for line, (_, group) in zip(lines, groups, strict=True):
            np.testing.assert_allclose(line, group.groupby(level)[metric].mean(), rtol=1e-12)


def test_the_strokes_are_the_range_and_the_quartiles_of_the_trials(table):
    trials = table("outliers")
    axes = panels(outliers.draw(trials))["TAS"]
    groups = trials.groupby(["n_outliers", "sigma_t"])["TAS"]
    for quantiles, strokes in (
        ((0, 1), axes.collections[::2]),
        ((0.25, 0.75), axes.collections[1::2]),
    ):
        drawn = [stroke.get_segments() for stroke in strokes]
        for end, quantile in enumerate(quantiles):
            heights = [segment[end, 1] for series in drawn for segment in series]
            np.testing.assert_allclose(heights, groups.quantile(quantile), rtol=1e-12)


def test_grey_and_bars_are_the_ranges_over_all_trials(table):
    trials = table("outliers")
    grey, *bars = panels(outliers.draw(trials))["mAA"].containers
    for drawn, by in (
        (grey.patches, "sigma_t"),
        ([bar.patches[0] for bar in bars], "n_outliers"),
    ):
        groups = trials.groupby(by)["mAA"]
        np.testing.assert_allclose([patch.get_y() for patch in drawn], groups.min())
        np.testing.assert_allclose(
            [patch.get_height() for patch in drawn], groups.max() - groups.min()
        )


def test_series_are_told_apart_by_lightness():
    for name, count in (("n_outliers", 7), ("n_cameras", 7), ("sigma_r_deg", 5)):
        luminance = np.array(style.colours(name, count)) ** 2.2 @ [0.2126, 0.7152, 0.0722]
        lightness = 116 * np.cbrt(luminance) - 16
        assert (np.diff(lightness) > 6).all()
        assert lightness[-1] < 80  # visible on paper


def test_scores_share_their_axis_and_errors_start_at_zero(draw):
    for metric, axes in panels(draw("combined")).items():
        bottom, top = axes.get_ylim()
        assert bottom == 0
        assert top == 1 or metric in {"ATE", "DTE"}


def test_collinear_errors_are_on_a_logarithmic_axis(draw):
    scales = {metric: axes.get_yscale() for metric, axes in panels(draw("collinear")).items()}
    assert scales == {"ATE": "log", "DTE": "log", "mAA": "linear", "TAS": "linear"}


def test_an_error_of_zero_makes_the_axis_linear(table):
    trials = table("collinear").assign(ATE=0.0)
    assert panels(collinear.draw(trials))["ATE"].get_yscale() == "linear"


def test_l1_and_l2_statistics_share_their_axes(draw):
    axes = panels(draw("rotations"))
    for statistic in ("Median", "Mean", "RMS"):
        assert axes[f"{statistic}-1"].get_ylim() == axes[f"{statistic}-2"].get_ylim()


def test_maa_vs_pas_has_a_column_for_each_experiment(table):
    tables = [table(name) for name in FIGURES["maa_vs_pas"]]
    figure = maa_vs_pas.draw(*tables)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["mAA"] * 3 + ["PAS"] * 3
    for axes, trials in zip(figure.axes[3:], tables, strict=True):
        series = "n_cameras" if trials["n_cameras"].nunique() > 1 else "n_outliers"
        means = trials.groupby([series, "sigma_t"])["PAS"].mean().unstack()
        np.testing.assert_allclose(list(mean_lines(axes).values()), means, rtol=1e-12)


@pytest.mark.parametrize(
    "overrides",
    [
        ["sigma_t=[0.05]", "trials=1"],
        ["n_outliers=[10]"],
        ["n_outliers=[0,1,2,3,4,5,6,7,8,9,10,11]"],
        ["sigma_t=[0.0,0.001,0.5]"],
    ],
)
def test_it_draws_other_settings(draw, overrides):
    render(draw("outliers", *overrides))


def test_uneven_noise_levels_are_said_to_be_not_to_scale(draw):
    for levels, remark in (("[0.01,0.02,0.03]", False), ("[0.01,0.02,0.1]", True)):
        figure = draw("outliers", f"sigma_t={levels}")
        texts = [text.get_text() for axes in figure.axes for text in axes.texts]
        assert any("not to scale" in text for text in texts) == remark


def test_it_draws_an_incomplete_table(table):
    trials = table("outliers")
    some = trials[~((trials["n_outliers"] == 50) & (trials["sigma_t"] == 0.01))]
    lines = mean_lines(panels(outliers.draw(some))["TAS"])
    assert np.isnan(lines["50"]).tolist() == [True] + [False] * 9


def test_the_histogram_is_that_of_the_trial_in_the_table():
    config = load(
        ["experiment=combined", "trials=1", "sigma_t=[0.03]", "sigma_r_deg=[3.0]", "n_jobs=1"]
    )
    from experiments.sweep import cells, run_trials

    row = run_trials(config, cells(config)[0], [0], config.metrics)[0]
    figure = histogram.draw(config)
    for axes, metric in zip(figure.axes, ("TAS", "RAS"), strict=True):
        assert f"{metric} = {row[metric]:.3f}" in [text.get_text() for text in axes.texts]
        values, edges, _ = axes.patches[0].get_data()
        share = np.sum(values * np.diff(edges)) / (axes.get_xlim()[1] * axes.get_ylim()[1])
        assert share == pytest.approx(row[metric], abs=1e-12)


def test_the_users_own_settings_change_nothing_and_are_not_changed(table):
    trials = table("collinear", "sigma_t=[0.05,0.1]")
    default = collinear.draw(trials)
    with matplotlib.rc_context({"font.size": 30, "lines.linewidth": 9, "axes.grid": False}):
        before = dict(matplotlib.rcParams)
        figure = collinear.draw(trials)
        assert dict(matplotlib.rcParams) == before
    assert np.array_equal(picture(default), picture(figure))


def picture(figure):
    render(figure)
    return np.asarray(figure.canvas.buffer_rgba())


def test_every_metric_and_setting_has_a_name():
    from experiments.config import METRICS

    assert {*SCORES, *ANGLES, *LENGTHS, "DTE"} == set(METRICS)
    for name in FIGURES.values():
        for experiment in name:
            assert set(load([f"experiment={experiment}"]).metrics) <= set(METRICS)
    assert set(NAMES) == {"n_cameras", "n_outliers", "sigma_t", "sigma_r_deg"}


@pytest.mark.parametrize(
    ("overrides", "problem", "setting"),
    [
        (["metrics=[ATE,TAS]"], "has no column DTE", "metrics=[ATE,DTE,mAA,TAS]"),
        (["sigma_r_deg=[1.0,2.0]"], "has 2 values of sigma_r_deg", "sigma_r_deg=[1]"),
        (["n_cameras=[50,100]"], "has 2 values of n_cameras", "n_cameras=[50]"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(table, overrides, problem, setting):
    with pytest.raises(FigureError, match=problem) as error:
        outliers.draw(table("outliers", *overrides))
    assert (error.value.experiment, error.value.setting) == ("outliers", setting)


def test_noise_that_does_not_rise_together_is_refused(table):
    trials = table("maa_vs_pas_outliers", "noise=product")
    with pytest.raises(FigureError, match="independently") as error:
        Sweep(trials, ("mAA", "PAS"), "n_outliers", ("sigma_t", "sigma_r_deg"))
    assert error.value.setting == "noise=paired"


@pytest.mark.parametrize("column", ["TAS", "sigma_t"])
@pytest.mark.parametrize("value", [np.nan, np.inf, "broken"])
def test_values_that_are_no_numbers_are_refused(table, column, value):
    trials = table("outliers").astype({column: object})
    trials.loc[7, column] = value
    with pytest.raises(FigureError, match=f"values of {column}"):
        outliers.draw(trials)
