"""The matrix of findings: what is in it, and how what fails is marked."""

import pandas as pd
import pytest

from studies.beyond import figure as beyond

SCENARIOS = {
    "paper": ("cube", "gaussian", "uniform", 10.0),
    "strong_drift": ("car", "drift", "uniform", 10.0),
    "far": ("cube", "gaussian", "uniform", 1000.0),
}
ORDERS = {"ATE": (40, 66.5), "TAS(registration=refined)": (95, 67), "RAS": (70, float("nan"))}


@pytest.fixture(scope="module")
def table():
    keys = ("geometry", "error", "outliers", "outlier_side")
    return pd.DataFrame(
        [
            {"scenario": name, **dict(zip(keys, setting, strict=True))}
            | {"metric": metric, "noise_order": noise, "outlier_order": outliers}
            for name, setting in SCENARIOS.items()
            for metric, (noise, outliers) in ORDERS.items()
        ]
    )


def texts(axes):
    shown = [text.get_text() for text in axes.texts]
    return [text for text in shown if text[-1:].isdigit()]


def test_cells_hold_the_orders_and_what_fails_has_no_colour(table):
    noise, outliers = beyond.draw(table).axes
    assert texts(noise) == ["40", "95", "70"] * 3
    assert texts(outliers) == ["66", "67"] * 3  # one level of outliers: nothing to tell
    for axes, coloured in ((noise, [False, True, True]), (outliers, [False, True, False])):
        mesh = axes.collections[0]
        assert (~mesh.get_array().mask).tolist() == [coloured] * 3
