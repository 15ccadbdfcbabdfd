"""The study of protocols: orders by hand, on trials whose order is known."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.command import ConfigError
from experiments.config import load_sweep
from experiments.metrics import Column
from experiments.tables import Trials
from studies.__main__ import main
from studies.order import Order, compare, needed, order, within
from studies.protocols import plan
from studies.protocols.orders import at_outliers, compare_sides
from studies.protocols.words import duels, sentences

from ..conftest import undescribed

MakeUp = Callable[..., Trials]
SETTINGS = ["noise=paired", "sigma_t=[1,2,3]", "sigma_r_deg=[1,2,3]", "trials=20"]
METRICS = ("TAS", "ate:rmse", "rpe@1f")


def value(metric, cell, trial, rng):
    """The score sees all, the ATE only noise, and a third metric has no value."""
    if metric == "rpe@1f":
        return np.nan
    noise = cell.sigma_t + rng.normal()
    return -noise - cell.n_outliers if metric == "TAS" else noise


@pytest.fixture
def questions(make_up: MakeUp) -> dict[str, Trials]:
    """Outliers, and two frame rates of the same cameras; the score is far better at the second."""
    metrics = f"metrics=[{','.join(METRICS)}]"
    sweep = load_sweep([*SETTINGS, "n_outliers=[0,9]", metrics])
    outliers = make_up(sweep, value=value)
    rates = replace(sweep, n_outliers=[0], name="r")
    sweeps = [replace(rates, every=k, changes=f"every={k}") for k in (1, 2)]
    frame_rate = make_up(*sweeps, value=lambda metric, cell, *_: cell.sigma_t)
    table = frame_rate.table
    table["TAS"] = -table["sigma_t"] - 10 * (table["settings"] == "every=2")
    table["rpe@1f"] = np.nan
    return {"outliers": outliers, "frame_rate": frame_rate}


def test_orders_by_hand(questions: dict[str, Trials]) -> None:
    table = compare_sides(questions).set_index(["question", "asked", "metric"])
    tasks = [("outliers", "noise"), ("outliers", "outliers"), ("frame_rate", "noise")]
    assert [*dict.fromkeys(index[:2] for index in table.index)] == tasks
    table = table.sort_index()
    # Across rates the score is right where the better one has the good rate, and never else.
    across = table.loc["frame_rate", "noise"]
    assert across["order"].to_dict() == {"TAS": 50, "ate:rmse": 100, "rpe@1f": 50}
    assert across.loc["TAS", ["best", "behind"]].tolist() == ["ate:rmse", 50]
    assert across["across"].unique() == ["every"]
    # What never has a value is a coin, and behind whatever sees something.
    blind = table.xs("rpe@1f", level="metric")
    assert (blind["order"] == 50).all()
    assert (blind["trials"] == np.inf).all()
    assert (blind["p_chance"] > 0.05).all()
    assert blind["best"].map(lambda best: best in METRICS[:2]).all()
    assert (blind["p_behind"] < 1e-9).all()
    seeing = table.loc[("outliers", "outliers", "TAS")]
    assert seeing[["order", "beats", "beaten", "rivals"]].tolist() == [100, 2, 0, 2]
    assert table.loc[("outliers", "outliers", "ate:rmse"), "beaten"] == 1
    assert table.loc[("outliers", "outliers", "ate:rmse"), "p_chance"] > 0.05


def test_orders_within_are_those_of_the_ruler(questions: dict[str, Trials]) -> None:
    """Means over the numbers of outliers, whose trials are independent."""
    found = compare_sides(questions).query("question == 'outliers' and asked == 'noise'")
    found = found.set_index("metric")
    groups = [group for _, group in questions["outliers"].table.groupby("n_outliers")]
    compared = [compare(within(group, "sigma_t"), ["TAS", "ate:rmse"]) for group in groups]

    def mean(orders: list[Order]) -> tuple[float, float]:
        return 50 * sum(o.probability for o in orders), 50 * np.hypot(*(o.error for o in orders))

    for name in ("TAS", "ate:rmse"):
        probability, error = mean([alone[name] for alone, _ in compared])
        assert found.at[name, "order"] == pytest.approx(probability)
        assert found.at[name, "order_error"] == pytest.approx(error)
    ahead, error = mean([pairs["TAS", "ate:rmse"] for _, pairs in compared])
    assert found.at["TAS", "ahead"] == pytest.approx(ahead)
    assert found.at["TAS", "ahead_error"] == pytest.approx(error)


def test_numbers_of_outliers_apart(questions: dict[str, Trials]) -> None:
    """The estimates needed are the mean of what each number of outliers needs."""
    found = at_outliers(questions)
    assert undescribed(at_outliers, found) == []
    assert set(found["question"]) == {"outliers"}
    assert set(found["asked"]) == {"noise"}
    over_all = compare_sides(questions).set_index(["question", "asked", "metric"])
    for metric, rows in found.groupby("metric"):
        for row in rows.to_dict("records"):
            trials = questions["outliers"].table
            alone, _ = compare(
                within(trials[trials["n_outliers"] == row["outliers"]], "sigma_t"), [metric]
            )
            assert row["order"] == pytest.approx(100 * alone[metric].probability)
            assert row["trials"] == needed(alone[metric])
        mean = rows["trials"].mean()
        assert over_all.at[("outliers", "noise", metric), "trials"] == mean


def test_frame_rates_of_one_draw_are_no_independent_trials(questions: dict[str, Trials]) -> None:
    """The same cameras twice tell no more than once."""
    trials = questions["frame_rate"]
    noise = pd.Series(np.random.default_rng(0).normal(size=60), name="noise")
    noise = noise + trials.table["sigma_t"][:60].to_numpy()
    trials.table["ate:rmse"] = np.tile(noise, 2)
    table = compare_sides({"frame_rate": trials})
    (row,) = table.query("metric == 'ate:rmse'").to_dict("records")
    once = order([noise[20 * k : 20 * (k + 1)] for k in range(3)])
    assert row["order"] == pytest.approx(100 * once.probability)
    assert row["order_error"] == pytest.approx(100 * once.error)


def test_wins_and_losses_are_told(
    questions: dict[str, Trials], written: Callable[..., list[str]], tmp_path: Path
) -> None:
    table = compare_sides(questions)
    assert undescribed(compare_sides, table) == []
    assert [duel["verdict"] for duel in duels(table)] == ["even", "wins", "loses"]
    win, lose, _, seeing = sentences(table)
    assert win.startswith("The new scores win on 1 of 3: outliers: outliers (TAS +")
    assert "frame rate: noise (TAS −50.0 ± 0.0 against ate:rmse)" in lose
    assert seeing == "Better than chance on all 3: none."
    outputs = [tmp_path / name for name in ("protocols.csv", "protocols.md", "outliers.csv")]
    assert main(["protocols", *written(questions), "--output", *map(str, outputs)]) == 0
    pd.testing.assert_frame_equal(
        pd.read_csv(outputs[0], dtype={"across": str}).fillna({"across": ""}), table
    )
    text = outputs[1].read_text()
    assert "| TAS | " in text
    assert "| rpe@1f | × | × | × |" in text
    assert "| TAS | 3 | 1 | 6 | 50 | frame rate: noise |" in text
    assert "| outliers: noise; outliers | 0 | 9 |" in text
    assert len(pd.read_csv(outputs[2])) == 2 * len(METRICS)


def test_what_is_of_motion_is_asked_where_there_is_some() -> None:
    tables = plan(["trials=3"])
    assert len(tables) == 8
    for name, table in tables.items():
        for sweep in table.sweeps:
            assert sweep.name == f"today/{name}"
            asked = {Column.parse(metric).metric.family.ordered for metric in sweep.metrics}
            assert asked == ({False} if sweep.geometry == "cube" else {False, True})
    with pytest.raises(ConfigError, match="'every' cannot be set: the frame rates stand in"):
        plan(["every=3"])
