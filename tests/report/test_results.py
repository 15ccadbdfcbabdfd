"""A file at fault ends in one line that names it with the remedy, and the old page stays."""

import shutil
from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import report.results
from experiments.tables import read_record, write_recorded
from report.__main__ import main


def put(content):
    return lambda path: path.write_text(content)


def lose(path):
    path.unlink()


def cut(path):
    path.write_bytes(path.read_bytes()[:60])


def swap(old, new):
    def change(path):
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    return change


def other(**changes):
    def change(path):
        (sweep, *others) = read_record(path).sweeps
        write_recorded(path, path.read_bytes(), [replace(sweep, **changes), *others])

    return change


def as_jpeg(path):
    Image.open(path).convert("L").save(path, "JPEG")


FAULTS = [
    ("claims.csv", lose, "does not exist"),
    ("claims.csv", put(""), "cannot be read (No columns"),
    ("claims.csv", swap("outliers-range-maa,", "outliers-range-mab,"), "was made for other claims"),
    ("tables/readings.csv", lose, "does not exist"),
    ("tables/readings.csv", swap("taken,", "token,"), "was made for other claims"),
    ("tables/head_to_head.csv", lose, "does not exist"),
    ("tables/method_comparison.csv", lose, "does not exist"),
    ("figures/combined.png", lose, "does not exist"),
    ("figures/combined.png", put("GIF89a"), "is not a PNG"),
    ("figures/combined.png", cut, "is not a PNG"),
    ("figures/combined.png", as_jpeg, "is not a PNG"),
    ("tables/threshold_study_ras.csv", lose, "does not exist"),
    ("tables/threshold_study_time.csv", lose, "does not exist"),
    ("tables/beyond.csv", lose, "does not exist"),
    ("trials/threshold_study/length.json", lose, "does not exist"),
    ("trials/beyond/bias.json", put("{"), "is not the record"),
    ("trials/rotations.json", lose, "does not exist"),
    ("replicates/1.json", put("{"), "is not the record of a table of trials"),
    ("replicates/1.csv", other(replicate=2), "was made with other settings"),
    ("replicates/2.csv", other(trials=5), "was made with other settings"),
    ("trials/beyond/orbit.csv", other(metrics=["ATE"]), "was made with other settings"),
    (
        "trials/beyond/orbit.json",
        swap('"trials": 7', '"trials": 8'),
        "was changed, or orbit.json is not",
    ),
    ("trials/outliers.csv", put("1"), "was changed, or outliers.json is not its record"),
    ("trials/outliers.csv", lose, "does not exist"),
]


@pytest.mark.parametrize(("name", "change", "problem"), FAULTS)
def test_a_file_at_fault_is_named_with_the_remedy(results, capsys, name, change, problem):
    results.html.write_text("the old page")
    path = results.folder / name
    change(path)
    assert main(results.arguments()) == 1
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert out == ""
    if "was changed" in problem:
        path = path.with_suffix(".csv")
    assert line.startswith(f"report: {path} ")
    assert problem in line
    remove = "delete it and " if path.exists() else ""
    assert line.endswith(f"; {remove}run: snakemake {path}")
    assert results.html.read_text() == "the old page"


def test_settings_may_be_left_out():
    results = report.results.Results(Path("here"))
    assert results.settings == []
    with pytest.raises(FrozenInstanceError):  # what was read would not be theirs
        results.settings = ["trials=5"]


def test_jobs_have_the_same_columns_whatever_was_measured(results):
    """Snakemake of another version measures other things, with - for what it could not."""
    shutil.rmtree(results.folder / "benchmarks")
    columns = ["s", "cpu_time", "max_rss"]
    none = report.results.Results(results.folder, results.settings).jobs
    assert list(none.columns) == ["target", "job", *columns]
    assert none.empty
    results.write("benchmarks/trials/outliers.tsv", "s\th:m:s\n4.0\t0:04\n")
    results.write("benchmarks/answers/beyond.tsv", "max_rss\ts\n-\t2.5\n")
    jobs = report.results.Results(results.folder, results.settings).jobs
    assert list(jobs.columns) == [*columns, "target", "job"]
    assert jobs[["target", "job", "s"]].to_numpy().tolist() == [
        ["paper", "trials/outliers", 4.0],
        ["beyond", "answers/beyond", 2.5],
    ]
    assert np.isnan(jobs[["cpu_time", "max_rss"]].to_numpy(dtype=float)).all()


@pytest.mark.parametrize("own", [False, True])
def test_jobs_of_a_study(tmp_path, own):
    """Those of its own, in the order of their names, where it has any."""
    names = ["mine/b", "mine/a", "figures/other", "trials/mine/one", "figures/f", "times/mine"]
    for name in [*names, "answers/mine"]:
        path = tmp_path / f"benchmarks/{name}.tsv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    plan = SimpleNamespace(
        called="mine",
        folder="trials/mine",
        figures=["f", "g"],
        tables=["one", "two"],
        study=SimpleNamespace(own=own),
    )
    found = report.results.Results(tmp_path)._benchmarks(plan)
    expected = ["answers/mine", "times/mine", "figures/f", "trials/mine/one"]
    expected += ["mine/a", "mine/b"] if own else []
    assert found == [tmp_path / f"benchmarks/{name}.tsv" for name in expected]
