"""Plots of estimates: histograms, trajectories and profiles, and what they leave out."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure

from alignscores import evaluate
from alignscores.cli.saving import picture
from alignscores.histogram import AlignmentScore
from alignscores.plots import (
    LONGEST,
    NAMED,
    STYLE,
    profile_panel,
    score_figure,
    score_panel,
    trajectory_panel,
)
from alignscores.trajectories.files import read_kitti


@pytest.mark.parametrize("errors", [[0.0] * 37, [0.35, 0.5, 2.0], [np.inf] * 5])
def test_the_shaded_share_of_the_box_is_the_score(errors):
    result = AlignmentScore(np.array(errors), np.arange(1, 11) / 10)
    axes = Figure().subplots()
    score_panel(
        axes,
        result.thresholds,
        result.cumulative_frequency,
        len(errors),
        name="XAS",
        score=result.score,
    )
    values, edges, _ = axes.patches[0].get_data()
    assert np.sum(values * np.diff(edges)) / len(errors) == pytest.approx(result.score)
    assert axes.get_xlim() == (0, 1)
    assert axes.get_ylim() == (0, len(errors))
    assert axes.get_yticks()[-1] == len(errors)
    assert axes.texts[0].get_text() == f"XAS = {result.score:.3f}"


@pytest.mark.parametrize("power", [0.05, 0.3, 1, 3, 20])
def test_the_value_stands_clear_of_the_curve(power):
    thresholds = np.arange(1, 101) / 100
    frequency = np.round(100 * thresholds**power)
    figure = Figure(figsize=(3.3, 1.5))
    axes = figure.subplots()
    score_panel(axes, thresholds, frequency, 100, name="TAS", score=float(frequency.mean() / 100))
    figure.draw_without_rendering()
    for text in axes.texts:
        box = text.get_window_extent().transformed(axes.transData.inverted())
        inside = (thresholds >= box.x0) & (thresholds <= box.x1)
        below, above = frequency[inside].min() > box.y1, frequency[inside].max() < box.y0
        assert below or above


@pytest.fixture
def evaluation(examples):
    """The example, by the registration of the paper."""
    files = (examples / f"kitti/{name}.txt" for name in ("reference", "estimate"))
    return evaluate(*files, format="kitti", registration="pcr99", repeat=1)


@pytest.fixture
def named(evaluation):
    """(names) -> that many estimates, all of which are the same."""

    def named(*names):
        found = [dataclasses.replace(evaluation, name=name) for name in names]
        for one in found:
            vars(one)["profiles"] = evaluation.profiles  # computed once
        return found

    return named


@pytest.mark.parametrize("n", [5, 30, 300])
def test_many_estimates_share_axes(evaluation, named, n):
    result = evaluation.result
    names = [r"_a$\bad$.txt", "x" * 200, *map(str, range(2, n))]
    figure = score_figure(named(*names))
    positions, rotations, paths, *_, last = figure.axes
    shown = min(n, NAMED)
    for axes, score in ((positions, result.tas), (rotations, result.ras)):
        curves = [line.get_ydata() for line in axes.get_lines()]
        curves += [path.vertices[:, 1] for path in axes.collections[0].get_paths()]
        assert len(curves) == n
        for shares in curves:
            np.testing.assert_array_equal(shares, score.cumulative_frequency / 40)
    assert len(paths.get_lines()) == 1 + shown
    labels = [text.get_text().split("\n")[0] for text in last.get_legend().get_texts()]
    assert labels[0] == names[0]
    assert len(labels) == shown
    assert max(map(len, labels)) == LONGEST
    title = last.get_legend().get_title().get_text()
    assert title == (f"the first 8 in the table; in grey {n - 8} others" if n > 8 else "")
    styles = {(line.get_color(), line.get_linestyle()) for line in positions.get_lines()}
    assert len(styles) == shown


def test_pictures_of_many_estimates_are_small(named, tmp_path):
    """One with a row each took minutes, and gigabytes."""
    figure = score_figure(named(*map(str, range(300))))
    for suffix in (".png", ".pdf", ".svg"):
        assert len(picture(figure, tmp_path / f"many{suffix}")) < 3e5


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


@pytest.mark.parametrize("decades", [1, 2, 3, 5])
def test_labels_of_thresholds_do_not_overlap(decades):
    units = np.geomspace(1e-3, 10.0 ** (decades - 3), 64)
    with rc_context(STYLE):
        figure = Figure(figsize=(3.5, 3))
        axes = figure.subplots()
        profile_panel(axes, units, [np.linspace(0.2, 0.8, 64)], [np.inf])
        figure.draw_without_rendering()
    boxes = [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]
    boxes = [one for one in boxes if axes.bbox.x0 <= (one.x0 + one.x1) / 2 <= axes.bbox.x1]
    assert len(boxes) >= decades
    boxes.sort(key=lambda one: one.x0)
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


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
    assert gaps.max() > 0.5 * errors[within].max()
    title = axes.get_title(loc="left") + axes.get_title()
    assert title == "aligned; × 3 of 40 off by d or more,\n3 not estimated"


def test_an_estimate_that_cannot_be_aligned(examples):
    reference = read_kitti(examples / "kitti/reference.txt")
    lost = reference._replace(poses=np.full((40, 4, 4), np.nan))
    axes = Figure().subplots()
    trajectory_panel(axes, evaluate(reference, lost))
    assert axes.texts[0].get_text() == "could not be aligned"
    assert not axes.collections


def test_far_off_poses_do_not_shrink_the_rest(evaluation):
    axes = Figure().subplots()
    trajectory_panel(axes, evaluation)
    reach = np.ptp(evaluation.matches.gt_poses[:, 0, 3])
    assert np.ptp(axes.get_xlim()) == pytest.approx(1.1 * reach)
    assert np.ptp(axes.get_ylim()) == pytest.approx(1.1 * reach)
