"""The readings of the -59 %: what is run, and changes of ranges that are known."""

import pytest

from experiments.grid import Cell, evaluations
from experiments.sweep import draw_scene, run_sweeps, trial_seeds
from studies.readings import answer, plan

from .conftest import undescribed


def test_the_plan_has_the_cells_of_the_captions_and_an_own_direction_in_each_study():
    plans = plan(["trials=2"], studies=2)
    first, second = plans["line, literal frames, last cameras, one direction"]
    assert (first.replicate, second.replicate) == (0, 1)
    assert len(evaluations(first)) == 2 * 10 + 2 * 7 - 4
    cell = Cell(n_cameras=10, n_outliers=3, sigma_t=0.0, sigma_r_deg=1.0)
    directions = []
    for sweep in (first, first, second):
        trial = len(directions)
        scene = draw_scene(sweep, cell, trial_seeds(sweep, cell, trial)[0])
        directions.append(scene.gt_positions[1] - scene.gt_positions[0])
    assert directions[0] == pytest.approx(directions[1])
    assert abs(directions[0] @ directions[2]) < 0.999


def test_the_last_cameras_are_the_outliers():
    (sweep,) = plan(studies=1)["cube, last cameras, 100 hypotheses"]
    cell = Cell(n_cameras=20, n_outliers=5, sigma_t=0.0, sigma_r_deg=0.0)
    scene = draw_scene(sweep, cell, trial_seeds(sweep, cell, 0)[0])
    turns = scene.est_rotations @ scene.gt_rotations.transpose(0, 2, 1)
    assert turns[:15] == pytest.approx(turns[:1].repeat(15, axis=0))
    for turn in turns[15:]:
        assert abs(turn - turns[0]).max() > 1e-3


def test_the_changes_of_the_range_are_those_of_each_study():
    (sweeps,) = [plan(["trials=2"], studies=2)["cube, as chosen here"]]
    trials = run_sweeps(sweeps)
    for number, shrunk in ((0, 0.5), (1, 0.25)):
        of_study = trials["replicate"] == number
        rank = trials[of_study].groupby("n_outliers").cumcount()
        width = 1 - shrunk * (trials.loc[of_study, "n_outliers"] == 50)
        trials.loc[of_study, "PAS"] = width * (rank % 2)
    table = answer({"cube": trials})
    assert undescribed(answer, table) == []
    row = table.iloc[0]
    assert (row["paper"], row["studies"]) == (-50, 2)
    assert row[["mean", "lowest", "highest"]].tolist() == pytest.approx([-37.5, -50, -25])
