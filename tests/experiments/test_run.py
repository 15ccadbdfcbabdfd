"""The command line of an experiment: files, provenance, errors, interruption."""

import json
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from experiments.config import load
from experiments.run import main
from experiments.sweep import sweep
from experiments.tables import TableError, read_trials

ROOT = Path(__file__).resolve().parents[2]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "experiments.run", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=100)


def test_the_table_on_disk_is_the_table_computed(
    tmp_path: Path, small_overrides: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    overrides = [*small_overrides, f"results_dir={tmp_path}"]
    assert main(overrides) == 0
    path = tmp_path / "trials" / "outliers.csv"
    assert capsys.readouterr().out.strip() == str(path)
    pd.testing.assert_frame_equal(
        read_trials(load(overrides)), sweep(load(overrides)), check_exact=True
    )


def test_a_table_made_under_other_settings_is_refused(
    tmp_path: Path, small_overrides: list[str]
) -> None:
    overrides = [*small_overrides, f"results_dir={tmp_path}"]
    main(overrides)
    path = tmp_path / "trials" / "outliers.csv"
    for setting, made in (
        ("seed=1", "seed=0"),
        ("trials=9", f"trials={load(overrides).trials}"),
        ("geometry=orbit", "geometry=cube"),
        ("sigma_t=[0.02]", r"sigma_t=\[0.02, 0.05\]"),
    ):
        with pytest.raises(TableError, match=f"{path} was made with {made}, not {setting[:5]}"):
            read_trials(load([*overrides, setting]))
    for harmless in ("n_jobs=2", "backend=threading", "metrics=[TAS]"):
        read_trials(load([*overrides, harmless]))
    for record in (
        "[]",
        "{}",
        "{",
        '{"config": 1, "packages": 1, "git": 1, "python": 1, "platform": 1}',
    ):
        path.with_suffix(".json").write_text(record)
        with pytest.raises(TableError, match=r"outliers\.json is no record of provenance"):
            read_trials(load(overrides))
    path.with_suffix(".json").unlink()
    with pytest.raises(TableError, match=r"outliers\.json does not exist"):
        read_trials(load(overrides))


def test_provenance_tells_settings_versions_commit_and_platform(
    tmp_path: Path, small_overrides: list[str]
) -> None:
    main([*small_overrides, f"results_dir={tmp_path}", "seed=7"])
    origin = json.loads((tmp_path / "trials" / "outliers.json").read_text())
    assert origin["config"]["seed"] == 7
    assert origin["config"]["sigma_t"] == [0.02, 0.05]
    assert {"alignscores", "numpy", "scipy", "evo"} <= set(origin["packages"])
    assert set(origin) == {"config", "packages", "git", "python", "platform"}


@pytest.mark.parametrize("override", ["trials=0", "trails=5", "experiment=foo", "n_outliers=[26]"])
def test_wrong_settings_end_with_one_line_and_no_file(
    tmp_path: Path, small_overrides: list[str], override: str
) -> None:
    done = run(*small_overrides, f"results_dir={tmp_path}/results", override)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "results").exists()


def test_a_place_that_cannot_be_written_ends_with_one_line_before_the_trials(
    tmp_path: Path,
) -> None:
    (tmp_path / "file").touch()
    done = run("experiment=outliers", f"results_dir={tmp_path}/file")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert f"{tmp_path}/file" in done.stderr


def test_help_names_the_experiments() -> None:
    done = run("--help")
    assert done.returncode == 0
    assert "trajectory_length" in done.stdout
