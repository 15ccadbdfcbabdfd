"""Tables are written whole and read back bit for bit, or refused in one line that names them."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from experiments.config import Selection, Sweep, load
from experiments.sweep import run_sweeps
from experiments.tables import (
    TableError,
    fits,
    read_record,
    read_table,
    read_trials,
    write_files,
    write_trials,
)

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_two_processes_write_the_same_file_whole(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    code = """
import sys
from pathlib import Path
from experiments.tables import write_files
for _ in range(50):
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
    obstacle = tmp_path / "b" / "3.csv"
    obstacle.mkdir()
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


def test_trials_and_settings_come_back_bit_for_bit(
    tmp_path: Path, small: Callable[..., Sweep], trials: pd.DataFrame
) -> None:
    path = tmp_path / "a" / "outliers.csv"
    write_trials(path, trials, [small()])
    read = read_trials(path)
    pd.testing.assert_frame_equal(read.table, trials, check_exact=True)
    assert (read.path, read.sweep, read.record.sweeps) == (path, small(), (small(),))
    write_trials(tmp_path / "again.csv", read.table, read.record.sweeps)
    assert (tmp_path / "again.csv").read_bytes() == path.read_bytes()


def test_a_table_of_several_sweeps_comes_back_bit_for_bit(
    tmp_path: Path, small: Callable[..., Sweep]
) -> None:
    path = tmp_path / "0.csv"
    part = replace(small("trials=1"), selections=[Selection(["ATE"], {"n_outliers": [3]})])
    sweeps = part, replace(small("trials=1", "metrics=[RAS,ATE]"), changes="nan")
    table = run_sweeps(sweeps, load(["backend=sequential"])[1])
    write_trials(path, table, sweeps)
    read = read_trials(path)
    pd.testing.assert_frame_equal(read.table, table, check_exact=True)
    assert read.record.sweeps == sweeps
    assert read.record.metrics == ["ATE", "RAS"]


def test_the_record_tells_settings_versions_commit_and_platform(
    tmp_path: Path, small: Callable[..., Sweep], trials: pd.DataFrame
) -> None:
    write_trials(tmp_path / "t.csv", trials, [small()])
    record = json.loads((tmp_path / "t.json").read_text())
    assert list(record) == ["sweeps", "sha256", "packages", "git", "python", "platform"]
    assert (record["sweeps"][0]["sigma_t"], record["sweeps"][0]["seed"]) == ([0.02, 0.05], 0)
    assert not {"n_jobs", "results_dir", "changes", "selections"} & set(record["sweeps"][0])
    assert {"alignscores", "numpy", "scipy", "pandas", "pydantic"} <= set(record["packages"])
    assert read_record(tmp_path / "t.csv").origin["packages"] == record["packages"]


@pytest.mark.parametrize(("folder", "known"), [("configs", True), ("archive/configs", False)])
def test_the_commit_is_of_this_source_and_of_no_repository_around_it(
    tmp_path: Path,
    small: Callable[..., Sweep],
    trials: pd.DataFrame,
    folder: str,
    known: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    git = ["git", "-C", str(tmp_path), "-c", "user.name=A", "-c", "user.email=a@b"]
    subprocess.run([*git, "init", "-q"], check=True)
    subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "first"], check=True)
    (tmp_path / folder).mkdir(parents=True)
    monkeypatch.setattr("experiments.tables.CONFIG_DIR", tmp_path / folder)
    write_trials(tmp_path / "t.csv", trials, [small()])
    record = json.loads((tmp_path / "t.json").read_text())
    assert (record["git"] is not None) == known


@pytest.fixture
def table(tmp_path: Path, small: Callable[..., Sweep], trials: pd.DataFrame) -> Path:
    path = tmp_path / "outliers.csv"
    write_trials(path, trials, [small()])
    return path


def refusal(path: Path, of: Path) -> str:
    """Return what is wrong with a table of trials, without the end of the line."""
    with pytest.raises(TableError) as caught:
        read_trials(path)
    start, end = f"{of} ", f"run: snakemake {of}"
    line = str(caught.value)
    assert line.startswith(start)
    assert line.endswith(f"; delete it and {end}" if of.exists() else f"; {end}")
    assert "\n" not in line
    return line.removeprefix(start)


CHANGED = "was changed, or outliers.json is not its record"


@pytest.mark.parametrize(
    "setting", [{"trials": 9}, {"name": "mine"}, {"sigma_t": [0.05, 0.02]}], ids=str
)
def test_settings_that_were_changed_are_refused(table: Path, setting: dict[str, Any]) -> None:
    record = json.loads(table.with_suffix(".json").read_text())
    record["sweeps"][0].update(setting)
    table.with_suffix(".json").write_text(json.dumps(record))
    assert refusal(table, table).startswith(CHANGED)


def test_any_digit_that_was_changed_is_noticed(table: Path, small: Callable[..., Sweep]) -> None:
    content = table.read_bytes()
    assert fits(table, [small()])
    assert not fits(table, [small("trials=9")])
    digits = [place for place, letter in enumerate(content) if chr(letter).isdigit()]
    for place in digits[:: len(digits) // 50]:
        digit = b"%d" % ((int(content[place : place + 1]) + 1) % 10)
        table.write_bytes(content[:place] + digit + content[place + 1 :])
        assert refusal(table, table).startswith(CHANGED)
        assert not fits(table, [small()])


@pytest.mark.parametrize("content", ["", '"a\n1', "\0", "a,b\n1,2\n"], ids=repr)
def test_what_is_no_table_is_refused(table: Path, content: str) -> None:
    table.write_text(content)
    assert refusal(table, table).startswith(CHANGED)
    table.unlink()
    assert refusal(table, table).startswith("does not exist")
    table.mkdir()
    assert refusal(table, table).startswith("cannot be read (Is a directory)")


@pytest.mark.parametrize(
    "change",
    [
        "[]",
        "{}",
        "{",
        "\xff",
        "[" * 100_000,
        '{"sweeps": [], "packages": 1, "git": 1, "python": 1, "platform": 1}',
        '{"sweeps": 1, "packages": 1, "git": 1, "python": 1, "platform": 1}',
        {"packages": None},
        {"sweeps": [{}]},
        {"sweeps": [{"unknown": 1}]},
    ],
    ids=lambda change: str(change)[:20],
)
def test_what_is_no_record_is_refused(table: Path, change: str | dict[str, Any]) -> None:
    record = table.with_suffix(".json")
    if isinstance(change, str):
        record.write_bytes(change.encode("latin-1"))
    else:
        ((key, value),) = change.items()
        content = json.loads(record.read_text())
        content = (
            content | change if value is not None else {k: content[k] for k in content if k != key}
        )
        record.write_text(json.dumps(content))
    assert refusal(table, record).startswith("is not the record of a table of trials")
    record.unlink()
    assert refusal(table, record).startswith("does not exist")
    record.mkdir()
    assert refusal(table, record).startswith("cannot be read (Is a directory)")
    record.rmdir()
    record.symlink_to("/dev/zero")
    assert refusal(table, record).startswith("is no file")


def test_a_table_needs_the_columns_that_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("a,b\n1,2\n")
    assert read_table(path, ["b"], dtype={"a": str})["a"].tolist() == ["1"]
    with pytest.raises(TableError, match=f"{path} has no column c; "):
        read_table(path, ["a", "c"])
