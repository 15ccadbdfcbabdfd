"""The figure of today's protocols: what its cells stand for."""

import pandas as pd
import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from studies.protocols import figure

COLUMNS = ["question", "asked", "metric", "order", "p_chance", "p_behind"]
CELLS = [
    ("outliers", "noise", "auc@30:vggt", 60.2, 0.001, 0.001),
    ("outliers", "noise", "TAS(registration=refined)", 97.0, 0.001, 1.0),
    ("outliers", "noise", "ATE", 51.0, 0.3, 0.001),
    ("frame_rate", "noise", "TAS(registration=refined)", 80.0, 0.001, 0.2),
    ("frame_rate", "noise", "ATE", 30.0, 1.0, 0.6),
]


@pytest.fixture(scope="module")
def axes():
    return figure.draw(pd.DataFrame(CELLS, columns=COLUMNS)).axes[0]


def test_rows_are_metrics_by_kind_and_columns_questions(axes):
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["TAS, refined", "ATE", "auc@30:vggt"]
    assert axes.get_yticks().tolist() == sorted(axes.get_yticks())
    titles = {text.get_text() for text in axes.texts}
    assert {"Outliers", "Frame rate", "New scores", "Today’s protocols"} <= titles
    assert [label.get_text() for label in axes.get_xticklabels()] == ["noise", "noise"]


def test_a_number_or_a_cross_or_a_dash_and_a_frame_where_it_is_not_behind(axes):
    rows = dict(zip(["TAS", "ATE", "auc"], axes.get_yticks(), strict=True))
    x = axes.get_xticks()
    texts = {text.get_position(): text.get_text() for text in axes.texts}
    found = [[texts[at, y] for at in x] for y in rows.values()]
    assert found == [["97", "80"], ["×", "×"], ["60", "–"]]
    cells = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    framed = [cell.get_center() for cell in cells if not cell.get_fill()]
    assert framed == [pytest.approx((at, rows["TAS"])) for at in x]


def test_more_is_darker_in_greyscale(axes):
    filled = [patch for patch in axes.patches if patch.get_fill()]
    lightness = [sum(to_rgb(patch.get_facecolor()[:3])) for patch in filled]
    by_order = dict(zip([cell[3] for cell in CELLS], lightness, strict=True))
    assert by_order[97.0] < by_order[80.0] < by_order[60.2] < by_order[51.0] == by_order[30.0]
