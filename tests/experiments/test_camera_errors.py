"""The errors are those behind the tables of trials, whoever computes them."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from alignscores import AlignmentScore
from alignscores.histogram import equal_steps
from experiments.camera_errors import (
    FIRST,
    CameraErrors,
    main,
    measure,
    read_camera_errors,
    write_camera_errors,
)
from experiments.command import ConfigError
from experiments.config import Execution, Sweep, load_sweep
from experiments.metrics import order_statistic
from experiments.tables import SWEEPS, TableError

HERE = Execution(n_jobs=1, backend="sequential", dask_address=None, results_dir="-")
SCORES = "metrics=[TAS,RAS,PAS]"


def split(values: np.ndarray, errors: CameraErrors) -> list[np.ndarray]:
    """Return what belongs to each trial."""
    sizes = np.repeat(errors.counts, errors.sweep.trials)
    return np.split(values, np.cumsum(sizes)[:-1])


def test_they_give_the_scores_of_the_first_trials_to_the_last_bit(
    small: Callable[..., Sweep], run: Callable[..., pd.DataFrame]
) -> None:
    sweep = small(SCORES, f"trials={FIRST + 2}")
    table = run(sweep)
    (errors,) = measure([sweep], HERE)
    assert errors.sweep == replace(sweep, trials=FIRST)
    assert errors.scores == ["TAS", "RAS", "PAS"]
    parts = (errors.positions, errors.rotations, errors.closest)
    trials = list(zip(*(split(part, errors) for part in parts), strict=True))
    first = table[table["trial"] < FIRST]
    assert len(trials) == len(first) == 4 * FIRST
    for row, (positions, rotations, closest) in zip(first.itertuples(), trials, strict=True):
        assert (np.diff(closest) >= 0).all()
        d = order_statistic(closest, 0.75)
        assert AlignmentScore(positions, d * equal_steps(1.0, 100, "_")).score == row.TAS
        assert AlignmentScore(rotations, equal_steps(10.0, 100, "_")).score == row.RAS


def test_outliers_come_first(small: Callable[..., Sweep]) -> None:
    (errors,) = measure([small(SCORES, "outlier_side=1e6", "sigma_t=[0.01]")], HERE)
    assert errors.outliers.tolist() == [0] * 3 + [3] * 3
    for positions, count in zip(split(errors.positions, errors), errors.outliers, strict=True):
        assert (positions[:count] > 1000).all()
        assert (positions[count:] < 10).all()


def test_with_every_other_camera_they_are_of_those_that_are_kept(
    small: Callable[..., Sweep],
) -> None:
    (errors,) = measure([small(SCORES, "every=2", "outliers=missing", "n_outliers=[8]")], HERE)
    assert errors.counts == [13, 13]
    failures = [np.isinf(trial).sum() for trial in split(errors.positions, errors)]
    assert failures == errors.outliers.tolist()
    assert len(set(failures)) > 1  # as it happens
    for trial, count in zip(split(errors.rotations, errors), failures, strict=True):
        assert np.isinf(trial[:count]).all()


@pytest.mark.parametrize(
    ("metrics", "scores"),
    [
        ("ATE,TAS", ["TAS"]),
        ("RAS,mAA", ["RAS"]),
        ("'TAS(max_threshold=2)'", ["TAS"]),
        ("PAS", None),
    ],
)
def test_they_are_of_the_scores_of_the_experiment(
    small: Callable[..., Sweep], metrics: str, scores: list[str] | None
) -> None:
    (errors,) = measure([small(f"metrics=[{metrics}]")], HERE)
    assert errors.scores == (scores or ["TAS", "RAS", "PAS"])
    assert (errors.positions.size > 0) == (errors.closest.size > 0) == ("TAS" in errors.scores)


def test_without_a_score_there_is_nothing_to_measure(small: Callable[..., Sweep]) -> None:
    with pytest.raises(ConfigError, match="'metrics' has none of TAS, RAS and PAS"):
        measure([small(SCORES), small("metrics=[ATE]")], HERE)


def test_any_number_of_processes_writes_the_same_bytes_and_they_are_read_back(
    small: Callable[..., Sweep], tmp_path: Path
) -> None:
    sweeps = [small(SCORES), replace(small("metrics=[RAS]"), name="collinear")]
    for name, changes in (("one", {}), ("two", {"n_jobs": 2, "backend": "loky"})):
        write_camera_errors(tmp_path / f"{name}.npz", measure(sweeps, replace(HERE, **changes)))
    first, second = ((tmp_path / f"{name}.npz").read_bytes() for name in ("one", "two"))
    assert first == second
    for wanted, read in zip(
        measure(sweeps, HERE), read_camera_errors(tmp_path / "one.npz"), strict=True
    ):
        assert read.sweep == wanted.sweep
        for name in ("positions", "rotations", "closest", "outliers"):
            np.testing.assert_array_equal(getattr(read, name), getattr(wanted, name))


@pytest.fixture
def file(small: Callable[..., Sweep], tmp_path: Path) -> Path:
    path = tmp_path / "errors.npz"
    write_camera_errors(path, measure([small(SCORES)], HERE))
    return path


def half(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:1000])


def other_trials(path: Path) -> None:
    record = path.with_suffix(".json")
    content = json.loads(record.read_text())
    content["sweeps"][0]["trials"] = 2
    record.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("damage", "problem"),
    [
        (Path.unlink, "errors.npz does not exist; run: snakemake"),
        (half, "errors.npz was changed, or errors.json is not its record"),
        (other_trials, "errors.npz was changed, or errors.json is not its record"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(
    file: Path, damage: Callable[[Path], None], problem: str
) -> None:
    damage(file)
    with pytest.raises(TableError, match=problem):
        read_camera_errors(file)


def test_a_missing_record_is_said(file: Path) -> None:
    file.with_suffix(".json").unlink()
    with pytest.raises(TableError, match=r"errors\.json does not exist"):
        read_camera_errors(file)


RUN = ["backend=sequential", "n_jobs=1"]


def test_the_program_runs_an_experiment_or_the_sweeps_that_are_given(
    small: Callable[..., Sweep], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "new" / "errors.npz"
    overrides = ["experiment=rotations", "n_cameras=[20]", "n_outliers=[2]", "sigma_r_deg=[3]"]
    assert main([*overrides, *RUN, "trials=2", "--output", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    (read,) = read_camera_errors(path)
    assert (read.sweep.name, read.scores, read.rotations.size) == ("rotations", ["RAS"], 40)

    sweeps = SWEEPS.dump_json((small(SCORES), load_sweep([*overrides, "trials=1"]))).decode()
    assert main([*RUN, "--sweeps", sweeps, "--output", str(path)]) == 0
    assert [found.sweep.name for found in read_camera_errors(path)] == ["outliers", "rotations"]


@pytest.mark.parametrize(
    ("arguments", "code", "problem"),
    [
        (["trials=0"], 2, "setting 'trials'"),
        (["trials=1", "metrics=[ATE]"], 2, "setting 'metrics' has none of TAS, RAS and PAS"),
        (["--sweeps", "[]"], 2, "needs 1 or more entries"),
        (["trials=1", "--sweeps", "[]"], 2, "trials=1 cannot be set beside --sweeps"),
    ],
)
def test_wrong_arguments_end_in_one_line(
    arguments: list[str],
    code: int,
    problem: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "errors.npz"
    assert main([*arguments, "--output", str(path)]) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("experiments.camera_errors: ")
    assert problem in line
    assert not path.exists()


def test_what_cannot_be_written_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    path = "/dev/null/errors.npz"
    small = ["experiment=rotations", "n_cameras=[9]", "n_outliers=[0]", "trials=1", *RUN]
    assert main([*small, "--output", path]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("experiments.camera_errors: cannot write /dev/null: ")
