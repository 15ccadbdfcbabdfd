from itertools import product

import pandas as pd
import pytest

from studies.axes import is_seeded, plan
from studies.registration_study import REGISTRATIONS
from studies.registration_study import figure as registration_study


@pytest.fixture(scope="module")
def table():
    """A table of the study, made up."""
    rows = []
    for name, part in plan(REGISTRATIONS).items():
        sweep = part.sweeps[0]
        for n, k in product(sweep.n_cameras, sweep.n_outliers):
            row = {"part": name, "geometry": sweep.geometry, "n_cameras": n, "n_outliers": k}
            if not is_seeded(sweep.metrics):
                rows.append(
                    row | {"statistic": "order of noise, %", "pcr99": 80.0, "refined": 90.0}
                )
                continue
            for sigma, (statistic, score) in product(
                sweep.sigma_t, (("mean", 0.5), ("smallest", 0.4), ("largest", 0.7))
            ):
                row |= {"sigma_t": sigma, "trial": 0, "pcr99": score, "refined": 0.8}
                rows.append(row | {"statistic": statistic})
    return pd.DataFrame(rows)


def shown(figure):
    return {axes.get_title(loc="left"): axes for axes in figure.axes if axes.axison}


def test_there_is_a_panel_for_each_set_of_inputs(table):
    panels = shown(registration_study.draw(table))
    assert list(panels)[:9] == [
        f"{where}, {n} cameras"
        for where in ("In a cube", "On a line", "In clusters")
        for n in (37, 100, 500)
    ]
    lines = panels["In a cube, 37 cameras"].lines
    bars = [list(line.get_ydata()) for line in lines if len(line.get_ydata()) == 2]
    assert bars[:2] == [[0.4, 0.7], [0.8, 0.8]]


def test_below_are_the_orders_of_each_experiment(table):
    figure = registration_study.draw(table)
    orders = [axes for axes in figure.axes if axes.axison][9:]
    assert [(axes.get_title(loc="left"), axes.get_xlabel()) for axes in orders] == [
        ("Cube: right order of noise, %", "outliers"),
        ("Line: right order of noise, %", "outliers"),
        ("Cube: right order of noise, %", "cameras"),
    ]
    for axes in orders:
        assert [set(line.get_ydata()) for line in axes.lines] == [{80}, {90}]
        assert axes.get_ylim() == pytest.approx((0.98 * 80, 100))


def test_several_inputs_of_a_kind_stand_side_by_side(table):
    more = table[table["trial"].notna()].assign(trial=1)
    figure = registration_study.draw(pd.concat([table, more], ignore_index=True))
    ticks = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert ticks == ["0", "0", "11", "11", "18", "18", "33", "33"] * 2


def test_one_experiment_is_enough(table):
    figure = registration_study.draw(table[table["part"].isin(["line_37", "collinear"])])
    figure.draw_without_rendering()
    assert list(shown(figure)) == ["On a line, 37 cameras", "Line: right order of noise, %"]
