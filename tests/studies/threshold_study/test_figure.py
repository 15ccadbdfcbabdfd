"""The maps of thresholds: what is in their rows and columns."""

from itertools import product

import pandas as pd
import pytest
from figures.threshold_maps import COLUMNS, PAPER, REGISTRATION

from figures import threshold_maps

NOISE = (0.1, 0.2, 0.4)


@pytest.fixture(scope="module")
def table():
    rows = []
    for (name, option), n, noise in product(
        (("tas", "max_threshold"), ("ras", "max_threshold_deg")), (30, 100), NOISE
    ):
        key = {"map": name, "geometry": "cube", "n_cameras": n, "n_outliers": 0, "noise": noise}
        for share in (0.5, 1.0, 2.0):
            value = share * PAPER[option]
            rows.append(
                key | {"metric": f"{name} {value}", option: value, "right_order": 70 + 10 * share}
            )
        rows.append(key | {"metric": "HalfDistance", "right_order": 100.0})
    for order, prescreen, count, outliers in product((0.1, 0.5), (0.1, 0.3), (100, 1000), (0, 80)):
        key = {"map": "registration", "geometry": "cube", "n_cameras": 100, "noise": 0.1}
        options = dict(zip(REGISTRATION, (order, prescreen, float(count)), strict=True))
        rows.append(
            key
            | options
            | {"n_outliers": outliers, "metric": "TAS", "right_order": 90 - 50 * order}
        )
    return pd.DataFrame(rows).reindex(columns=COLUMNS)


def test_rows_are_thresholds_and_what_needs_none(table):
    figure = threshold_maps.draw(table)
    axes = figure.axes
    assert len(axes) == 2 + 2 + 3
    labels = [label.get_text() for label in axes[0].get_yticklabels()]
    assert labels == ["0.5", "1", "2", "half-score distance"]
    values = axes[0].collections[0].get_array()
    assert values[:, 0].tolist() == [75, 80, 90, 100]
    assert [patch.get_y() for patch in axes[0].patches] == [0.5]  # the paper's value is framed


def test_each_option_of_the_registration_is_varied_alone(table):
    order, prescreen, count = threshold_maps.draw(table).axes[-3:]
    assert [text.get_text() for text in order.texts] == ["85", "85", "65", "65"]
    assert [text.get_text() for text in prescreen.texts] == ["85"] * 4
    assert [label.get_text() for label in count.get_yticklabels()] == ["100", "1000"]
    assert [label.get_text() for label in count.get_xticklabels()] == ["0", "80"]
