"""Ctrl-C and a killed worker: what `compare` says, and what is left.

The command runs in a new session. Its pipes are closed when the last of its processes is
gone, so that `communicate` returns only then; the timeout is there only for a hang.
"""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are found by ps")

# First, as a shell ignores interruptions in the background, and so would the tests' processes.
COMMAND = """\
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from alignscores.__main__ import command
sys.exit(command())
"""
ENDED = "a process ended before its work was done, as when memory is short; set fewer jobs"


@pytest.fixture
def started(examples, tmp_path):
    """A comparison of 400 runs by two processes, which has scored some, and its workers."""
    shutil.copy(examples / "tum/reference.txt", tmp_path / "gt.ref")
    for run in range(400):
        shutil.copy(examples / "tum/estimate.txt", tmp_path / f"a_{run}.txt")
    arguments = "compare", "tum", "gt.ref", "{system}_{run}.txt", "--jobs", "2", "--cache", "cache"
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *arguments],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    end = time.monotonic() + 90
    while time.monotonic() < end and not any(tmp_path.glob("cache/*.json")):
        assert process.poll() is None
        time.sleep(0.05)
    command = ["ps", "-o", "pid=,args=", "--ppid", str(process.pid)]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    workers = [int(line.split()[0]) for line in lines if "popen_loky" in line]
    assert len(workers) == 2
    yield process, workers
    process.kill()
    process.communicate()


@pytest.mark.parametrize("group", [True, False])
def test_an_interruption_ends_the_command_and_its_workers(started, tmp_path, group):
    process, _ = started
    if group:
        os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert "alignscores" not in err
    assert not [path for path in (tmp_path / "cache").iterdir() if path.suffix != ".json"]


def test_a_killed_worker_is_one_line(started):
    process, workers = started
    os.kill(workers[0], signal.SIGKILL)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (1, "", f"alignscores: error: {ENDED}\n")
