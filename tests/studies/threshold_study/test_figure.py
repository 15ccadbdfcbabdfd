"""The figure of the thresholds: maps above, and beneath the effects of options without a map."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from studies.axes import axes_of, plan
from studies.threshold_study import figure
from studies.threshold_study.effects import COMPARED, EFFECTS
from studies.threshold_study.figure import PANELS, PAPER, REGISTRATION
from studies.threshold_study.maps import OPTIONS, THRESHOLDS

NOISE = (0.1, 0.2, 0.4)
METRICS = {name: table.sweeps[0].metrics for name, table in plan(THRESHOLDS).items()}
AXES = [axis for axis in axes_of(THRESHOLDS, METRICS) if axis.option not in OPTIONS]


@pytest.fixture(scope="module")
def maps():
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
        numbers = {"n_outliers": outliers, "metric": "TAS", "right_order": 90 - 50 * order}
        rows.append(key | options | numbers)
    return pd.DataFrame(rows)


@pytest.fixture
def effects():
    rng = np.random.default_rng(0)
    rows = [
        {"axis": axis.name, "metric": axis.metric, "option": axis.option, "value": value}
        | {"paper": "yes" if value == axis.paper else "no"}
        | {name: rng.uniform(0.3, 0.9) for name in EFFECTS}
        | {f"{name}_error": np.nan if value == axis.paper else 0.01 for name in COMPARED}
        | {f"{name}_p": np.nan if value == axis.paper else 0.01 for name in COMPARED}
        for axis in axes_of(THRESHOLDS, METRICS)
        for value in axis.values
    ]
    return pd.DataFrame(rows)


def shown(effects):
    """Those that have no map."""
    return effects[~effects["option"].isin(OPTIONS)]


def test_rows_are_thresholds_and_what_needs_none(maps, effects):
    axes = figure.draw(effects, maps).axes
    assert len(axes) == 2 + 2 + 3 + len(PANELS)
    labels = [label.get_text() for label in axes[0].get_yticklabels()]
    assert labels == ["0.5", "1", "2", "half-score distance"]
    values = axes[0].collections[0].get_array()
    assert values[:, 0].tolist() == [75, 80, 90, 100]
    assert [patch.get_y() for patch in axes[0].patches] == [0.5]  # the paper's value is framed


def test_each_option_of_the_registration_is_varied_alone(maps, effects):
    order, prescreen, count = figure.draw(effects, maps).axes[4:7]
    assert [text.get_text() for text in order.texts] == ["85", "85", "65", "65"]
    assert [text.get_text() for text in prescreen.texts] == ["85"] * 4
    assert [label.get_text() for label in count.get_yticklabels()] == ["100", "1000"]
    assert [label.get_text() for label in count.get_xticklabels()] == ["0", "80"]


def test_every_value_without_a_map_is_shown_and_named(maps, effects):
    half = len(effects) // 2  # in several tables, which are joined
    panels = figure.draw(effects[:half], effects[half:], maps).axes[7:]
    labels = panels[0].get_yticklabels()
    assert len(labels) == len(shown(effects)) + len(AXES)
    bold = [label.get_text() for label in labels if label.get_fontweight() == "bold"]
    assert [text for text in bold if ":" in text] == [axis.title for axis in AXES]
    assert [text for text in bold if ":" not in text] == [axis.paper for axis in AXES]
    assert "exact area" in [label.get_text() for label in labels]
    for panel, effect in zip(panels, PANELS, strict=True):
        drawn = np.hstack([line.get_data() for line in panel.lines if line.get_marker() == "o"])
        assert set(drawn[0].round(9)) == set(shown(effects)[effect].round(9))
        assert len(set(drawn[1])) == len(shown(effects))  # no two in one row


def test_effects_of_what_does_not_vary_are_left_out(maps, effects):
    effects[["outlier_order", "outlier_order_smallest", "outlier_order_error"]] = np.nan
    few = effects[effects["axis"] == "pas_weight"].reset_index(drop=True)
    for table in (effects, few):
        drawn = figure.draw(table, maps)
        drawn.draw_without_rendering()
        for effect, panel in zip(PANELS, drawn.axes[7:], strict=True):
            found = np.hstack(
                [line.get_xdata() for line in panel.lines if line.get_marker() == "o"]
            )
            expected = 0 if effect == "outlier_order" else len(shown(table))
            assert np.isfinite(found).sum() == expected
