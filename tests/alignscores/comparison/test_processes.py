"""An interruption in the middle of parallel work ends all processes."""

import os
import shutil
import signal
import subprocess
import sys

import pytest

START = "import os, signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
COMMAND = f"{START}from alignscores.__main__ import command; sys.exit(command())"
LIBRARY = f"""{START}
from alignscores import compare
try:
    compare("gt.ref", "{{system}}.txt", format="tum", jobs=2)
except KeyboardInterrupt:
    print("interrupted")
try:
    os.waitpid(-1, os.WNOHANG)
except ChildProcessError:
    print("no child")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is forked")
@pytest.mark.parametrize(
    ("code", "end", "expected"),
    [
        *((COMMAND, end, (-end, "")) for end in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)),
        (LIBRARY, signal.SIGINT, (0, "interrupted\nno child\n")),
    ],
)
def test_workers_end_with_the_program(examples, tmp_path, code, end, expected):
    """They wait for pipes, which open once a worker reads; `communicate` waits for all of them."""
    shutil.copy(examples / "tum/reference.txt", tmp_path / "gt.ref")
    first, second = tmp_path / "a.txt", tmp_path / "b.txt"
    os.mkfifo(first)
    os.mkfifo(second)
    process = subprocess.Popen(
        [sys.executable, "-c", code, "compare", "tum", "gt.ref", "{system}.txt", "--jobs", "2"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with process, first.open("w"), second.open("w"):
        process.send_signal(end)
        out, err = process.communicate(timeout=60)
    assert ((process.returncode, out), err) == (expected, "")
