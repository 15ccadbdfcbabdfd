"""Commands end with an exit code, and with one line where something is wrong."""

from argparse import ArgumentParser
from pathlib import Path

import pytest

from experiments.command import ConfigError, run_command
from experiments.tables import TableError


def parser():
    command = ArgumentParser(prog="python -m experiments.example")
    command.add_argument("names", nargs="+")
    command.add_argument("--file")
    return command


def test_names_may_stand_around_options_and_results_are_printed(capsys):
    seen = []

    def work(options):
        seen.append((options.names, options.file))
        return [Path("a.csv"), "3 of 4"]

    assert run_command(parser(), work, ["x", "--file", "f", "y"]) == 0
    assert run_command(parser(), work, ["x"]) == 0
    assert seen == [(["x", "y"], "f"), (["x"], None)]
    assert capsys.readouterr().out == "a.csv\n3 of 4\n" * 2


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (ConfigError("setting 'x' is wrong"), 2, "setting 'x' is wrong"),
        (TableError(Path("t.csv"), "is missing"), 1, "t.csv is missing; run: snakemake t.csv"),
        (PermissionError(13, "Permission denied", "d"), 1, "cannot write d: Permission denied"),
        (ConnectionError("nobody answers"), 1, "nobody answers"),
        (MemoryError(), 1, "not enough memory; set n_jobs=1, or fewer cameras"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_what_goes_wrong_is_one_line_and_an_exit_code(error, code, line, capsys):
    def work(_):
        raise error

    assert run_command(parser(), work, ["x"]) == code
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"experiments.example: {line}\n")
