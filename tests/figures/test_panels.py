from dataclasses import replace

import numpy as np
import pytest

from figures import noise

SERIES = {"trajectory_length": "n_cameras", "combined": "sigma_r_deg"}


def panels(figure):
    return {axes.get_title(loc="left"): axes for axes in figure.axes}


@pytest.mark.parametrize(
    "name", ["outliers", "collinear", "trajectory_length", "rotations", "combined"]
)
def test_the_lines_are_the_means_of_the_trials(draw, run, name):
    series = SERIES.get(name, "n_outliers")
    level = "sigma_r_deg" if name == "rotations" else "sigma_t"
    means = run(name).table.groupby([series, level]).mean(numeric_only=True)
    for metric, axes in panels(draw(name)).items():
        lines = [line.get_ydata() for line in axes.lines if line.get_marker()]
        np.testing.assert_allclose(lines, means[metric].unstack(), rtol=1e-12)


def test_the_strokes_are_the_range_of_the_trials(draw, run):
    axes = panels(draw("outliers"))["TAS"]
    groups = run("outliers").table.groupby(["n_outliers", "sigma_t"])["TAS"]
    drawn = [stroke.get_segments() for stroke in axes.collections]
    for end, name in enumerate(("min", "max")):
        heights = [segment[end, 1] for series in drawn for segment in series]
        np.testing.assert_allclose(heights, groups.agg(name), rtol=1e-12)


def test_each_bar_has_a_label_and_curves_that_coincide_have_one(run):
    trials = run("outliers", "n_outliers=[0,10,50]", "sigma_t=[0.01,0.1]")
    table = trials.table
    shift = table["n_outliers"].eq(0) / 2  # the curves of 10 and of 50 outliers are one
    panel = panels(
        noise.outliers(replace(trials, table=table.assign(TAS=table["sigma_t"] + shift)))
    )
    labels = [label.get_text() for label in panel["TAS"].get_xticklabels()]
    assert labels[-3:] == ["0", "10", "50"]
    assert "10 to 50" in [text.get_text() for text in panel["TAS"].texts]


def test_grey_and_bars_are_the_ranges_over_all_trials(draw, run):
    grey, *bars = panels(draw("outliers"))["mAA"].containers
    for drawn, by in (
        (grey.patches, "sigma_t"),
        ([bar.patches[0] for bar in bars], "n_outliers"),
    ):
        groups = run("outliers").table.groupby(by)["mAA"]
        np.testing.assert_allclose([patch.get_y() for patch in drawn], groups.min())
        np.testing.assert_allclose(
            [patch.get_height() for patch in drawn], groups.max() - groups.min()
        )


def test_units_and_directions_are_those_of_the_metrics(draw):
    shown = {}
    for metric, axes in (panels(draw("rotations")) | panels(draw("combined"))).items():
        texts = {text.get_text() for text in axes.texts}
        (direction,) = texts & {"↑ higher is better", "↓ lower is better"}
        shown[metric] = (direction[0], axes.yaxis.get_major_formatter()(2.0), "(units)" in texts)
    angles = ("Median-1", "Mean-1", "RMS-1", "Median-2", "Mean-2", "RMS-2", "DRE")
    assert shown == {
        **dict.fromkeys(angles, ("↓", "2°", False)),
        **dict.fromkeys(("mAA", "TAS", "RAS", "PAS"), ("↑", "2", False)),
        "ATE": ("↓", "2", True),
        "DTE": ("↓", "2", False),
    }


@pytest.mark.parametrize(
    ("overrides", "entries"),
    [
        (["sigma_t=[0.05]", "trials=1"], ["0", "1", "10", "20", "30", "40", "50"]),
        (["n_outliers=[10]", "sigma_t=[0.01,0.02,0.03]"], ["10"]),
        (
            ["n_outliers=[0,1,2,3,4,5,6,7,8,9,10,11]", "sigma_t=[0.01,0.02]"],
            ["0", "2", "4", "6", "8", "10"],  # as many as there is room for
        ),
        (["n_outliers=[0,10]", "sigma_t=[0.0,0.001,0.5]"], ["0", "10"]),
    ],
)
def test_other_settings_are_drawn(draw, overrides, entries):
    figure = draw("outliers", *overrides)
    figure.draw_without_rendering()
    (glyphs,) = figure.legends
    labels = [label.get_text() for label in figure.axes[-1].get_xticklabels()]
    assert labels[-len(entries) :] == entries
    trials = "range of 1 trial" if "trials=1" in overrides else "range of 3 trials"
    assert trials in [text.get_text() for text in glyphs.texts]
