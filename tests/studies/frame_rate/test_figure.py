"""The figure of the frame rates: what its marks stand for."""

from itertools import product

import pandas as pd
import pytest

from studies.frame_rate import figure as frame_rate

ORDERS = {  # at one rate and across, where nothing is lost
    "TAS(registration=refined)": (90.0, 60.0),
    "HalfDistance": (80.0, 80.0),
    "HalfDistance(score=0.25)": (85.0, 85.0),
}


@pytest.fixture(scope="module")
def table():
    return pd.DataFrame(
        {"scenario": scenario, "metric": metric, "lost": lost, "step": step}
        | {"order": one - lost + step - 15, "order_across": across - lost + step - 15}
        for scenario, lost, step in product(("car", "orbit"), (0, 30), (15, 20))
        for metric, (one, across) in ORDERS.items()
    )


@pytest.fixture(scope="module")
def means():
    return pd.DataFrame(
        {"scenario": scenario, "metric": metric, "lost": lost, "every": k, "sigma_t": sigma}
        | {"mean": (0.9 - sigma / k if metric.startswith("TAS") else sigma) + lost}
        for scenario, lost in product(("car", "orbit"), (0, 30))
        for metric in ORDERS
        for k, sigma in product((1, 5, 20), (0.2, 0.8))
    )


def test_a_line_for_each_noise_level_over_the_frame_rates(table, means):
    tas, half, quarter, *_ = frame_rate.draw(table, means).axes
    assert [label.get_text() for label in tas.get_xticklabels()] == ["1", "5", "20"]
    assert [line.get_ydata().tolist() for line in half.lines] == [[0.2] * 3, [0.8] * 3]
    assert tas.lines[0].get_ydata() == pytest.approx([0.7, 0.86, 0.89])
    assert tas.get_ylim() == (0, 1)
    assert half.get_ylim()[0] == 0
    for axes in (tas, half, quarter):
        assert len({line.get_color() for line in axes.lines}) == 2
        assert [text.get_text()[-3:] for text in axes.texts[:2]] == ["0.2", "0.8"]


def test_a_panel_for_each_share_lost_with_a_row_for_each_metric(table, means):
    *_, none, some = frame_rate.draw(table, means).axes
    assert [label.get_text() for label in none.get_yticklabels()] == [
        *("TAS, refined", "half-score distance", "quarter-score distance")
    ]
    assert [axes.get_title("left") for axes in (none, some)] == ["0 % lost", "30 % lost"]
    for axes, lost in ((none, 0), (some, 30)):
        one, across = (line for line in axes.lines if line.get_linestyle() == "None")
        assert one.get_xdata().tolist() == [90 - lost, 80 - lost, 85 - lost]
        assert across.get_xdata().tolist() == [60 - lost, 80 - lost, 85 - lost]
        assert one.get_marker() != across.get_marker()
