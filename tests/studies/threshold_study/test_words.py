"""What the paper's thresholds cost and gain, in sentences."""

import numpy as np
import pandas as pd
import pytest

from studies.axes import Axis
from studies.threshold_study import maps
from studies.threshold_study.effects import COMPARED, EFFECTS
from studies.threshold_study.words import choices, to_markdown

TIMES = pd.DataFrame(
    {
        "n_cameras": [20, 20, 20, 20],
        "axis": ["registration_n_hypotheses"] * 2 + ["registration_order"] * 2,
        "value": ["30", "1000", "0.1", "0.3"],
        "milliseconds": [2.0, 3.0, 2.0, 2.9],
    }
)


def same(axes: list[Axis]) -> pd.DataFrame:
    """Make up effects that are the same for all values."""
    rows = [{"axis": axis.name, "value": value} for axis in axes for value in axis.values]
    numbers = dict.fromkeys(EFFECTS, 0.5) | {f"{name}_p": 0.01 for name in COMPARED}
    return pd.DataFrame(rows).assign(**numbers)


def test_sentences_tell_certain_differences_alone(
    axes: list[Axis], monkeypatch: pytest.MonkeyPatch
) -> None:
    table = same(axes)
    row = (table["axis"] == "tas_quantile") & (table["value"] == "0.9")
    table.loc[row, ["noise_order", "outlier_order"]] = 0.7, 0.3
    table.loc[row, ["noise_range_of_means", "seed_noise"]] = 0.505, 0.3
    table.loc[row, ["noise_range", "noise_order_smallest"]] = 0.9, 0.9  # not in sentences
    monkeypatch.setattr(maps, "sentences", lambda _: ["what the maps say"])
    text = to_markdown(axes, table, TIMES, 37, pd.DataFrame())
    (line,) = [line for line in text.splitlines() if line.startswith("- **TAS: quantile")]
    costs, gains = line.split("*Gains:*")
    assert line.startswith("- **TAS: quantile that is d, 0.75**, against 0.9. *Costs:* order of")
    assert "order of noise 0.5 % instead of 0.7 % at 0.9" in costs
    assert "seed noise 0.5000 instead of 0.3000 at 0.9" in costs
    assert "order of outliers 0.5 % against 0.3 % at 0.9" in gains
    assert "range" not in line
    assert "smallest" not in line
    assert text.count("*Costs:* nothing that these trials can tell") == 8
    assert "Of 9 values that the paper chose by experience, **1 cost something**" in text
    assert "**1 gain something**" in text
    free = text.partition("No cost shows for ")[2].partition("\n")[0]
    assert "quantile" not in free
    assert "m as share of n" in free
    assert "37 trials" in text
    (time,) = [line for line in text.splitlines() if " ms" in line]  # the others differ by less
    assert time == "- TAS, n_hypotheses, 20 cameras: 30 2.00 ms, 1000 3.00 ms."


def test_a_value_without_end_is_in_words(axes: list[Axis]) -> None:
    table = same(axes)
    table.loc[table["value"] == "inf", "camera_dependence"] = 0.1
    found = {choice["axis"].name: choice for choice in choices(axes, table)}
    costs = "dependence on cameras 0.5 % instead of 0.1 % "
    assert found["registration_prescreen"]["costs"] == [costs + "(off)"]
    assert found["tas_n_thresholds"]["costs"] == [costs + "(exact area)"]
    assert found["tas_n_thresholds"]["others"] == "exact area"
    assert found["tas_n_thresholds"]["paper"] == "100"
    assert {name for name, one in found.items() if one["costs"] or one["gains"]} == {
        "registration_prescreen",
        "tas_n_thresholds",
    }


@pytest.mark.parametrize("name", COMPARED)
def test_the_best_of_the_certain_values_is_told(name: str) -> None:
    """Not the very best, which may be so by chance, and not nothing because of that."""
    axis = Axis("a", "TAS", "quantile", "1", ("0.5", "1", "2", "4"))  # which has no map
    table = same([axis])
    sign = 1 if EFFECTS[name].larger_is_better else -1
    table[name] = 0.5 + sign * np.array([-0.06, 0, 0.08, 0.1])
    table[f"{name}_p"] = [0.01, np.nan, 0.01, 0.06]
    (choice,) = choices([axis], table)
    effect = EFFECTS[name]
    ours, best, worst = (effect.write(0.5 + sign * step) for step in (0, 0.08, -0.06))
    assert choice["costs"] == [f"{effect.words} {ours} instead of {best} at 2"]
    assert choice["gains"] == [f"{effect.words} {ours} against {worst} at 0.5"]
