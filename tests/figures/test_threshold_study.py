import numpy as np
import pandas as pd
import pytest
from studies.parameters.axes import axes_of, load_parameters
from studies.parameters.effects import COMPARED, EFFECTS

from figures import threshold_study

SHOWN = (
    "noise_power",
    "outlier_power",
    "majority_power",
    "noise_range_of_means",
    "camera_dependence",
    "seed_noise",
)
METRICS = load_parameters("threshold").tables["outliers"].sweeps[0].metrics
AXES = axes_of("threshold", METRICS)


@pytest.fixture
def effects():
    """A table of the study, made up."""
    rng = np.random.default_rng(0)
    rows = [
        {"axis": axis.name, "metric": axis.metric, "option": axis.option, "value": value}
        | {"paper": "yes" if value == axis.paper else "no"}
        | {name: rng.uniform(0.3, 0.9) for name in EFFECTS}
        | {f"{name}_error": np.nan if value == axis.paper else 0.01 for name in COMPARED}
        | {f"{name}_p": np.nan if value == axis.paper else 0.01 for name in COMPARED}
        for axis in AXES
        for value in axis.values
    ]
    return pd.DataFrame(rows)


def test_every_value_of_every_axis_is_shown_and_named(effects):
    panels = threshold_study.draw(effects[list(threshold_study.COLUMNS)]).axes
    labels = panels[0].get_yticklabels()
    assert len(labels) == len(effects) + len(AXES)
    bold = [label.get_text() for label in labels if label.get_fontweight() == "bold"]
    assert [text for text in bold if ":" in text] == [axis.title for axis in AXES]
    assert [text for text in bold if ":" not in text] == [axis.paper for axis in AXES]
    assert "exact area" in [label.get_text() for label in labels]
    for panel, effect in zip(panels, SHOWN, strict=True):
        drawn = np.hstack([line.get_data() for line in panel.lines if line.get_marker() == "o"])
        assert set(drawn[0].round(9)) == set(effects[effect].round(9))
        assert len(set(drawn[1])) == len(effects)  # no two in one row


def test_effects_of_what_does_not_vary_are_left_out(effects):
    effects[["outlier_power", "outlier_power_smallest", "outlier_power_error"]] = np.nan
    few = effects[effects["axis"] == "pas_weight"].reset_index(drop=True)
    for table in (effects, few):
        figure = threshold_study.draw(table)
        figure.draw_without_rendering()
        panels = dict(zip(SHOWN, figure.axes, strict=True))
        for effect, panel in panels.items():
            drawn = np.hstack(
                [line.get_xdata() for line in panel.lines if line.get_marker() == "o"]
            )
            assert np.isfinite(drawn).sum() == (0 if effect == "outlier_power" else len(table))
