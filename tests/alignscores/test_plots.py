"""Plots of estimates: histograms, trajectories and profiles, and what they leave out."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from alignscores import evaluate
from alignscores.histogram import AlignmentScore
from alignscores.plots import profile_panel, score_figure, score_panel, trajectory_panel
from alignscores.trajectories.files import Trajectory, read_kitti


@pytest.mark.parametrize("errors", [[0.0] * 37, [0.35, 0.5, 2.0], [np.inf] * 5])
def test_the_shaded_share_of_the_box_is_the_score(errors):
    result = AlignmentScore(np.array(errors), np.arange(1, 11) / 10)
    axes = Figure().subplots()
    frequency = result.cumulative_frequency
    score_panel(axes, result.thresholds, frequency, len(errors), name="XAS", score=result.score)
    values, edges, _ = axes.patches[0].get_data()
    assert np.sum(values * np.diff(edges)) / len(errors) == pytest.approx(result.score)
    assert (axes.get_xlim(), axes.get_ylim()) == ((0, 1), (0, len(errors)))
    assert axes.texts[0].get_text() == f"XAS = {result.score:.3f}"


@pytest.fixture
def evaluation(examples):
    files = (examples / f"kitti/{name}.txt" for name in ("reference", "estimate"))
    return evaluate(*files, format="kitti", registration="pcr99", repeat=1)


def test_a_row_of_panels_for_each_estimate(evaluation):
    named = [dataclasses.replace(evaluation, name=name) for name in ("one", "_two")]
    figure = score_figure(named, title="registration pcr99")
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    titles = [axes.get_title(loc="left") for axes in panels]
    assert (titles[0], titles[3]) == ("one\nposition errors", "_two\nposition errors")
    assert titles[6:] == ["TAS over its threshold", "RAS over its threshold", ""]
    labels = [text.get_text() for text in panels[-1].get_legend().get_texts()]
    assert [label.split("\n")[0] for label in labels] == ["one", "_two"]
    assert figure.get_suptitle() == "registration pcr99"
    result = evaluation.result
    texts = [axes.texts[0].get_text() for axes in panels[:2]]
    assert texts == [f"TAS = {result.tas.score:.3f}", f"RAS = {result.ras.score:.3f}"]


def test_many_estimates_share_axes(evaluation):
    names = [r"_a$\bad$.txt", "x" * 200, *map(str, range(2, 12))]
    figure = score_figure([dataclasses.replace(evaluation, name=name) for name in names])
    positions, rotations, *_, last = figure.axes
    for axes, score in ((positions, evaluation.result.tas), (rotations, evaluation.result.ras)):
        curves = [line.get_ydata() for line in axes.get_lines()]
        curves += [path.vertices[:, 1] for path in axes.collections[0].get_paths()]
        assert len(curves) == len(names)
        for shares in curves:
            np.testing.assert_array_equal(shares, score.cumulative_frequency / 40)
    legend = last.get_legend()
    assert legend.get_texts()[0].get_text().split("\n")[0] == names[0]
    shown = len(legend.get_texts())
    expected = f"the first {shown} in the table; in grey {len(names) - shown} others"
    assert legend.get_title().get_text() == expected


def test_profiles():
    """A dot where each is one half, and no units at which there is nothing to see."""
    units = np.geomspace(1e-6, 1e6, 121)
    scores = [units / (units + half) for half in (1.0, 10.0)]
    axes = Figure().subplots()
    profile_panel(axes, units, scores, [1.0, np.inf])
    *curves, line, dot = axes.get_lines()
    for curve, score in zip(curves, scores, strict=True):
        x, y = curve.get_data()
        np.testing.assert_array_equal(y, score[np.isin(units, x)])
    assert axes.get_xlim() == pytest.approx((0.1, 100), rel=0.5)
    assert dot.get_xydata().tolist() == [[1.0, 0.5]]
    assert line.get_ydata() == [0.5, 0.5]
    profile_panel(Figure().subplots(), units, [np.ones(121)], [0.0])  # warns of nothing


def test_the_trajectory_is_aligned_and_coloured_by_its_errors(evaluation):
    matches, result = evaluation.matches, evaluation.result
    axes = Figure().subplots()
    trajectory_panel(axes, evaluation)
    crosses, dots = axes.collections
    errors = result.tas.errors
    within = errors < result.tas.unit
    np.testing.assert_array_equal(dots.get_array(), errors[within])
    np.testing.assert_array_equal(crosses.get_array(), errors[~within & np.isfinite(errors)])
    # The scene is thinnest along z, and no dot is farther from its camera than its error.
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x", "y")
    gaps = np.linalg.norm(dots.get_offsets() - matches.gt_poses[within, :2, 3], axis=1)
    assert np.all(gaps <= errors[within] + 1e-12)
    reach = np.ptp(matches.gt_poses[:, 0, 3])  # poses that are far off do not shrink the rest
    assert np.ptp(axes.get_xlim()) == np.ptp(axes.get_ylim()) == pytest.approx(1.1 * reach)


def test_an_estimate_that_cannot_be_aligned(examples):
    reference = read_kitti(examples / "kitti/reference.txt")
    lost = Trajectory(reference.keys, np.full((40, 4, 4), np.nan))
    axes = Figure().subplots()
    trajectory_panel(axes, evaluate(reference, lost))
    assert axes.texts[0].get_text() == "could not be aligned"
    assert not axes.collections
