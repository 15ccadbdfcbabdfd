import numpy as np
import pytest
from matplotlib.figure import Figure

from alignscores.histogram import AlignmentScore
from alignscores.plots import score_panel


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
