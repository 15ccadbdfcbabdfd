"""How many functions of the package a call goes through, and in how many files."""

import sys
from pathlib import Path

import numpy as np

import alignscores
from alignscores import tas

PACKAGE = str(Path(alignscores.__file__).parent)


def functions(call):
    """Return file and line of each function, without comprehensions and lambdas, that runs."""
    found = set()

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(PACKAGE) and code.co_name[0] != "<":
            found.add((code.co_filename, code.co_firstlineno))

    call()  # once before, so that imports and caches do not count
    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    return found


def test_tas_goes_through_few_functions():
    gt = np.random.default_rng(0).random((100, 3))
    found = functions(lambda: tas(gt, gt + 0.01))
    assert len(found) < 25
    assert len({file for file, _ in found}) <= 6


def test_a_command_goes_through_few_functions(command, examples):
    files = [examples / "tum" / name for name in ("reference.txt", "estimate.txt")]
    found = functions(lambda: command("tum", *files))
    assert len(found) < 205  # the aim is 150 in 25 files
    assert len({file for file, _ in found}) <= 39
