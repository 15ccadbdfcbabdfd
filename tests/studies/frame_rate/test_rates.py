"""What the frame rate does to metrics, on trials whose dependence is known."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from experiments.command import ConfigError
from experiments.config import load_sweep
from experiments.tables import Trials, read_trials
from studies.__main__ import main
from studies.frame_rate.rates import compare, plan

from ..conftest import undescribed

MakeUp = Callable[..., Trials]


@pytest.fixture
def scenario(make_up: MakeUp) -> Trials:
    """An error that the frame rate does not touch, and a score that it raises by more than noise.

    The error rises by 1 a noise level. So does the score's loss, by 0.1; at half the frame rate it
    is 0.25 higher.
    """
    sweep = load_sweep(
        ["sigma_t=[1,2,3]", "n_outliers=[0]", "sigma_r_deg=[1]", "trials=4", "metrics=[ATE,TAS]"]
    )
    sweeps = [replace(sweep, name="s", every=k, changes=f"every={k}") for k in (1, 2)]
    trials = make_up(*sweeps, value=lambda metric, cell, *_: cell.sigma_t)
    table = trials.table
    table["TAS"] = 0.5 - 0.1 * table["sigma_t"] + 0.25 * (table["settings"] == "every=2")
    return trials


def test_dependence_and_order_by_hand(scenario: Trials) -> None:
    table = compare({"s": scenario})
    assert len(table) == 2 * 2 * 3
    summary = table.groupby("metric")[["dependence", "order", "order_across"]].first()
    # The score moves by 0.25 at each level, of a range of 0.45. Of two neighbours the better one
    # loses where it has the full rate and the worse one half: of four pairs, two.
    assert summary.loc["ATE"].tolist() == [0, 100, 100]
    assert summary.loc["TAS"].tolist() == pytest.approx([100 * 0.25 / 0.45, 100, 50])
    means = table.set_index(["metric", "every", "sigma_t"])["mean"]
    assert means["TAS", 2, 3] == pytest.approx(0.45)
    assert means["ATE", 1, 2] == 2


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
    outputs = [tmp_path / "rates.csv", tmp_path / "rates.md"]
    assert main(["frame_rate", *paths, "--output", *map(str, outputs)]) == 0
    pd.testing.assert_frame_equal(
        pd.read_csv(outputs[0]), compare({"s": read_trials(Path(paths[0]))})
    )
    assert undescribed(compare, pd.read_csv(outputs[0])) == []
    assert "| TAS | 56 to 56 | 100 | 50 |" in outputs[1].read_text()
