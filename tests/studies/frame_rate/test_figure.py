"""The figure of the frame rates: what its marks stand for."""

from itertools import product

import pandas as pd
import pytest

from studies.frame_rate import figure as frame_rate

SUMMARY = {"TAS": (50.0, 90.0, 60.0), "HalfDistance": (2.0, 80.0, 80.0)}


@pytest.fixture(scope="module")
def table():
    return pd.DataFrame(
        [
            {"scenario": scenario, "metric": metric, "every": k, "sigma_t": sigma}
            | {"mean": 0.9 - sigma / k if metric == "TAS" else sigma}
            | {"dependence": moves, "order": one, "order_across": across}
            for scenario in ("car", "orbit")
            for metric, (moves, one, across) in SUMMARY.items()
            for k, sigma in product((1, 5, 20), (0.2, 0.8))
        ]
    )


def test_a_line_for_each_noise_level_over_the_frame_rates(table):
    tas, half, _ = frame_rate.draw(table).axes
    assert [label.get_text() for label in tas.get_xticklabels()] == ["1", "5", "20"]
    assert [line.get_ydata().tolist() for line in half.lines] == [[0.2] * 3, [0.8] * 3]
    assert tas.lines[0].get_ydata() == pytest.approx([0.7, 0.86, 0.89])
    assert tas.get_ylim() == (0, 1)
    assert half.get_ylim()[0] == 0
    for axes in (tas, half):
        assert len({line.get_color() for line in axes.lines}) == 2
        assert [text.get_text()[-3:] for text in axes.texts[:2]] == ["0.2", "0.8"]


def test_a_row_for_each_metric_with_its_order_at_one_rate_and_across(table):
    _, _, orders = frame_rate.draw(table).axes
    assert [label.get_text() for label in orders.get_yticklabels()] == [
        "TAS",
        "half-score distance",
    ]
    one, across = (line for line in orders.lines if line.get_linestyle() == "None")
    assert one.get_xdata().tolist() == [90, 80]
    assert across.get_xdata().tolist() == [60, 80]
    assert one.get_marker() != across.get_marker()
