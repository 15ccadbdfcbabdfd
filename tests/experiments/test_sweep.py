"""Trials are reproducible to the last bit, whatever else runs, where and in which order."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from experiments.config import Selection, Sweep, experiment_names, load, load_sweep
from experiments.grid import KEY_COLUMNS, Cell, cells
from experiments.metrics import evaluate
from experiments.scenes import ERRORS, OUTLIERS, PATHS, make_scene
from experiments.sweep import draw_scene, run_cell, run_sweeps, run_trials, trial_seeds

Small = Callable[..., Sweep]
Run = Callable[..., pd.DataFrame]


def test_table_has_a_row_a_trial_and_a_column_a_metric(small: Small, trials: pd.DataFrame) -> None:
    assert list(trials.columns) == [*KEY_COLUMNS, "ATE", "DTE", "mAA", "TAS"]
    keys = [list(vars(cell).values()) for cell in cells(small()) for _ in range(3)]
    assert trials[list(vars(cells(small())[0]))].to_numpy().tolist() == keys
    assert list(trials["trial"]) == [0, 1, 2] * 4
    assert set(trials["experiment"]) == {"outliers"}
    assert set(trials["geometry"]) == {"cube"}
    assert trials["TAS"].between(0, 1).all()
    assert trials.notna().all(axis=None)


@pytest.mark.parametrize("backend", ["loky", "threading"])
def test_backend_and_processes_change_no_bit(
    small: Small, run: Run, trials: pd.DataFrame, backend: str
) -> None:
    there = run(small(), n_jobs=2, backend=backend)
    pd.testing.assert_frame_equal(there, trials, check_exact=True)


def test_a_trial_does_not_depend_on_the_rest_of_the_grid(
    small: Small, run: Run, trials: pd.DataFrame
) -> None:
    part = run(small("sigma_t=[0.05]", "n_outliers=[3]", "trials=2"))
    same = trials[(trials.sigma_t == 0.05) & (trials.n_outliers == 3) & (trials.trial < 2)]
    pd.testing.assert_frame_equal(part, same.reset_index(drop=True), check_exact=True)


@pytest.mark.parametrize("override", ["seed=1", "replicate=1"])
def test_another_seed_or_replicate_gives_other_trials(
    small: Small, run: Run, trials: pd.DataFrame, override: str
) -> None:
    other = run(small(override, "metrics=[ATE,TAS]"))
    assert not (trials[["ATE", "TAS"]] == other[["ATE", "TAS"]]).any(axis=None)


def test_no_two_trials_share_their_randomness() -> None:
    keys = set()
    n_trials = 0
    for name in experiment_names():
        for replicate in (0, 1):
            sweep = replace(load_sweep([f"experiment={name}"]), replicate=replicate)
            for cell in cells(sweep):
                for trial in (0, 1):
                    seeds = trial_seeds(sweep, cell, trial)
                    keys |= {tuple(seed.generate_state(4)) for seed in seeds}
                    n_trials += 1
    assert len(keys) == 2 * n_trials


def test_the_seeds_of_published_results_stay() -> None:
    """Their spawn keys: checksums of the name and of the cell as it is written, then numbers."""
    sweep = replace(load_sweep(["experiment=outliers"]), seed=5, replicate=2)
    seeds = trial_seeds(sweep, Cell(100, 1, 0.05, 3.0), 7)
    assert [seed.entropy for seed in seeds] == [5, 5]
    key = (3271544281, 1103074173, 2, 7)
    assert [seed.spawn_key for seed in seeds] == [(*key, 0), (*key, 1)]


def test_a_row_holds_the_metrics_of_its_scene(small: Small) -> None:
    sweep = small("metrics=[ATE,mAA,TAS,RAS,PAS,RMS-2]")
    cell = Cell(25, 3, 0.05, 3.0)
    (row,) = run_trials(sweep, cell, [1], sweep.metrics)
    scene_seed, registration_seed = trial_seeds(sweep, cell, 1)
    values = evaluate(draw_scene(sweep, cell, scene_seed), sweep.metrics, registration_seed)
    assert {name: row[name] for name in values} == values
    for metric in ("TAS", "RAS", "PAS"):  # the same without the others
        assert run_trials(sweep, cell, [1], [metric])[0][metric] == row[metric]


@pytest.mark.parametrize("batch", [1, 2, 50])
def test_trials_side_by_side_do_not_matter(
    small: Small, monkeypatch: pytest.MonkeyPatch, batch: int
) -> None:
    """A cell's rows are those of its single trials, in their order, however many run together."""
    sweep = small("trials=5")
    cell = cells(sweep)[-1]
    expected = [run_trials(sweep, cell, [trial], sweep.metrics)[0] for trial in range(5)]
    monkeypatch.setattr("experiments.sweep.BATCH", batch)
    with threadpool_limits(1, user_api="blas"):  # a cell's own limit would stay with this process
        assert run_cell(sweep, cell, sweep.metrics) == expected


@pytest.mark.parametrize(("volume_per_camera", "side"), [("0.1", 2.0), ("10", 2000 ** (1 / 3))])
def test_volume_grows_with_the_number_of_cameras(volume_per_camera: str, side: float) -> None:
    sweep = load_sweep(["experiment=trajectory_length", f"volume_per_camera={volume_per_camera}"])
    cell = Cell(80 if volume_per_camera == "0.1" else 200, 0, 0.01, 3.0)
    positions = draw_scene(sweep, cell, np.random.SeedSequence(0)).gt_positions
    assert np.abs(positions).max() == pytest.approx(side / 2, rel=0.05)
    assert np.abs(positions).max() <= side / 2


def test_another_frame_rate_has_the_same_cameras() -> None:
    """Each third of them, beginning with the first."""
    cell = Cell(40, 0, 0.1, 1.0)
    sweeps = [load_sweep(["geometry=car", f"every={k}"]) for k in (1, 3)]
    whole, kept = (draw_scene(sweep, cell, np.random.SeedSequence(0)) for sweep in sweeps)
    for name in ("gt_rotations", "gt_positions", "est_rotations", "est_positions"):
        np.testing.assert_array_equal(getattr(kept, name), getattr(whole, name)[::3])


def test_every_generator_changes_the_trials(small: Small) -> None:
    choices = [("geometry", name) for name in PATHS if name != "cube"]
    choices += [("error", name) for name in ERRORS] + [("outliers", name) for name in OUTLIERS]
    changed = [replace(small(), **{key: name}) for key, name in choices]
    changed += [replace(small(), outlier_side=side) for side in (1.0, 100.0)]
    cell = Cell(25, 3, 0.05, 3.0)
    found = {run_trials(sweep, cell, [0], ["ATE"])[0]["ATE"] for sweep in changed}
    assert len(found) == len(changed) - 1  # the paper's error and its outliers are the same trial


@pytest.mark.parametrize("kind", ["geometry", "error", "outliers"])
def test_a_generator_is_one_entry_of_its_registry(
    small: Small, run: Run, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Its name is known to the settings, and its trials are swept."""
    registry, copied = {
        "geometry": (PATHS, "uneven"),
        "error": (ERRORS, "student_t"),
        "outliers": (OUTLIERS, "missing"),
    }[kind]
    monkeypatch.setitem(registry, "new", registry[copied])
    new, old = (run(small(f"{kind}={name}", "trials=1")) for name in ("new", copied))
    pd.testing.assert_frame_equal(new.assign(geometry=old["geometry"]), old, check_exact=True)
    settings = {"geometry": "cube", kind: "new", "n_cameras": 9, "n_outliers": 2}
    make_scene(np.random.default_rng(0), **settings, sigma_t=0.1, sigma_r_deg=1.0)


def test_sweeps_are_joined_in_one_table(small: Small, trials: pd.DataFrame) -> None:
    """Values that are not asked for are empty; the others are those of the whole sweep."""
    only = [Selection(["TAS"], {"n_outliers": [3]}), Selection(["ATE"], {"sigma_t": [0.02]})]
    part = replace(small(), selections=only)
    other = replace(small("trials=1", "metrics=[RAS]", "seed=1"), changes="seed=1")
    execution = load(["backend=sequential"])[1]
    table = run_sweeps([part, other], execution)
    assert list(table.columns) == ["experiment", "settings", *KEY_COLUMNS[1:], "TAS", "ATE", "RAS"]
    assert list(table["settings"]) == [""] * 9 + ["seed=1"] * 4
    keys = ["n_outliers", "sigma_t", "trial"]
    whole = trials.set_index(keys)
    ours = table[:9].set_index(keys)
    for metric, count in (("TAS", 6), ("ATE", 6)):
        given = ours[metric].dropna()
        assert len(given) == count
        assert (given == whole[metric].loc[given.index]).all()
    assert table["RAS"].notna().tolist() == [False] * 9 + [True] * 4


def test_the_thread_limit_of_blas_stays_with_a_worker_and_ends_with_a_sweep(
    small: Small, run: Run
) -> None:
    """Otherwise a cell would lift the limit of another that runs beside it."""

    def threads() -> set[int]:
        blas = ThreadpoolController().select(user_api="blas")
        return {library["num_threads"] for library in blas.info()}

    sweep = small("trials=1", "metrics=[ATE]")
    with threadpool_limits(2, user_api="blas"):
        run(sweep)
        assert threads() == {2}
        run_cell(sweep, cells(sweep)[0], ["ATE"])
        assert threads() == {1}
