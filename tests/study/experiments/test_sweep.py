"""Trials are reproducible to the last bit, whatever else runs, where and in which order."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from experiments.config import Selection, experiment_names, load_sweep
from experiments.grid import KEY_COLUMNS, Cell, cells
from experiments.sweep import draw_scene, run_sweeps, trial_seeds


def test_a_table_has_a_row_a_trial_and_a_column_a_metric(small, trials):
    assert list(trials.columns) == [*KEY_COLUMNS, "ATE", "DTE", "mAA", "TAS"]
    keys = [[*vars(cell).values(), trial] for cell in cells(small()) for trial in range(3)]
    columns = ["n_cameras", "n_outliers", "sigma_t", "sigma_r_deg", "trial"]
    assert trials[columns].to_numpy().tolist() == keys
    assert set(trials["experiment"]) == {"outliers"}
    assert trials["TAS"].between(0, 1).all()
    assert trials.notna().all(axis=None)


def test_processes_change_no_bit(small, run, trials):
    pd.testing.assert_frame_equal(run(small(), n_jobs=2), trials, check_exact=True)


def test_a_trial_does_not_depend_on_the_rest_of_the_grid(small, run, trials):
    part = run(small("sigma_t=[0.05]", "n_outliers=[3]", "trials=2"))
    same = trials[(trials.sigma_t == 0.05) & (trials.n_outliers == 3) & (trials.trial < 2)]
    pd.testing.assert_frame_equal(part, same.reset_index(drop=True), check_exact=True)


@pytest.mark.parametrize("override", ["seed=1", "replicate=1"])
def test_another_seed_or_replicate_gives_other_trials(small, run, trials, override):
    other = run(small(override, "metrics=[ATE,TAS]"))
    assert not (trials[["ATE", "TAS"]] == other[["ATE", "TAS"]]).any(axis=None)


def test_no_two_trials_share_their_randomness():
    sweeps = [load_sweep([f"experiment={name}"]) for name in experiment_names()]
    seeds = [
        tuple(seed.generate_state(4))
        for sweep in [*sweeps, *(replace(sweep, replicate=1) for sweep in sweeps)]
        for cell in cells(sweep)
        for trial in (0, 1)
        for seed in trial_seeds(sweep, cell, trial)
    ]
    assert len(set(seeds)) == len(seeds)


def test_the_seeds_of_published_results_stay():
    """Their spawn keys: checksums of the name and of the cell as it is written, then numbers."""
    sweep = replace(load_sweep(["experiment=outliers"]), seed=5, replicate=2)
    seeds = trial_seeds(sweep, Cell(100, 1, 0.05, 3.0), 7)
    assert [seed.entropy for seed in seeds] == [5, 5]
    key = (3271544281, 1103074173, 2, 7)
    assert [seed.spawn_key for seed in seeds] == [(*key, 0), (*key, 1)]


@pytest.mark.parametrize(("volume_per_camera", "side"), [("0.1", 2.0), ("10", 2000 ** (1 / 3))])
def test_volume_grows_with_the_number_of_cameras(volume_per_camera, side):
    sweep = load_sweep(["experiment=trajectory_length", f"volume_per_camera={volume_per_camera}"])
    cell = Cell(80 if volume_per_camera == "0.1" else 200, 0, 0.01, 3.0)
    positions = draw_scene(sweep, cell, np.random.SeedSequence(0)).gt_positions
    assert np.abs(positions).max() == pytest.approx(side / 2, rel=0.05)
    assert np.abs(positions).max() <= side / 2


def test_sweeps_are_joined_in_one_table(small, trials):
    """Values that are not asked for are empty; the others are those of the whole sweep."""
    only = [Selection(["TAS"], {"n_outliers": [3]}), Selection(["ATE"], {"sigma_t": [0.02]})]
    part = replace(small(), selections=only)
    other = replace(small("trials=1", "metrics=[RAS]", "seed=1"), changes="seed=1")
    table = run_sweeps([part, other])
    assert list(table.columns) == ["experiment", "settings", *KEY_COLUMNS[1:], "TAS", "ATE", "RAS"]
    assert list(table["settings"]) == [""] * 9 + ["seed=1"] * 4
    keys = ["n_outliers", "sigma_t", "trial"]
    whole, ours = trials.set_index(keys), table[:9].set_index(keys)
    for metric in ("TAS", "ATE"):
        values = ours[metric].dropna()
        assert len(values) == 6
        assert (values == whole[metric].loc[values.index]).all()
    assert table["RAS"].notna().tolist() == [False] * 9 + [True] * 4
