"""What the frame rate does to metrics, on trials whose dependence is known."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.command import ConfigError
from experiments.config import load_sweep
from experiments.tables import Trials, read_trials
from studies.__main__ import main
from studies.frame_rate.rates import compare, means, plan
from studies.order import trials_needed

from ..conftest import undescribed

MakeUp = Callable[..., Trials]


@pytest.fixture
def scenario(make_up: MakeUp) -> Trials:
    """An error that the frame rate does not touch, and a score that it raises by more than noise.

    The error rises by 1 a noise level. So does the score's loss, by 0.1; at half the frame rate it
    is 0.25 higher. With half of the cameras lost the error is infinite.
    """
    sweep = load_sweep(
        [
            *("sigma_t=[1,2,3,6]", "n_cameras=[40]", "n_outliers=[0,20]", "sigma_r_deg=[1]"),
            *("trials=4", "metrics=[ATE,TAS]"),
        ]
    )
    sweeps = [replace(sweep, name="s", every=k, changes=f"every={k}") for k in (1, 2)]
    trials = make_up(*sweeps, value=lambda metric, cell, *_: cell.sigma_t)
    table = trials.table
    table["TAS"] = 0.5 - 0.1 * table["sigma_t"] + 0.25 * (table["settings"] == "every=2")
    table.loc[table["n_outliers"] == 20, "ATE"] = np.inf
    return trials


def test_dependence_and_order_by_hand(scenario: Trials) -> None:
    table = compare({"s": scenario})
    assert len(table) == 2 * 2 * 2  # shares lost, metrics, steps
    assert table["lost"].unique().tolist() == [0, 50]
    found = table.set_index(["metric", "lost", "step"])
    # The score moves by 0.25 at each level, of a range of 0.75. Of two neighbours the better one
    # loses where it has the full rate and the worse one half, up to two levels: of four pairs, two.
    # From 3 to 6 it falls by 0.3. Steps of 100 % are those from 1 to 2 and from 3 to 6.
    numbers = ["dependence", "order", "order_across"]
    assert found.loc[("ATE", 0, 50), numbers].tolist() == [0, 100, 100]
    assert found.loc[("TAS", 0, 50), numbers].tolist() == pytest.approx([100 / 3, 100, 50])
    assert found.loc[("TAS", 0, 100), numbers].tolist() == pytest.approx([100 / 3, 100, 75])
    blind = found.loc[("ATE", 50, 50)]
    assert np.isnan(blind["dependence"])
    assert blind[["order", "order_across", "trials"]].tolist() == [50, 50, np.inf]
    assert found.loc[("TAS", 50, 100), "trials"] == trials_needed(1)
    assert found.loc[("TAS", 50, 50), "trials_across"] == np.inf


def test_means_by_hand(scenario: Trials) -> None:
    found = means({"s": scenario})
    assert undescribed(means, found) == []
    of = found.set_index(["metric", "lost", "every", "sigma_t"])["mean"]
    assert len(of) == 2 * 2 * 2 * 4
    assert of["TAS", 0, 2, 3] == pytest.approx(0.45)
    assert of["ATE", 0, 1, 2] == 2
    assert of["ATE", 50, 1, 2] == np.inf


def test_the_same_draws_are_one_unit_at_all_rates(make_up: MakeUp) -> None:
    """What is repeated at each rate is no more certain than it is at one."""
    sweep = load_sweep(["sigma_t=[1,2]", "n_outliers=[0]", "trials=12", "metrics=[ATE]"])
    once = make_up(sweep, value=lambda *key: key[1].sigma_t + 2 * key[3].random()).table["ATE"]
    sweeps = [replace(sweep, name="s", every=k, changes=f"every={k}") for k in (1, 2, 5)]
    trials = make_up(*sweeps, value=lambda *_: 0)
    trials.table["ATE"] = np.tile(once, 3)
    one, other = ({"s": made} for made in (make_up(*sweeps[:2], value=lambda *_: 0), trials))
    one["s"].table["ATE"] = np.tile(once, 2)
    few, many = (compare(made)[["order", "trials", "trials_across"]] for made in (one, other))
    pd.testing.assert_frame_equal(few, many)
    assert 50 < few["order"][0] < 100


def test_rates_of_a_scenario_share_their_trials() -> None:
    for name, table in plan(["trials=3"]).items():
        assert {sweep.name for sweep in table.sweeps} == {f"frame_rate/{name}"}
        assert [sweep.changes for sweep in table.sweeps] == [
            f"every={sweep.every}" for sweep in table.sweeps
        ]
    with pytest.raises(ConfigError, match="'every' cannot be set: the frame rates stand in"):
        plan(["every=3"])


def test_program_writes_table_and_sentences(
    scenario: Trials, written: Callable[..., list[str]], tmp_path: Path
) -> None:
    paths = written({"s": scenario})
    outputs = [tmp_path / name for name in ("rates.csv", "means.csv", "rates.md")]
    assert main(["frame_rate", *paths, "--output", *map(str, outputs)]) == 0
    pd.testing.assert_frame_equal(
        pd.read_csv(outputs[0]), compare({"s": read_trials(Path(paths[0]))})
    )
    assert undescribed(compare, pd.read_csv(outputs[0])) == []
    text = outputs[2].read_text()
    assert "| TAS | 33 to 33 | 100 / 50 | 100 / 50 | 100 / 75 | 100 / 75 |" in text
    assert "| ATE | 6 / 6 | inf / inf | 6 / 6 | inf / inf |" in text
