"""The command that runs an experiment, as Hydra's users know it."""

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from experiments.run import main
from experiments.tables import read_trials

SMALL = ["experiment=outliers", "trials=1", "n_jobs=1"]
SMALL += ["n_cameras=[25]", "n_outliers=[3]", "sigma_t=[0.02]"]

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def command(monkeypatch, tmp_path):
    """Run it with some arguments in an empty folder, and return the exit code."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["experiments.run", *arguments])
        try:
            main()
        except SystemExit as end:
            return int(end.code or 0)
        return 0

    return run


def test_an_experiment_is_a_table_and_its_record(command, capsys):
    assert command(*SMALL, "results_dir='größe'", "tas.max_threshold=2") == 0
    assert capsys.readouterr().out == "größe/trials/outliers.csv\n"
    files = {str(path) for path in Path().rglob("*") if path.is_file()}
    assert files == {"größe/trials/outliers.csv", "größe/trials/outliers.json"}
    trials = read_trials(Path("größe/trials/outliers.csv"))
    assert (trials.sweep.trials, trials.sweep.tas["max_threshold"], len(trials.table)) == (1, 2, 1)


def test_a_multirun_is_a_table_for_each_job(command):
    settings = [*SMALL[1:], "metrics=[TAS]", "tas.max_threshold=0.5,2"]
    assert command("--multirun", "experiment=outliers,collinear", *settings) == 0
    tables = {str(path): pd.read_csv(path) for path in Path("results/multirun").rglob("*.csv")}
    assert len(tables) == 4
    means = {
        (name, largest): table["TAS"].mean()
        for path, table in tables.items()
        for name in ("outliers", "collinear")
        for largest in ("0.5", "2")
        if f"experiment={name}," in path and f"tas.max_threshold={largest}" in path
    }
    assert means["outliers", "0.5"] < means["outliers", "2"]
    assert means["collinear", "0.5"] < means["collinear", "2"]


def test_the_composed_settings_have_the_options_of_the_metrics(command, capsys):
    assert command("--cfg", "job", "ras.max_threshold_deg=5") == 0
    printed = capsys.readouterr().out
    assert "ras:\n  max_threshold_deg: 5\n" in printed
    assert "pas:\n  weight: 0.5\n" in printed
    assert command("--help") == 0
    assert "trajectory_length" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("override", "code", "problem"),
    [
        ("trials=0", 2, "setting 'trials': should be greater than or equal to 1, not 0"),
        ("tas.registration=umeyama", 2, "setting 'tas.registration': should be 'pcr99', "),
        ("tas.order=0.2 tas.registration=refined", 2, "prescreen and order can be set for pcr99"),
        ("results_dir=file", 1, "cannot write file/trials: Not a directory"),
    ],
)
def test_wrong_settings_are_named_and_nothing_is_written(command, capsys, override, code, problem):
    Path("file").touch()
    assert command(*SMALL, *override.split()) == code
    said = capsys.readouterr().err
    assert problem in said
    assert "Traceback" not in said
    assert [str(path) for path in Path().rglob("*")] == ["file"]


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("tas.threshold=5", "Could not override 'tas.threshold'"),
        ("experiment=oultiers", "In 'config': Could not find 'experiment/oultiers'"),
    ],
)
def test_a_wrong_key_ends_in_one_sentence(override, problem):
    run = [sys.executable, "-m", "experiments.run", override]
    done = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=False)
    remedy = "run: python -m experiments.run --help\n"
    assert done.stderr == f"experiments.run: cannot read {override}: {problem}; {remedy}"
    assert done.returncode == 1
