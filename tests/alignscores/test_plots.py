"""Figures of estimates: what is in them, for files of every kind."""

import dataclasses

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from alignscores import Trajectory, evaluate
from alignscores.evaluation.evaluation import PLOT_MODES
from alignscores.histogram import cumulative_frequency, score_of
from alignscores.io import read_tum
from alignscores.plots import KINDS, figure_of, score_panel

from .conftest import FILES


@pytest.mark.parametrize("errors", [[0.0] * 37, [0.35, 0.5, 2.0], [np.inf] * 5])
def test_the_shaded_share_of_the_box_is_the_score(errors):
    thresholds = np.arange(1, 11) / 10
    axes, score = Figure().subplots(), score_of(np.array(errors), thresholds)
    frequency = cumulative_frequency(np.array(errors), thresholds)
    score_panel(axes, thresholds, frequency, len(errors), name="XAS", score=score)
    values, edges, _ = axes.patches[0].get_data()
    assert np.sum(values * np.diff(edges)) / len(errors) == pytest.approx(score)
    assert axes.texts[0].get_text() == f"XAS = {score:.3f}"


@pytest.fixture
def evaluation(examples):
    files = (examples / name for name in FILES["tum"])
    return evaluate(*files, format="tum", max_gap=0.0, sync="nearest")


def axes_of(figure):
    return {axes.get_ylabel(): axes for axes in figure.axes}


def test_errors_over_time_are_those_of_the_scores_and_lost_time_is_shaded(evaluation):
    panels = axes_of(figure_of([evaluation], ["errors"]))
    for label, result in (
        ("position error [m]", evaluation.result.tas),
        ("rotation error [deg]", evaluation.result.ras),
    ):
        drawn = panels[label].get_lines()[0].get_ydata()
        np.testing.assert_array_equal(
            drawn[np.isfinite(drawn)], result.errors[result.errors < np.inf]
        )
        shaded = panels[label].collections[0].get_paths()
        assert len(shaded) == 3  # two frames are not in the file, one is nan


def test_poses_over_time_lie_on_the_reference_where_the_errors_are_small(evaluation):
    panels = axes_of(figure_of([evaluation], ["time"]))
    assert list(panels) == ["x [m]", "roll [deg]", "y [m]", "pitch [deg]", "z [m]", "yaw [deg]"]
    tas = evaluation.result.tas
    close = tas.errors < tas.unit
    for k, axis in enumerate("xyz"):
        reference, estimate = (line.get_ydata() for line in panels[f"{axis} [m]"].get_lines()[:2])
        assert np.all(np.abs(reference - estimate)[close] <= tas.errors[close] + 1e-9)
        np.testing.assert_array_equal(estimate, evaluation.positions[:, k])


def test_poses_over_time_stand_at_their_own_times(examples):
    """Each covers a second on either side, which is no stair."""
    reference = read_tum(examples / FILES["tum"][1])
    keyframes = Trajectory(reference.keys[3::9], reference.poses[3::9])
    _, line = axes_of(evaluate(reference, keyframes).plot("time"))["x [m]"].get_lines()[:2]
    times, values = line.get_data()
    drawn = dict(zip(times.round(6), values, strict=True))
    assert list(drawn) == (keyframes.keys - reference.keys[0]).round(6).tolist()
    np.testing.assert_allclose(list(drawn.values()), keyframes.poses[:, 0, 3], atol=1e-6)


@pytest.mark.parametrize("mode", [None, *PLOT_MODES])
def test_the_trajectory_is_coloured_by_the_error_in_the_reference_s_unit(evaluation, mode):
    axes, bar = figure_of([evaluation], ["trajectory"], plot_mode=mode).axes
    assert bar.get_ylabel() == "position error [m]; line: d"
    shown = [axes.get_xlabel()[0], axes.get_ylabel()[0]]
    assert shown == list(mode or "xy")[:2]
    errors = evaluation.result.tas.errors
    np.testing.assert_array_equal(axes.collections[0].get_array(), errors[np.isfinite(errors)])


@pytest.mark.parametrize("form", ["tum", "kitti", "colmap"])
def test_one_figure_has_every_kind(examples, form):
    files = (examples / name for name in FILES[form])
    figure = figure_of([evaluate(*files, format=form)])
    assert len(figure.subfigs) == len(KINDS)
    figure.draw_without_rendering()


def test_many_estimates_are_overlaid_and_the_first_ones_named(evaluation):
    names = [r"_a$\bad$.txt", "x" * 200, *map(str, range(2, 12))]
    scored = [dataclasses.replace(evaluation, name=name) for name in names]
    figure = figure_of(scored)
    panels = axes_of(figure)
    assert len(panels["y [m]"].get_lines()) == len(figure.subfigs[1].axes[0].get_lines()) == 13
    (legend,) = figure.subfigs[0].legends
    assert legend.get_texts()[0].get_text() == names[0]
    assert len(legend.get_texts()) + int(legend.get_title().get_text().split()[1]) == 12
    figure.draw_without_rendering()


def test_an_evaluation_plots_itself_and_saves_its_page(in_notebook, evaluation, tmp_path):
    with matplotlib.rc_context({"backend": "agg"}):
        others = matplotlib.pyplot.get_fignums()  # of other tests
        figure = evaluation.plot("trajectory", plot_mode="xz")
        assert matplotlib.pyplot.get_fignums() == [*others, figure.number]
        matplotlib.pyplot.close(figure)
        for options in ({"kind": "error"}, {"plot_mode": "zx"}):
            with pytest.raises(ValueError, match="must be one of"):
                evaluation.plot(**options)
        assert matplotlib.pyplot.get_fignums() == others
    evaluation.save_page(tmp_path / "page.html")
    assert "estimate.txt against reference" in (tmp_path / "page.html").read_text()
    assert "<iframe srcdoc=" in in_notebook(evaluation)
