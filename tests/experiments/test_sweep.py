"""Trials are reproducible to the last bit, whatever else runs, where and in which order."""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from threadpoolctl import threadpool_limits

from alignscores import pas
from baselines import ate, maa, rotation_statistics
from experiments.config import METRICS, Config, experiment_names, load
from experiments.sweep import Cell, cells, draw_scene, run_cell, run_trials, sweep, trial_seeds
from experiments.tables import KEY_COLUMNS

Small = Callable[..., Config]


def test_table_has_a_row_a_trial_and_a_column_a_metric(small: Small) -> None:
    table = sweep(small())
    assert list(table.columns) == [*KEY_COLUMNS, "ATE", "DTE", "mAA", "TAS"]
    assert len(table) == 2 * 2 * 3
    assert table.groupby(["n_outliers", "sigma_t"])["trial"].apply(list).map(tuple).nunique() == 1
    assert table["TAS"].between(0, 1).all()
    assert not table.drop(columns=["experiment", "geometry"]).isna().any(axis=None)


@pytest.mark.parametrize(
    "how", [("n_jobs=2",), ("n_jobs=2", "backend=threading"), ("backend=sequential",)]
)
def test_backend_and_processes_change_no_bit(small: Small, how: tuple[str, ...]) -> None:
    pd.testing.assert_frame_equal(sweep(small(*how)), sweep(small()), check_exact=True)


def test_a_trial_does_not_depend_on_the_rest_of_the_grid(small: Small) -> None:
    whole = sweep(small())
    part = sweep(small("sigma_t=[0.05]", "n_outliers=[3]", "trials=2"))
    same = whole[(whole.sigma_t == 0.05) & (whole.n_outliers == 3) & (whole.trial < 2)]
    pd.testing.assert_frame_equal(part, same.reset_index(drop=True), check_exact=True)


@pytest.mark.parametrize("override", ["seed=1", "replicate=1"])
def test_another_seed_or_replicate_gives_other_trials(small: Small, override: str) -> None:
    assert not (sweep(small()).TAS == sweep(small(override)).TAS).any()


def test_no_two_trials_share_their_randomness() -> None:
    keys = set()
    n_trials = 0
    for name in experiment_names():
        for replicate in (0, 1):
            config = load([f"experiment={name}", f"replicate={replicate}"])
            for cell in cells(config):
                for trial in (0, 1):
                    seeds = trial_seeds(config, cell, trial)
                    keys |= {tuple(seed.generate_state(4)) for seed in seeds}
                    n_trials += 1
    assert len(keys) == 2 * n_trials


def test_a_row_holds_the_metrics_of_its_scene(small: Small) -> None:
    config = small("metrics=[ATE,mAA,TAS,RAS,PAS,RMS-2]")
    cell = Cell(25, 3, 0.05, 3.0)
    row = run_trials(config, cell, [1], config.metrics)[0]
    scene_seed, registration_seed = trial_seeds(config, cell, 1)
    scene = draw_scene(config, cell, scene_seed)
    scores = pas(scene.gt_poses, scene.est_poses, rng=registration_seed)
    assert row["PAS"] == scores.score
    assert row["TAS"] == scores.tas.score
    assert row["RAS"] == scores.ras.score
    assert row["ATE"] == ate(scene.gt_positions, scene.est_positions)
    assert row["mAA"] == maa(scene.gt_poses, scene.est_poses)
    assert row["RMS-2"] == rotation_statistics(scene.gt_rotations, scene.est_rotations)["RMS-2"]


def test_single_scores_equal_those_computed_with_the_others(small: Small) -> None:
    cell = Cell(25, 3, 0.05, 3.0)
    together = run_trials(small(), cell, [0], ["TAS", "RAS", "PAS"])[0]
    for metric in ("TAS", "RAS", "PAS"):
        assert run_trials(small(), cell, [0], [metric])[0][metric] == together[metric]


@pytest.mark.parametrize("batch", [1, 2])
def test_trials_side_by_side_do_not_matter(
    small: Small, monkeypatch: pytest.MonkeyPatch, batch: int
) -> None:
    """A cell's rows are those of its single trials, in their order, however many run together."""
    config = small("trials=5")
    cell = cells(config)[-1]
    expected = [run_trials(config, cell, [trial], config.metrics)[0] for trial in range(5)]
    with threadpool_limits(1, user_api="blas"):  # a cell's own limit would stay with this process
        assert run_cell(config, cell, config.metrics) == expected
        monkeypatch.setattr("experiments.sweep.BATCH", batch)
        assert run_cell(config, cell, config.metrics) == expected


@pytest.mark.parametrize(("volume_per_camera", "side"), [("0.1", 2.0), ("10", 2000 ** (1 / 3))])
def test_volume_grows_with_the_number_of_cameras(volume_per_camera: str, side: float) -> None:
    config = load(["experiment=trajectory_length", f"volume_per_camera={volume_per_camera}"])
    cell = Cell(80 if volume_per_camera == "0.1" else 200, 0, 0.01, 3.0)
    positions = draw_scene(config, cell, np.random.SeedSequence(0)).gt_positions
    assert np.abs(positions).max() == pytest.approx(side / 2, rel=0.05)
    assert np.abs(positions).max() <= side / 2


def test_every_known_metric_can_be_evaluated(small: Small) -> None:
    row = run_trials(small(), Cell(25, 3, 0.05, 3.0), [0], METRICS)[0]
    assert [name for name in row if name not in KEY_COLUMNS] == list(METRICS)
    assert np.isfinite([row[name] for name in METRICS]).all()
