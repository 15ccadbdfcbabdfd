"""The processes of a sweep end with the command, whatever ends it."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SMALL = (
    "experiment=outliers trials=1 n_cameras=[25] n_outliers=[0] sigma_t=[0.01,0.02,0.03] n_jobs=2"
)
# Before an event of Python's audit of which an argument contains a word, for the nth time.
PROGRAM = """
import os, runpy, signal, sys
event, word, number, act, *sys.argv[1:] = sys.argv[1:]
left, parent = int(number), os.getpid()

def audit(name, arguments):
    global left
    if name == event and word in str(arguments[:1]):
        left -= 1
        if left == 0:
            if act == "interrupt":
                os.kill(parent, signal.SIGINT)
            elif act == "interrupt all":
                os.killpg(parent, signal.SIGINT)
            else:
                raise BlockingIOError(11, act)

sys.addaudithook(audit)
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in the background
runpy.run_module("experiments.run", run_name="__main__", alter_sys=True)
"""


def run(*moment, results):
    """Run an experiment until something happens, and until no process holds its output."""
    command = [sys.executable, "-c", PROGRAM, *moment, *SMALL.split(), f"results_dir={results}"]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=100, start_new_session=True
    )


@pytest.mark.parametrize(
    "moment",
    [
        ("import", "pandas", "1", "interrupt"),
        ("os.fork", "", "1", "interrupt"),
        ("os.fork", "", "2", "interrupt all"),
        ("open", "/dev/null", "1", "interrupt"),  # in a worker, in place of its input
        ("open", "/dev/null", "1", "interrupt all"),
        ("os.rename", "", "1", "interrupt"),
    ],
    ids=" ".join,
)
def test_ctrl_c_ends_the_command_and_its_workers(tmp_path, moment):
    done = run(*moment, results=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")
    assert not list(tmp_path.rglob("*.csv"))


@pytest.mark.parametrize("number", ["1", "2"])
def test_a_process_that_cannot_start_is_one_line(tmp_path, number):
    done = run("os.fork", "", number, "No more", results=tmp_path)
    problem = "experiments.run: no further process can be started (No more); set fewer jobs\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", problem)
