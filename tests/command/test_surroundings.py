"""Full and closed streams, and no home: one line and the right exit code."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from alignscores import files

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="redirections of a POSIX shell")

COMMAND = sys.executable, "-m", "alignscores"
TUM = "tum tum/reference.txt tum/estimate.txt"
COMPARE = "compare tum tum/reference.txt tum/{system}.txt --jobs 1"


@pytest.fixture
def shell(examples):
    """(arguments, redirections) -> the command under a shell, in the folder of the examples.

    What it prints waits in a buffer, as for users, whatever the tests run in.
    """

    def shell(arguments, redirections):
        line = f'"$@" {redirections}'
        return subprocess.run(
            ["bash", "-c", line, "bash", *COMMAND, *arguments.split()],
            cwd=examples,
            env={**os.environ, "PYTHONUNBUFFERED": ""},
            capture_output=True,
            text=True,
            timeout=100,
        )

    return shell


PRINTS = TUM, "--help"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("arguments", PRINTS)
def test_stdout_is_full(shell, arguments):
    done = shell(arguments, ">/dev/full")
    assert done.returncode == 1
    assert done.stderr == "alignscores: error: [Errno 28] No space left on device\n"


@pytest.mark.parametrize("arguments", PRINTS)
def test_streams_are_closed(shell, run, arguments):
    """As for daemons."""
    done = shell(arguments, "2>&-")
    assert (done.returncode, done.stdout) == (0, run(*arguments.split())[1])
    done = shell(arguments, ">&-")
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)


@pytest.mark.parametrize("arguments", PRINTS)
def test_nobody_reads_stdout(shell, arguments):
    done = shell(arguments, "| true; exit ${PIPESTATUS[0]}")
    assert (done.returncode, done.stderr) == (1, "")


def test_a_named_pipe_is_read_once(shell, run, tmp_path):
    """Nobody writes to it again."""
    pipe = tmp_path / "estimate.txt"
    os.mkfifo(pipe)
    started = time.monotonic()
    done = shell(f"tum tum/reference.txt {pipe}", f"< <(cat tum/estimate.txt > {pipe})")
    assert (done.returncode, done.stdout) == (0, run(*TUM.split())[1])
    assert time.monotonic() - started < files.MAX_SILENCE


def test_there_is_no_home(process):
    """Nor an entry of the user among the passwords, as in containers."""
    no_home = "import os, pwd; del os.environ['HOME']; pwd.getpwuid = {}.__getitem__"
    done = process(*COMPARE.split(), before=no_home)
    assert (done.returncode, done.stderr) == (0, "")
    assert "estimate" in done.stdout
