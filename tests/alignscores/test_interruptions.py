"""Ctrl-C, a failing start of a process, and what is left: of compare, as a command and from Python.

Each script runs in a session of its own. Its pipes are closed when the last of its processes is
gone, so that `communicate` returns only then; the timeout is there for a hang alone.
"""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals and /proc of Linux")

PLACED = """\
import errno, os, sys, _posixsubprocess
number, starts, start = int(sys.argv.pop(1)), [], _posixsubprocess.fork_exec

def counted(*arguments):
    starts.append(arguments)
    if len(starts) == number:
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
    return start(*arguments)

_posixsubprocess.fork_exec = counted  # by which joblib starts its processes
"""
# First, as a shell ignores interruptions in the background, and so would the tests' processes.
HEEDING = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
COMMAND = "from alignscores.__main__ import command; sys.exit(command())"
PYTHON = """
from alignscores import compare
try:
    compare(*sys.argv[1:], format="tum", jobs=2)
except BaseException as error:
    print(type(error).__name__, error)
"""
LIMIT = "no further process can be started (Resource temporarily unavailable); set --jobs 1"


@pytest.fixture
def start(examples, tmp_path):
    """(code, arguments) -> a process of it, in a folder with a reference and two estimates."""
    shutil.copy(examples / "tum/reference.txt", tmp_path / "gt.ref")
    for name in "ab":
        shutil.copy(examples / "tum/estimate.txt", tmp_path / f"{name}.txt")

    def start(code, *arguments):
        return subprocess.Popen(
            [sys.executable, "-c", HEEDING + code, *map(str, arguments)],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    return start


PATTERNS = "gt.ref", "{system}.txt"
ARGUMENTS = "compare", "tum", *PATTERNS, "--jobs", "2"


@pytest.mark.parametrize("number", [1, 2])
def test_a_process_that_cannot_be_started_is_one_line(start, number):
    with start(PLACED + COMMAND, number, *ARGUMENTS) as process:
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (1, "")
    assert err.endswith(f"alignscores: error: {LIMIT}\n")
    with start(PLACED + PYTHON, number, *PATTERNS) as process:
        out, err = process.communicate(timeout=60)
    assert out == f"ChildProcessError {LIMIT}\n"


@pytest.mark.parametrize("to_all", [False, True])
@pytest.mark.parametrize(
    ("code", "arguments", "ended"),
    [(COMMAND, ARGUMENTS, (130, "")), (PYTHON, PATTERNS, (0, "KeyboardInterrupt \n"))],
    ids=["command", "Python"],
)
def test_an_interruption_ends_all_processes(start, tmp_path, code, arguments, ended, to_all):
    """In the middle of their work: each scores a run of 200,000 poses."""
    stamps = np.arange(0, 20_000, 0.1)
    poses = np.random.default_rng(0).normal(size=(200_000, 3))
    rows = np.column_stack([stamps, poses, np.tile([0.0, 0, 0, 1], (200_000, 1))])
    np.savetxt(tmp_path / "gt.ref", rows, "%.6g")
    for name in "ab":
        shutil.copy(tmp_path / "gt.ref", tmp_path / f"{name}.txt")
    with start("import sys\n" + code, *arguments) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        while len(children.read_text().split()) < 3:  # one of joblib's only watches
            assert process.poll() is None
        if to_all:
            os.killpg(process.pid, signal.SIGINT)
        else:
            process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60)
    code, printed = ended
    assert process.returncode == code
    assert out.startswith(printed)  # what workers that were starting print comes after it
