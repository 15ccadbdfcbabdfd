"""Ctrl-C, a failing start of a process, and what is left: of compare, as a command and from Python.

Each script runs in a session of its own. Its pipes are closed when the last of its processes is
gone, so that `communicate` returns only then; the timeout is there for a hang alone.
"""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is forked")

PLACED = """\
import errno, os, signal, sys
place, number = sys.argv.pop(1), int(sys.argv.pop(1))
fork, forks = os.fork, []

def counted():
    forks.append(place)
    if place == "fails" and len(forks) == number:
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
    return fork()

def interrupt():
    if len(forks) == number:
        group = place.endswith("group")
        os.killpg(0, signal.SIGINT) if group else os.kill(parent, signal.SIGINT)

os.fork, parent = counted, os.getpid()
if place != "fails":
    os.register_at_fork(**{place.removesuffix("_group"): interrupt})
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
try:
    print(os.waitpid(-1, os.WNOHANG))
except ChildProcessError:
    print("no child")
"""
PLACES = [  # around which start of a worker
    *(("before", 1), ("after_in_parent", 1), ("after_in_parent", 2)),
    *(("after_in_child", 1), ("after_in_child", 2), ("after_in_parent_group", 2)),
]
LIMIT = "no further process can be started (Resource temporarily unavailable); set fewer jobs"


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


@pytest.mark.parametrize(("place", "number"), PLACES)
def test_an_interruption_ends_the_command(start, place, number):
    with start(PLACED + COMMAND, place, number, *ARGUMENTS) as process:
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (-signal.SIGINT, "", "")


def test_a_command_that_ignores_interruptions_is_not_interrupted(start):
    ignoring = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
    with start(ignoring + PLACED + COMMAND, "after_in_parent", 1, *ARGUMENTS) as process:
        out, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    assert out.startswith("a, b: one run on one sequence, too few to be tested.\n\nsystem ")


@pytest.mark.parametrize(("place", "number"), PLACES[-2:])
def test_an_interruption_reaches_the_caller_in_python(start, place, number):
    with start(PLACED + PYTHON, place, number, *PATTERNS) as process:
        out, err = process.communicate(timeout=60)
    assert (out, err) == ("KeyboardInterrupt \nno child\n", "")


@pytest.mark.parametrize("number", [1, 2])
def test_a_process_that_cannot_be_started_is_one_line(start, number):
    with start(PLACED + COMMAND, "fails", number, *ARGUMENTS) as process:
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (1, "", f"alignscores: error: {LIMIT}\n")
    with start(PLACED + PYTHON, "fails", number, *PATTERNS) as process:
        out, err = process.communicate(timeout=60)
    assert (out, err) == (f"ChildProcessError {LIMIT}\nno child\n", "")


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_workers_end_with_the_command_in_the_middle_of_their_work(start, tmp_path, end):
    """Each scores a run of 200,000 poses."""
    stamps = np.arange(0, 20_000, 0.1)
    poses = np.random.default_rng(0).normal(size=(200_000, 3))
    rows = np.column_stack([stamps, poses, np.tile([0.0, 0, 0, 1], (200_000, 1))])
    np.savetxt(tmp_path / "gt.ref", rows, "%.6g")
    for name in "ab":
        shutil.copy(tmp_path / "gt.ref", tmp_path / f"{name}.txt")
    with start("import sys\n" + COMMAND, *ARGUMENTS) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        while len(children.read_text().split()) < 2:
            assert process.poll() is None
        process.send_signal(end)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (-end, "", "")
