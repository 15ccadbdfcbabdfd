"""Figures of estimates: what is in them, for files of every kind."""

import dataclasses

import matplotlib.pyplot
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from alignscores import Trajectory, evaluate, plot
from alignscores.histogram import cumulative_frequency, score_of
from alignscores.io import read_tum
from alignscores.show import PLOT_MODES
from alignscores.show.plots import figure_of, score_panel
from tests.files import FILES


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
    panels = axes_of(figure_of([evaluation], "errors"))
    for label, result in (
        ("position error [m]", evaluation.result.tas),
        ("rotation error [deg]", evaluation.result.ras),
    ):
        drawn = panels[label].get_lines()[0].get_ydata()
        np.testing.assert_array_equal(
            drawn[np.isfinite(drawn)], result.errors[result.errors < np.inf]
        )
        assert len(panels[label].patches) == 3  # two frames are not in the file, one is nan


def test_poses_over_time_lie_on_the_reference_where_the_errors_are_small(evaluation):
    panels = axes_of(figure_of([evaluation], "time"))
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
    _, line = axes_of(figure_of([evaluate(reference, keyframes)], "time"))["x [m]"].get_lines()[:2]
    times, values = line.get_data()
    drawn = dict(zip(times.round(6), values, strict=True))
    assert list(drawn) == (keyframes.keys - reference.keys[0]).round(6).tolist()
    np.testing.assert_allclose(list(drawn.values()), keyframes.poses[:, 0, 3], atol=1e-6)


@pytest.mark.parametrize("mode", [None, *PLOT_MODES])
def test_the_trajectory_is_coloured_by_the_error_in_the_reference_s_unit(evaluation, mode):
    axes, bar = figure_of([evaluation], "trajectory", plot_mode=mode).axes
    assert bar.get_ylabel() == "position error [m]"
    shown = [axes.get_xlabel()[0], axes.get_ylabel()[0]]
    assert shown == list(mode or "xy")[:2]
    errors = evaluation.result.tas.errors
    limit = evaluation.result.tas.thresholds[-1]
    near, far, lost = axes.collections
    np.testing.assert_array_equal(near.get_array(), errors[errors < limit])
    assert len(far.get_offsets()) == np.sum((errors >= limit) & np.isfinite(errors)) > 0
    assert len(lost.get_offsets()) == np.sum(np.isinf(errors)) > 0


def test_outliers_of_several_estimates_are_crosses_also_single_ones(evaluation):
    """Some of a long stretch; the box is around the reference, and fills its axes."""
    axes = figure_of([evaluation, evaluation], "trajectory").axes[0]
    errors = evaluation.result.tas.errors
    far = np.isfinite(errors) & (errors >= evaluation.result.tas.thresholds[-1])
    crosses = [line for line in axes.get_lines() if line.get_marker() == "x"]
    for line in crosses:
        np.testing.assert_array_equal(line.get_xydata(), evaluation.positions[far][:, :2])
    assert len(crosses) == 2
    assert far.any()
    reference = evaluation.reference.positions
    for ends, axis in ((axes.get_xlim(), 0), (axes.get_ylim(), 1)):
        assert ends[0] < reference[:, axis].min() < reference[:, axis].max() < ends[1]


@pytest.mark.parametrize("format_name", ["tum", "kitti", "colmap"])
def test_one_figure_has_all_drawings(examples, format_name):
    files = (examples / name for name in FILES[format_name])
    figure = figure_of([evaluate(*files, format=format_name)])
    assert len(figure.axes) == 2 + 2 + 2 + 6  # trajectory and its colours, scores, errors, poses


def test_many_estimates_are_overlaid_and_the_first_ones_named(evaluation):
    names = [r"_a$\bad$.txt", "x" * 200, *map(str, range(2, 12))]
    scored = [dataclasses.replace(evaluation, name=name) for name in names]
    figure = figure_of(scored)
    panels = axes_of(figure)
    trajectories = figure.subfigs[0].subfigs[0]
    assert len(panels["roll [deg]"].get_lines()) == 13
    assert len(trajectories.axes[0].get_lines()) == 13 + len(scored)  # and their outliers
    (legend,) = trajectories.legends
    assert [text.get_text() for text in legend.get_texts()[:2]] == ["reference", names[0]]
    assert len(legend.get_texts()) + int(legend.get_title().get_text().split()[1]) == 13
    figure.draw_without_rendering()


def test_plot_is_a_figure_of_pyplot(in_notebook, evaluation):
    with matplotlib.rc_context({"backend": "agg"}):
        others = matplotlib.pyplot.get_fignums()  # of other tests
        for shown in (evaluation, [evaluation, evaluation]):
            figure = plot(shown, "trajectory", plot_mode="xz")
            assert matplotlib.pyplot.get_fignums() == [*others, figure.number]
            matplotlib.pyplot.close(figure)
        for options in ({"kind": "error"}, {"plot_mode": "zx"}):
            with pytest.raises(ValueError, match="must be one of"):
                plot(evaluation, **options)
        with pytest.raises(ValueError, match="no evaluation"):
            plot([])
        assert matplotlib.pyplot.get_fignums() == others
    assert "<td>" in in_notebook(evaluation)


def test_angles_have_no_jumps_and_are_those_of_the_rotations():
    """A car that turns left four times, its cameras looking along z with y down, as in KITTI."""
    n = 400
    heading = np.linspace(0, 1440, n)
    tilt = 3 * np.sin(np.arange(n) / 7)
    rotations = Rotation.from_euler("zxy", np.column_stack([tilt, -tilt, heading]), degrees=True)
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, :3] = rotations.as_matrix()
    poses[:, :3, 3] = np.cumsum(rotations.apply([0, 0, 1]), axis=0)
    stamps = np.arange(n) / 10
    estimate = poses.copy()
    estimate[:, :3, :3] = (rotations * Rotation.from_euler("y", 2, degrees=True)).as_matrix()
    estimate[100:200] = np.nan
    evaluation = evaluate(
        Trajectory(stamps, poses), Trajectory(stamps, estimate), format="tum", max_gap=0
    )
    panels = axes_of(figure_of([evaluation], "time"))
    for name, angles in (("roll", -tilt), ("pitch", heading), ("yaw", tilt)):
        reference, drawn = (line.get_ydata() for line in panels[f"{name} [deg]"].get_lines()[:2])
        np.testing.assert_allclose(reference, angles, atol=1e-6)
        assert np.nanmax(np.abs(drawn - reference)) < 5


def test_stretches_that_cost_most_stand_above_the_errors(evaluation):
    panels = axes_of(figure_of([evaluation], "errors"))
    labels = [text.get_text().strip() for text in panels["position error [m]"].texts]
    expected = [
        f"{deficit.share:.0%} {deficit.cause}"
        for deficit in evaluation.deficits
        if deficit.score == "TAS" and deficit.start is not None
    ]
    assert labels == expected
    assert len(expected) == 3
