"""Tables are read back bit for bit, or refused in one line that names the file and what to do."""

import json
from dataclasses import replace

import pandas as pd
import pytest

from experiments.config import Selection
from experiments.sweep import run_sweeps
from experiments.tables import TableError, read_table, read_trials, write_trials


def test_trials_and_settings_come_back_bit_for_bit(tmp_path, small, trials):
    path = tmp_path / "a" / "outliers.csv"
    write_trials(path, trials, [small()])
    read = read_trials(path)
    pd.testing.assert_frame_equal(read.table, trials, check_exact=True)
    assert (read.path, read.sweep, read.record.sweeps) == (path, small(), (small(),))


def test_a_table_of_several_sweeps_comes_back_bit_for_bit(tmp_path, small):
    path = tmp_path / "0.csv"
    part = replace(
        small("trials=1", "tas.prescreen=inf"),
        selections=[Selection(["ATE"], {"n_outliers": [3]})],
    )
    sweeps = part, replace(small("trials=1", "metrics=[RAS,ATE]"), changes="nan")
    table = run_sweeps(sweeps)
    write_trials(path, table, sweeps)
    read = read_trials(path)
    pd.testing.assert_frame_equal(read.table, table, check_exact=True)
    assert (read.record.sweeps, read.record.metrics) == (sweeps, ["ATE", "RAS"])


@pytest.fixture
def table(tmp_path, small, trials):
    path = tmp_path / "outliers.csv"
    write_trials(path, trials, [small()])
    return path


def test_the_record_has_settings_versions_commit_and_platform(table):
    record = json.loads(table.with_suffix(".json").read_text())
    assert list(record) == ["sweeps", "sha256", "packages", "git", "python", "platform"]
    assert (record["sweeps"][0]["sigma_t"], record["sweeps"][0]["seed"]) == ([0.02, 0.05], 0)
    assert not {"n_jobs", "results_dir"} & set(record["sweeps"][0])
    assert {"alignscores", "numpy", "scipy", "pandas"} <= set(record["packages"])


def refusal(path, of):
    """Return what is wrong with a table of trials, without the end of the line."""
    with pytest.raises(TableError) as caught:
        read_trials(path)
    line, start = str(caught.value), f"{of} "
    assert line.startswith(start)
    assert line.endswith(f"; {'delete it and ' if of.exists() else ''}run: snakemake {of}")
    assert "\n" not in line
    return line.removeprefix(start)


CHANGED = "was changed, or outliers.json is not its record"


def test_a_changed_table_is_refused(table):
    content = table.read_bytes()
    index = content.rindex(b".") + 1
    table.write_bytes(content[:index] + b"7" + content[index:])
    assert refusal(table, table).startswith(CHANGED)


def test_a_missing_table_and_a_folder_in_its_place_are_refused(table):
    table.unlink()
    assert refusal(table, table).startswith("does not exist")
    table.mkdir()
    assert refusal(table, table).startswith("cannot be read (Is a directory)")


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{",
        "[" * 100_000,
        '{"sweeps": [], "packages": 1, "git": 1, "python": 1, "platform": 1}',
        '{"sweeps": [{"unknown": 1}], "sha256": {}}',
    ],
    ids=lambda text: text[:20],
)
def test_what_is_no_record_is_refused(table, text):
    record = table.with_suffix(".json")
    record.write_text(text)
    assert refusal(table, record).startswith("is not the record of a table of trials")


def test_a_table_needs_the_columns_that_are_asked_for(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("a,b\n1,2\n")
    assert read_table(path, ["b"], dtype={"a": str})["a"].tolist() == ["1"]
    with pytest.raises(TableError, match=f"{path} has no column c; "):
        read_table(path, ["a", "c"])
