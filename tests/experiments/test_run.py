"""The program that runs sweeps: files, settings, errors."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from experiments.config import Sweep
from experiments.run import main
from experiments.tables import SWEEPS, read_trials


def test_the_table_on_disk_is_the_table_computed(
    tmp_path: Path,
    small_overrides: list[str],
    small: Callable[..., Sweep],
    trials: pd.DataFrame,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([*small_overrides, f"results_dir={tmp_path}"]) == 0
    path = tmp_path / "trials" / "outliers.csv"
    assert capsys.readouterr().out.strip() == str(path)
    read = read_trials(path)
    pd.testing.assert_frame_equal(read.table, trials, check_exact=True)
    assert read.sweep == small()
    assert main([*small_overrides, "--table", str(tmp_path / "a" / "1.csv")]) == 0
    assert (tmp_path / "a" / "1.csv").read_bytes() == path.read_bytes()
    assert {file.name for file in tmp_path.rglob("*.*")} == {
        *("outliers.csv", "outliers.json", "1.csv", "1.json")
    }


def test_sweeps_are_run_as_they_are_told(tmp_path: Path, small: Callable[..., Sweep]) -> None:
    sweeps = [small("trials=1"), replace(small("trials=2", "seed=3"), changes="seed=3")]
    path = tmp_path / "0.csv"
    told = SWEEPS.dump_json(tuple(sweeps), exclude_defaults=True).decode()
    arguments = ["--sweeps", told, "--table", str(path)]
    assert main([*arguments, "n_jobs=1", f"results_dir={tmp_path / 'other'}"]) == 0
    read = read_trials(path)
    assert list(read.record.sweeps) == sweeps
    assert list(read.table["settings"]) == [""] * 4 + ["seed=3"] * 8
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["trials=0"], "setting 'trials': should be greater than or equal to 1, not 0"),
        (["--table", "t.csv", "--sweeps", "[]"], "--sweeps: needs 1 or more entries"),
        (["--table", "t.csv", "--sweeps", "[{}]"], "--sweeps: 0.name is missing"),
        (["--table", "t.csv", "--sweeps", "["], "--sweeps: Invalid JSON"),
    ],
)
def test_wrong_settings_end_in_one_line_and_no_file(
    tmp_path: Path,
    small_overrides: list[str],
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    problem: str,
) -> None:
    settings = [] if "--sweeps" in arguments else small_overrides[:5]
    assert main([*settings, f"results_dir={tmp_path}/results", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("experiments.run: ")
    assert problem in line
    assert not list(tmp_path.iterdir())


def test_settings_cannot_be_given_beside_sweeps_that_have_them(
    small: Callable[..., Sweep], capsys: pytest.CaptureFixture[str]
) -> None:
    told = json.dumps(SWEEPS.dump_python((small(),), mode="json"))
    assert main(["--sweeps", told, "--table", "t.csv", "trials=3"]) == 2
    assert "trials=3 cannot be set beside --sweeps" in capsys.readouterr().err
    assert main(["--sweeps", told]) == 2
    assert "--sweeps needs --table" in capsys.readouterr().err


def test_a_place_that_cannot_be_written_ends_in_one_line(
    tmp_path: Path, small_overrides: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main([*small_overrides, f"results_dir={tmp_path}/file"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"experiments.run: cannot write {tmp_path}/file/trials: Not a directory"


def test_the_help_names_the_experiments(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    assert "trajectory_length" in capsys.readouterr().out
