"""The figure of the thresholds: a row for each value, a column for each effect."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from studies.axes import Axis
from studies.threshold_study.figure import draw


def dots(figure: Figure) -> list[int]:
    """Count what each panel shows."""
    lines = [[line for line in axes.lines if line.get_marker() == "o"] for axes in figure.axes]
    return [int(np.isfinite(np.hstack([each.get_xdata() for each in own])).sum()) for own in lines]


def test_every_value_is_shown_and_named_and_the_papers_is_bold(
    axes: list[Axis], table: pd.DataFrame
) -> None:
    half = len(table) // 2  # in several tables, which are joined
    figure = draw(table[:half], table[half:])
    assert dots(figure) == [len(table)] * len(figure.axes)
    labels = figure.axes[0].get_yticklabels()
    bold = [label.get_text() for label in labels if label.get_fontweight() == "bold"]
    assert bold == [*(axis.title for axis in axes), *(axis.paper for axis in axes)]
    assert "exact area" in [label.get_text() for label in labels]


@pytest.mark.parametrize("axis", ["pas_weight", ""])
def test_effects_of_what_does_not_vary_are_left_out(table: pd.DataFrame, axis: str) -> None:
    few = table[table["axis"].str.startswith(axis)].reset_index(drop=True)
    few[["outlier_order", "outlier_order_smallest", "outlier_order_error"]] = np.nan
    figure = draw(few)
    figure.draw_without_rendering()
    assert dots(figure) == [len(few), 0, *[len(few)] * 4]
