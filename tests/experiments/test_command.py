"""Commands end with an exit code, and with one line where something is wrong."""

import os
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable
from pathlib import Path

import pytest

from experiments.command import run_command
from experiments.config import ConfigError
from experiments.tables import TableError, write_files

ROOT = Path(__file__).resolve().parents[2]


def parser() -> ArgumentParser:
    command = ArgumentParser(prog="python -m experiments.example")
    command.add_argument("name", metavar="NAME")
    command.add_argument("--file")
    return command


def test_settings_may_stand_around_options_and_results_are_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    seen = []

    def work(options: Namespace) -> Iterable[object]:
        seen.append((options.name, options.file, options.overrides))
        return [Path("a.csv"), "3 of 4"]

    assert run_command(parser(), work, ["x", "seed=1", "--file", "f", "trials=2"]) == 0
    assert run_command(parser(), work, ["x"]) == 0
    assert seen == [("x", "f", ["seed=1", "trials=2"]), ("x", None, [])]
    assert capsys.readouterr().out == "a.csv\n3 of 4\n" * 2


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (ConfigError("setting 'x' is wrong"), 2, "setting 'x' is wrong"),
        (TableError(Path("t.csv"), "has no trials"), 1, "t.csv has no trials"),
        (
            TableError(Path("t.csv"), "does not exist", ["experiments.run", "n_cameras=[4, 5]"]),
            1,
            "t.csv does not exist; run: python -m experiments.run 'n_cameras=[4, 5]'",
        ),
        (PermissionError(13, "Permission denied", "d"), 1, "cannot write d: Permission denied"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_what_goes_wrong_is_one_line_and_an_exit_code(
    error: BaseException, code: int, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def work(_: Namespace) -> Iterable[object]:
        raise error

    assert run_command(parser(), work, ["x"]) == code
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"experiments.example: {line}\n")


def test_faults_of_the_program_are_not_hidden() -> None:
    def work(_: Namespace) -> Iterable[object]:
        raise ValueError("a defect")

    with pytest.raises(ValueError, match="a defect"):
        run_command(parser(), work, ["x"])


def test_two_processes_write_the_same_file_whole(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    code = """
import sys
from pathlib import Path
from experiments.tables import write_files
for _ in range(100):
    write_files({Path(sys.argv[1]): sys.argv[2].encode() * 1_000_000})
"""
    command = [sys.executable, "-c", code, str(path)]
    writers = [subprocess.Popen([*command, letter], cwd=ROOT) for letter in "ab"]
    seen = set()
    while any(writer.poll() is None for writer in writers):
        if path.exists():
            seen.add(path.read_bytes())
    assert [writer.returncode for writer in writers] == [0, 0]
    assert seen <= {b"a" * 1_000_000, b"b" * 1_000_000}
    assert list(tmp_path.iterdir()) == [path]


def test_files_are_written_whole_or_not_at_all_and_the_one_at_fault_is_named(
    tmp_path: Path,
) -> None:
    first, second = tmp_path / "a" / "1.csv", tmp_path / "b" / "2.csv"
    write_files({first: b"1", second: b"2"})
    assert (first.read_bytes(), second.read_bytes()) == (b"1", b"2")
    obstacle = tmp_path / "b" / f".3.csv.{os.getpid()}"
    obstacle.mkdir()  # in the way of the temporary file
    with pytest.raises(OSError, match="directory") as caught:
        write_files({first: b"3", tmp_path / "b" / "3.csv": b"3"})
    assert caught.value.filename == str(tmp_path / "b" / "3.csv")
    assert first.read_bytes() == b"1"
    assert {path.name for path in tmp_path.rglob("*")} == {
        "a",
        "b",
        "1.csv",
        "2.csv",
        obstacle.name,
    }
