"""What the paper's thresholds cost and gain, in sentences."""

import numpy as np
import pandas as pd
import pytest

from studies.axes import Axis
from studies.threshold_study.effects import COMPARED, EFFECTS
from studies.threshold_study.words import choices


def same(axes: list[Axis]) -> pd.DataFrame:
    """Make up effects that are the same for all values."""
    rows = [{"axis": axis.name, "value": value} for axis in axes for value in axis.values]
    numbers = dict.fromkeys(EFFECTS, 0.5) | {f"{name}_p": 0.01 for name in COMPARED}
    return pd.DataFrame(rows).assign(**numbers)


def test_a_value_without_end_is_in_words(axes: list[Axis]) -> None:
    table = same(axes)
    table.loc[table["value"] == "inf", "camera_dependence"] = 0.1
    found = {choice["axis"].name: choice for choice in choices(axes, table)}
    costs = "dependence on cameras 0.5 % instead of 0.1 % "
    assert found["registration_prescreen"]["costs"] == [costs + "(off)"]
    assert found["tas_n_thresholds"]["costs"] == [costs + "(exact area)"]
    assert sum(bool(one["costs"] or one["gains"]) for one in found.values()) == 2


@pytest.mark.parametrize("name", COMPARED)
def test_the_best_of_the_certain_values_is_named(name: str) -> None:
    """Not the very best, which may be so by chance, and not nothing because of that."""
    axis = Axis("a", "TAS", "quantile", "1", ("0.5", "1", "2", "4"))
    table = same([axis])
    sign = 1 if EFFECTS[name].larger_is_better else -1
    table[name] = 0.5 + sign * np.array([-0.06, 0, 0.08, 0.1])
    table[f"{name}_p"] = [0.01, np.nan, 0.01, 0.06]
    (choice,) = choices([axis], table)
    assert len(choice["costs"]) == len(choice["gains"]) == 1
    assert choice["costs"][0].endswith(" at 2")
    assert choice["gains"][0].endswith(" at 0.5")


def test_a_difference_that_is_small_or_may_be_chance_is_not_named(axes: list[Axis]) -> None:
    table = same(axes)
    row = (table["axis"] == "tas_quantile") & (table["value"] == "0.9")
    table.loc[row, "noise_range_of_means"] = 0.505
    table.loc[row, ["outlier_order", "outlier_order_p"]] = 0.9, 0.06
    assert not any(one["costs"] or one["gains"] for one in choices(axes, table))
