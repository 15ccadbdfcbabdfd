"""The paper's registration and the refined one, compared on trials that are made up."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.tables import Record, Trials
from studies.axes import Axis, axes_of, plan
from studies.registration_study import REGISTRATIONS
from studies.registration_study.registrations import compare, spread, to_markdown

REFINED = "TAS(registration=refined{})"
DEVIATION = float(np.sqrt(10 / 9) * 0.05)  # of ten scores, five higher than the others by 0.1


@pytest.fixture(scope="module")
def axis() -> Axis:
    (axis,) = axes_of(REGISTRATIONS, {"outliers": ["TAS", REFINED.format("")]})
    return axis


@pytest.fixture(scope="module")
def table(axis: Axis) -> pd.DataFrame:
    """Refined scores are 0.1 higher than the paper's, and scatter by a tenth as much."""
    tables = plan(REGISTRATIONS)
    seeds = pd.DataFrame(
        {"n_cameras": 37, "n_outliers": [0, 11], "sigma_t": 0.03, "trial": 0}
        | {f"TAS(seed={k})": [0.4, 0.2 + 0.1 * (k % 2)] for k in range(10)}
        | {REFINED.format(f", seed={k}"): [0.5, 0.35 + 0.01 * (k % 2)] for k in range(10)}
    )
    cells = [(n, sigma) for n in (10, 20) for sigma in (0.01, 0.02, 0.03)]
    trials = pd.DataFrame(cells, columns=["n_cameras", "sigma_t"])
    trials = trials.assign(n_outliers=0, sigma_r_deg=3.0)
    trials["TAS"] = [0.3, 0.1, 0.2, 0.6, 0.4, 0.2]
    trials[REFINED.format("")] = [0.5, 0.4, 0.3, 0.5, 0.4, 0.3]
    made_up = {"line_37": seeds, "trajectory_length": trials}
    return compare(
        axis,
        {
            name: Trials(Path(f"{name}.csv"), part, Record(tables[name].sweeps, {}))
            for name, part in made_up.items()
        },
    )


@pytest.mark.parametrize(
    ("statistic", "paper", "refined"),
    [
        ("mean", [0.4, 0.25], [0.5, 0.355]),
        ("standard deviation", [0, DEVIATION], [0, DEVIATION / 10]),
        ("smallest", [0.4, 0.2], [0.5, 0.35]),
        ("largest", [0.4, 0.3], [0.5, 0.36]),
        ("order of noise, %", [50, 100], [100, 100]),
        ("order of outliers, %", [], []),
        ("dependence on cameras, %", [40], [0]),  # mean of 0.3, 0.3, 0 over 0.5
    ],
)
def test_statistics_of_inputs_and_experiments(
    table: pd.DataFrame, statistic: str, paper: list[float], refined: list[float]
) -> None:
    rows = table[table["statistic"] == statistic]
    assert rows["pcr99"].tolist() == pytest.approx(paper, abs=1e-6)
    assert rows["refined"].tolist() == pytest.approx(refined, abs=1e-6)


def test_sentences(axis: Axis, table: pd.DataFrame) -> None:
    times = pd.DataFrame({"n_cameras": 37, "axis": ["tas_registration"] * 2 + ["other"]})
    times = times.assign(value=["pcr99", "refined", "refined"], milliseconds=[2.0, 5.0, 9.0])
    text = to_markdown(axis, table, times)
    assert "on **1 of 2 inputs** by more than 0.003 (standard deviation)" in text
    assert "registration it does on **1**" in text
    assert "0.02635 with pcr99 and 0.00264 with refined, the largest 0.0527 and 0.0053" in text
    assert "higher on 2 of 2 inputs and lower on 0 (+0.102 in the median, from +0.1000" in text
    assert "**does not compare with published TAS values**" in text
    assert (
        "mean order of noise 75.0 % (pcr99) and 100.0 % (refined), smallest 50.0 % and 100.0 %."
        in text
    )
    assert "The mean score moves by 40.0 % (pcr99) and 0.0 % (refined) of its range" in text
    assert "- 37 cameras: pcr99 2.00 ms, refined 5.00 ms, 2.5 times as long.\n" in text
    assert "9.00" not in text

    calm = table.assign(refined=table["refined"].where(table["refined"] > 0.1, 0))
    assert "registration it does on **none**" in spread(axis, calm)
    of_experiments = table[table["part"] == "trajectory_length"]
    assert spread(axis, of_experiments) == ""
    assert "The score is higher and **does not" in to_markdown(axis, of_experiments, times)
