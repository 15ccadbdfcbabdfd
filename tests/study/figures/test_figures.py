"""Properties of every figure of the paper."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from figures import style
from figures.paper import FIGURES

ON_A_PAGE = {"rotations", "combined", "maa_vs_pas"}  # the others in a column


@pytest.mark.parametrize("name", FIGURES)
def test_texts_are_legible_and_neither_clipped_nor_in_each_others_way(draw, name):
    figure = draw(name)
    assert figure.get_figwidth() == (style.PAGE if name in ON_A_PAGE else style.COLUMN)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    boxes = [(text, text.get_window_extent(canvas.get_renderer())) for text in texts(figure)]
    assert len(boxes) > 10
    for text, box in boxes:
        assert text.get_fontsize() >= 6, text
        assert (box.min >= figure.bbox.min).all(), text
        assert (box.max <= figure.bbox.max).all(), text
    lower, upper = (np.array([getattr(box, end) for _, box in boxes]) for end in ("min", "max"))
    overlaps = np.minimum(upper, upper[:, None]) - np.maximum(lower, lower[:, None])
    pairs = np.argwhere(np.triu(overlaps.min(axis=2) > 2, k=1))  # pixels of 1/100 inch: margins
    assert [(boxes[first][0], boxes[other][0]) for first, other in pairs] == []


def texts(figure):
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
