"""The figure of the thresholds: a row for each value, a column for each effect."""

import numpy as np

from studies.threshold_study.figure import draw


def test_every_value_is_shown_and_named_and_the_papers_is_bold(axes, table):
    table = table.assign(outlier_order=np.nan)  # as where one number of outliers is run
    figure = draw(table)
    figure.draw_without_rendering()
    shown = [
        np.isfinite(
            [x for line in each.lines if line.get_marker() == "o" for x in line.get_xdata()]
        )
        for each in figure.axes
    ]
    assert [own.sum() for own in shown] == [len(table), 0, *[len(table)] * 3]
    labels = figure.axes[0].get_yticklabels()
    bold = [label.get_text() for label in labels if label.get_fontweight() == "bold"]
    assert bold[len(axes) :] == [axis.paper for axis in axes]
    assert "off" in [label.get_text() for label in labels]
