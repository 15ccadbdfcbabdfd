"""The command that runs an experiment, as Hydra's users know it."""

import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import joblib
import pandas as pd
import psutil
import pytest

from experiments.run import main
from experiments.sweep import run_sweeps
from experiments.tables import read_trials

SMALL = ["experiment=outliers", "trials=1", "n_jobs=1"]
SMALL += ["n_cameras=[25]", "n_outliers=[3]", "sigma_t=[0.02]"]

ROOT = Path(__file__).resolve().parents[3]


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


def files():
    return {str(path) for path in Path().rglob("*") if path.is_file()}


def test_an_experiment_is_a_table_and_its_record(command, capsys):
    assert command(*SMALL, "output='größe/a.csv'", "hydra.run.dir=run", "tas.max_threshold=2") == 0
    assert capsys.readouterr().out == "größe/a.csv\n"
    hydras = {f"run/.hydra/{name}.yaml" for name in ("config", "hydra", "overrides")}
    assert files() == {"größe/a.csv", "größe/a.json", *hydras}
    trials = read_trials(Path("größe/a.csv"))
    assert (trials.sweep.trials, trials.sweep.tas["max_threshold"], len(trials.table)) == (1, 2, 1)


def test_each_run_has_its_own_folder(command, capsys):
    """In the same second, too; nothing is replaced."""
    for day in range(3):
        assert command(*SMALL, f"seed={day}", "hydra.run.dir=outputs/day/time") == 0
    folders = ["outputs/day/time", "outputs/day/time-2", "outputs/day/time-3"]
    tables = [f"{folder}/outliers.csv" for folder in folders]
    assert capsys.readouterr().out.splitlines() == tables
    assert [read_trials(Path(table)).sweep.seed for table in tables] == [0, 1, 2]
    recorded = [Path(folder, ".hydra", "overrides.yaml").read_text() for folder in folders]
    assert ["seed=2" in text for text in recorded] == [False, False, True]


def test_by_hand_results_go_where_hydra_puts_them(command):
    assert command(*SMALL) == 0
    (table,) = Path("outputs").rglob("*.csv")
    assert re.fullmatch(r"outputs/\d{4}-\d\d-\d\d/\d\d-\d\d-\d\d/outliers.csv", str(table))


@pytest.mark.parametrize("existing", ["mine.csv", "mine.json"])
def test_no_file_is_replaced(command, capsys, existing):
    Path(existing).write_text("precious")
    assert command(*SMALL, "output=mine.csv") == 1
    problem = f"experiments.run: {existing} exists, and is not replaced; name another file\n"
    assert capsys.readouterr().err == problem
    assert Path(existing).read_text() == "precious"
    assert not {"mine.csv", "mine.json"} - {existing} & files()


def test_a_multirun_is_a_table_for_each_job(command, capsys):
    small = [*SMALL[1:], "metrics=[TAS]", "hydra.sweep.dir=multirun/day/time"]
    by_name = ["--multirun", "experiment=outliers,collinear", *small]
    by_option = ["--multirun", SMALL[0], "tas.max_threshold=0.5,2", *small]
    found = []
    for sweep, folder in ((by_name, "multirun/day/time"), (by_option, "multirun/day/time-2")):
        assert command(*sweep) == 0
        assert Path(folder, "multirun.yaml").exists()
        tables = [read_trials(path) for path in sorted(Path(folder).rglob("*.csv"))]
        assert [str(trials.path.parent) for trials in tables] == [f"{folder}/{i}" for i in range(2)]
        found += tables
    first, second, low, high = found
    assert (first.sweep.name, second.sweep.name) == ("outliers", "collinear")
    assert (low.sweep.tas["max_threshold"], high.sweep.tas["max_threshold"]) == (0.5, 2)
    assert low.table["TAS"].mean() < high.table["TAS"].mean()
    capsys.readouterr()
    assert command(*by_option, "output=mine.csv") == 2
    assert "setting 'output': names one file, and --multirun" in capsys.readouterr().err
    assert not Path("mine.csv").exists()


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
        ("tas.order=0.2 tas.registration=refined", 2, "order can be set only for pcr99"),
        ("output=file/a.csv", 1, "cannot write file: "),
        ("output=table", 2, "setting 'output': must end in .csv, not 'table'"),
    ],
)
def test_wrong_settings_are_named_and_nothing_is_written(command, capsys, override, code, problem):
    Path("file").touch()
    assert command(*SMALL, *override.split(), "hydra.output_subdir=null") == code
    err = capsys.readouterr().err
    assert problem in err
    assert "Traceback" not in err
    assert files() == {"file"}


def test_a_wrong_key_ends_in_one_sentence():
    run = [sys.executable, "-m", "experiments.run", "experiment=oultiers"]
    done = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=False)
    problem = "In 'config': Could not find 'experiment/oultiers'; did you mean outliers?"
    assert done.stderr == f"experiments.run: cannot read experiment=oultiers: {problem}\n"
    assert done.returncode == 1


def test_runs_in_the_same_second_do_not_share_a_folder(tmp_path):
    """Started together by hand, as by a shell's `&`."""
    run = [sys.executable, "-m", "experiments.run", *SMALL, "metrics=[RAS]"]

    def start(seed):
        command = [*run, f"seed={seed}"]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)

    with ThreadPoolExecutor(2) as pool:
        printed = [done.stdout.strip() for done in pool.map(start, [0, 1])]
    seeds = [read_trials(tmp_path / path).sweep.seed for path in printed]
    assert seeds == [0, 1]


# A shell ignores interruptions in the background, and so would the tests' processes.
HEEDING = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
runpy.run_module("experiments.run", run_name="__main__", alter_sys=True)
"""


def session(leader):
    """Return the processes of a session that are not ended."""
    processes = []
    for process in psutil.process_iter(["status"]):
        try:
            if os.getsid(process.pid) == leader and process.info["status"] != "zombie":
                processes.append(process)
        except ProcessLookupError:
            continue
    return processes


@pytest.mark.skipif(sys.platform != "linux", reason="sessions and signals of Linux")
@pytest.mark.parametrize(
    ("to_all", "killed", "code"),
    [(True, signal.SIGINT, 130), (False, signal.SIGINT, 130), (False, signal.SIGKILL, 1)],
    ids=["Ctrl-C", "the command is interrupted", "a worker is killed"],
)
def test_what_ends_a_sweep_ends_its_processes(tmp_path, to_all, killed, code):
    settings = ["experiment=outliers", "n_jobs=2", "output=a.csv"]
    run = [sys.executable, "-c", HEEDING, *settings]
    with subprocess.Popen(
        run,
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        workers = []
        while not workers:  # that compute
            assert process.poll() is None
            time.sleep(0.05)
            workers = [
                child
                for child in psutil.Process(process.pid).children()
                if "LokyProcess" in " ".join(child.cmdline()) and child.cpu_times().user > 1
            ]
        if killed == signal.SIGKILL:
            workers[0].kill()
        elif to_all:
            os.killpg(process.pid, killed)
        else:
            process.send_signal(killed)
        _, err = process.communicate(timeout=20)
    assert process.returncode == code
    problem = "interrupted"
    if code == 1:
        problem = "a process ended before its work was done; set n_jobs=1, or free memory"
    assert f"experiments.run: {problem}\n" in err
    deadline = time.monotonic() + 10
    while session(process.pid):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert not list(tmp_path.glob("a.*"))


@pytest.mark.parametrize("backend", ["threading", "multiprocessing", "loky"])
def test_another_backend_of_joblib_changes_no_bit(small, trials, backend):
    with joblib.parallel_config(backend=backend):
        pd.testing.assert_frame_equal(run_sweeps([small()], 2), trials, check_exact=True)
