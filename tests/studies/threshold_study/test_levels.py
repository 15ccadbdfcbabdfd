"""The levels of distance and angle: which trials they are of, and what they say of known ones."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from experiments.grid import Cell
from experiments.tables import Trials
from studies.threshold_study.figure import draw_levels
from studies.threshold_study.levels import compare, plan, summaries, to_markdown

from ..conftest import undescribed

MakeUp = Callable[..., Trials]


def test_all_scores_are_read_from_the_same_trials() -> None:
    tables = plan(["trials=6", "tas_max_threshold=[2]"])
    assert len(tables) == 12
    (sweep,) = tables["levels_car_lost"].sweeps
    assert (sweep.geometry, sweep.n_cameras, sweep.trials) == ("car", [100], 6)
    assert {"HalfDistance(score=0.1)", "HalfDistance", "HalfAngle(score=0.9)"} < set(sweep.metrics)
    for table in tables.values():
        (sweep,) = table.sweeps
        assert sweep.noise == "paired"
        for levels in (sweep.sigma_t, sweep.sigma_r_deg):
            assert np.divide(levels[1::2], levels[::2]) == pytest.approx(1.15, rel=0.01)


@pytest.fixture(scope="module")
def parts(make_up: MakeUp) -> dict[str, Trials]:
    """Half is right, with a scatter that is known and 0.9 of it for 30 cameras.

    All else is chance, but a tenth, which is wrong, and the TAS, which counts what is lost.
    """

    def value(metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
        if metric == "HalfDistance":
            return cell.sigma_t * (1 + 0.01 * (-1) ** trial) * (0.9 if cell.n_cameras == 30 else 1)
        if metric == "HalfDistance(score=0.1)":
            return -cell.sigma_t
        return -cell.n_outliers if metric == "TAS" else float(rng.random())

    return {
        name: make_up(replace(table.sweeps[0], trials=10), value=value, seed=number)
        for number, (name, table) in enumerate(plan().items())
    }


@pytest.fixture(scope="module")
def table(parts: dict[str, Trials]) -> pd.DataFrame:
    return compare(parts)


def test_order_difference_scatter_and_size_by_hand(table: pd.DataFrame) -> None:
    assert undescribed(compare, table) == []
    noise = table[table["level"] == "noise"].set_index("metric")
    half, tenth = noise.loc["HalfDistance"], noise.loc["HalfDistance(score=0.1)"]
    assert (half["right_order"] == 100).all()
    assert (half["difference"] == 0).all()
    assert half["p"].isna().all()
    assert half["scatter"].to_numpy() == pytest.approx(100 * 0.01 * np.sqrt(10 / 9))
    few = half["n_cameras"] == 30
    assert half.loc[few, "in_noise"].to_numpy() == pytest.approx(0.9)
    assert half.loc[~few, "in_noise"].to_numpy() == pytest.approx(1.0)
    assert (tenth["right_order"] == 0).all()
    assert (tenth["difference"] == -100).all()
    tas = table[table["metric"] == "TAS"]
    assert tas["score"].isna().all()
    assert (tas.loc[tas["level"] == "noise", "right_order"] == 50).all()
    assert (tas.loc[tas["level"] == "outliers", "right_order"] == 100).all()
    assert tas.loc[tas["level"] == "outliers", "n_outliers"].unique().tolist() == [
        *(10, 20, 40, 60, 80)
    ]


def test_the_scenes_are_summed_up_with_what_is_certain(table: pd.DataFrame) -> None:
    numbers, written = summaries(table)
    assert written.loc["HalfDistance"].tolist() == [*["100"] * 6, "50", "1.1", "0.90"]
    tenth = written.loc["HalfDistance(score=0.1)"]
    assert tenth.tolist()[:7] == [*["0"] * 6, "50"]  # nothing scatters, so no test is made
    assert 40 < numbers.loc["HalfAngle(score=0.2)", "noise, none lost"] < 60
    assert written.loc["TAS"].tolist()[-3:] == ["100", "–", "–"]
    chance = written.loc["HalfDistance(score=0.3)"].tolist()
    assert all(cell.endswith(" ▼") for cell in chance[:6])
    lines = to_markdown(table)
    assert "| HalfDistance | 100 | 100 | 100 | 100 | 100 | 100 | 50 | 1.1 | 0.90 |" in lines


def test_the_figure_has_a_line_for_each_number_of_lost_cameras(table: pd.DataFrame) -> None:
    scatter, distance, angle = draw_levels(table).axes
    assert [axes.get_title("left") for axes in (distance, angle)] == ["Distance", "Angle"]
    for axes in (distance, angle):
        *lines, chance = axes.lines
        assert len(lines) == 6
        assert len({line.get_marker() for line in lines}) == 6  # in grey, too
        assert chance.get_ydata()[0] == 50
    assert len(scatter.lines) == 2
