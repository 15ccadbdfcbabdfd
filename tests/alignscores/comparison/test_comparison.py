"""`compare` from Python: patterns or a YAML file, and what its result tells."""

import json
import os
import shutil
import sys
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import numpy as np
import pytest

from alignscores import Comparison, Settings, compare
from alignscores.comparison import comparison, processes
from alignscores.comparison.baseline import Changes
from alignscores.comparison.benchmark import Benchmark, Run
from alignscores.comparison.comparison import (
    _finite,
    _notes_of_runs,
    _scored,
    _tasks,
    settings_of_run,
)
from alignscores.comparison.patterns import Pattern
from alignscores.comparison.processes import Pool
from alignscores.comparison.runs import Outcome, Task
from alignscores.comparison.summary import Summary
from alignscores.trajectories.files import FileError


@pytest.fixture
def found(patterns, tmp_path, monkeypatch):
    """The comparison of two systems, of which the second lacks a run."""
    monkeypatch.chdir(tmp_path)
    return compare(*patterns[1:], format=patterns[0], metrics="ate:rmse")


def test_to_dict_is_what_the_command_prints(found, patterns, run):
    assert isinstance(found, Comparison)
    code, out, err = run(*patterns, "--metrics", "ate:rmse", "--json", "--jobs", 1)
    assert code == 1
    assert json.loads(out) == found.to_dict()
    assert out == json.dumps(found.to_dict(), indent=2) + "\n"
    (failed,) = found.failed
    assert err == f"alignscores: error: {failed}; it counts as a failure\n"
    assert found.problems == []
    json.dumps(found.to_dict(), allow_nan=False)


def test_a_yaml_file(found, tmp_path, run):
    described = {
        "format": "tum",
        "reference": "{sequence}/gt.txt",
        "estimate": "{sequence}/{system}/{run}.txt",
        "sequences": {"car": {"name": "the car", "unit": 0.5}},
    }
    (tmp_path / "b.yaml").write_text(json.dumps(described))
    named = compare("b.yaml")
    assert named.names.sequences["car"] == "the car"
    assert {result["unit"] for result in named.to_dict()["results"]} >= {0.5}
    assert json.loads(run("b.yaml", "--json")[1]) == named.to_dict()


def test_a_mix_up_is_told_of_the_first_run_of_a_system(patterns, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file in (tmp_path / "helix/c").iterdir():
        stamped = np.loadtxt(file)
        stamped[:, 4:7] *= -1  # of the inverse rotation
        np.savetxt(file, stamped)
    (note,) = compare(*patterns[1:], format=patterns[0]).notes
    assert note.startswith("helix, c, run 0: the camera's frame is turned")
    assert "alike" not in note


def test_a_system_that_was_to_be_run_everywhere(found, patterns, tmp_path):
    shutil.rmtree(tmp_path / "car/c")
    assert compare(*patterns[1:], format=patterns[0]).failed == []
    expected = compare(*patterns[1:], format=patterns[0], expect_all=True)
    assert expected.failed == [f"c: has no run {run} on car" for run in range(3)]


def test_a_system_and_a_sequence_of_one_name(found, tmp_path):
    (tmp_path / "car/c").rename(tmp_path / "car/car")
    described = {
        "format": "tum",
        "reference": "{sequence}/gt.txt",
        "estimate": "{sequence}/{system}/{run}.txt",
        "sequences": {"car": {"name": "the car"}},
        "systems": {"car": {"name": "CAR-SLAM"}},
    }
    (tmp_path / "b.yaml").write_text(json.dumps(described))
    names = compare("b.yaml").names
    assert (names.sequences["car"], names.systems["car"]) == ("the car", "CAR-SLAM")


def test_scores_among_the_metrics_have_their_columns_already(found, patterns):
    again = compare(*patterns[1:], format=patterns[0], metrics="TAS,half,ate:rmse,ATE")
    assert list(again.to_dict()["results"][0]["metrics"]) == ["ate:rmse", "ATE"]
    pairs = [(pair["metric"], pair["sequence"]) for pair in again.to_dict()["comparisons"]]
    assert len(set(pairs)) == len(pairs)


def test_the_ate_is_this_package_s(found, patterns):
    """Where evo's has a value they are equal; of lost cameras evo's has one as well."""
    again = compare(*patterns[1:], format=patterns[0], metrics="ATE,ate:rmse")
    for result in again.to_dict()["results"]:
        if result["status"] == "scored":
            assert result["metrics"]["ATE"] == pytest.approx(result["metrics"]["ate:rmse"])


def test_the_cache_is_made_and_used(found, patterns, tmp_path):
    folder = tmp_path / "new/cache"
    first = compare(*patterns[1:], format=patterns[0], metrics="ate:rmse", cache=folder)
    assert first.to_dict() == found.to_dict()
    kept = {file: file.stat().st_mtime_ns for file in folder.iterdir()}
    assert len(kept) == 2 * 11
    compare(*patterns[1:], format=patterns[0], metrics="ate:rmse", cache=str(folder))
    assert {file: file.stat().st_mtime_ns for file in folder.iterdir()} == kept
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="the cache file cannot be made"):
        compare(*patterns[1:], format=patterns[0], cache="file")


def test_the_cache_knows_the_parts_of_a_model_by_their_content(examples, tmp_path):
    """Also where they are links to folders elsewhere."""
    (tmp_path / "sparse").mkdir()
    for part in "01":
        shutil.copytree(examples / "colmap/estimate", tmp_path / "elsewhere" / part)
        (tmp_path / "sparse" / part).symlink_to(tmp_path / "elsewhere" / part)
    files = str(examples / "colmap/reference"), str(tmp_path / "{system}rse")

    def scored():
        found = compare(*files, format="colmap", cache=tmp_path / "cache")
        return found.to_dict()["results"][0]["n"], len(list((tmp_path / "cache").iterdir()))

    assert scored() == scored() == (40, 2)
    shutil.rmtree(tmp_path / "elsewhere/1")
    shutil.copytree(examples / "colmap/reference", tmp_path / "elsewhere/1")
    assert scored() == (40, 4)


@pytest.mark.parametrize(
    ("arguments", "settings", "message"),
    [
        (["{sequence}/gt.txt", "{sequence}/{system}.txt"], {}, "give the format of the files"),
        (["{sequence}/gt.txt"], {"format": "tum"}, "give a pattern of estimates, too, or one YAML"),
        (["x.txt", "{system}.txt"], {"format": "tum"}, "no reference matches the pattern x.txt"),
        (
            ["{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"],
            {"format": "tum", "frames": np.arange(3)},
            "frames must be a file, or a pattern with {sequence}, of each sequence",
        ),
        (["none.yaml"], {}, "none.yaml: cannot be read: No such file or directory"),
        (["x", "{system}"], {"format": "tum", "weight": 2}, "weight must be a finite number from"),
    ],
)
def test_what_is_wrong_is_a_value_error(found, arguments, settings, message):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        compare(*arguments, **settings)
    assert message in str(caught.value)


def test_a_table_of_pandas(found):
    pandas = pytest.importorskip("pandas")
    table = found.to_frame()
    assert isinstance(table, pandas.DataFrame)
    assert len(table) == 2 * 3
    overall = table[table["sequence"].isna()].set_index("system")
    for entry in found.to_dict()["systems"]:
        if entry["sequence"] is None:
            assert overall.loc[entry["system"], "PAS"] == entry["PAS"]
            assert overall.loc[entry["system"], "failed_runs"] == entry["failed_runs"]
    assert {"TAS", "RAS_sd", "half_distance", "ate:rmse", "runs", "n"} <= set(table)


def test_without_pandas_the_table_says_what_to_install(found, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError) as caught:
        found.to_frame()
    assert str(caught.value) == 'pandas is not installed: pip install "alignscores[tables]"'


def test_a_note_is_told_once_of_a_system_whatever_its_numbers():
    notes = {
        ("s", "a", "1"): ["1 of 20 lost", "turned"],
        ("s", "a", "2"): ["3.5 of 20 lost"],
        ("t", "a", "1"): ["4 of 20 lost"],
        ("s", "b", "1"): ["turned", "2 of 20 found"],
    }
    runs = [(Run(*name, "file"), Outcome({}, notes=of)) for name, of in notes.items()]
    assert _notes_of_runs(runs) == [
        "s, a, run 1: 1 of 20 lost (and alike for 2 more of a)",
        "s, a, run 1: turned",
        "s, b, run 1: turned",
        "s, b, run 1: 2 of 20 found",
    ]


def test_a_run_is_scored_with_the_settings_of_its_sequence_and_its_system():
    options = {"s": {"name": "S", "t_offset": 0.5, "frames": "own.txt"}}
    of_systems = {"a": {"runs": 3, "invert": True, "t_offset": 2.0}}
    benchmark = Benchmark("tum", {}, [], [], [], options, of_systems)
    settings = Settings(format="tum", frames="{sequence}.txt", unit=2.0)

    def changed(sequence, system):
        found = settings_of_run(benchmark, Run(sequence, system, "1", None), settings)
        return found.frames, found.t_offset, found.invert, found.unit

    assert changed("s", "a") == ("own.txt", 2.0, True, 2.0)
    assert changed("s", "b") == ("own.txt", 0.5, False, 2.0)
    assert changed("t", "b") == ("t.txt", settings.t_offset, False, 2.0)


KINDS = Benchmark, Changes, Comparison, Outcome, Pattern, Run, Summary, Task


@pytest.mark.parametrize("kind", KINDS)
def test_what_was_found_is_not_changed_afterwards(kind):
    with pytest.raises(FrozenInstanceError):
        setattr(object.__new__(kind), fields(kind)[0].name, None)


@pytest.mark.parametrize("kind", [Comparison, Outcome, Summary])
def test_what_holds_arrays_is_equal_to_itself_alone(kind):
    one, other = object.__new__(kind), object.__new__(kind)
    assert len({one, other, one}) == 2


@pytest.fixture
def examples_of_s(examples):
    """A benchmark of one sequence: a system with two runs, of which the first is missing."""
    reference, estimate = (str(examples / f"tum/{name}.txt") for name in ("reference", "estimate"))
    runs = [("b", None), ("a", None), ("b", estimate), ("a", estimate), ("a", estimate)]
    runs = [Run("s", name, str(number), file) for number, (name, file) in enumerate(runs)]
    others = [Run("t", "a", "1", estimate)]
    return Benchmark("tum", {"s": reference, "t": "none.txt"}, [*runs, *others], [], [])


def test_what_is_to_be_done_on_a_sequence(examples_of_s, tmp_path):
    """The first run of each system that is there is checked; the settings are those of the run."""
    benchmark = examples_of_s
    duplicate = tmp_path / "gt.txt"
    text = Path(benchmark.references["s"]).read_text()
    duplicate.write_text(text + text.splitlines()[-1])
    benchmark.references["s"] = str(duplicate)
    settings = Settings(format="tum", unit=2.0)
    tasks, notes = _tasks(benchmark, "s", settings, tmp_path)
    assert notes == ["s: duplicates in the reference (of stamp or name), left out: 1"]
    assert tasks == {
        run: Task(str(duplicate), run.file or "", settings, tmp_path, None, check)
        for run, check in zip(benchmark.runs[:5], (False, False, True, True, False), strict=True)
    }


def test_a_sequence_needs_its_reference_and_its_frames(examples_of_s):
    with pytest.raises(FileError, match=r"^none\.txt: cannot be read"):
        _tasks(examples_of_s, "t", Settings(format="tum"), None)
    with pytest.raises(FileError, match=r"^s\.csv: cannot be read"):
        _tasks(examples_of_s, "s", Settings(format="tum", frames="{sequence}.csv"), None)


def test_runs_of_a_sequence_are_scored_at_the_smallest_of_their_steps(monkeypatch):
    """Those that are missing are told; all stand in the order they were given in."""
    steps = {"s/a": 0.5, "s/b": 0.25, "s/c": None, "t/a": 0.125, "u/a": None}
    runs = [Run(*name.split("/"), "1", name) for name in steps]
    runs.insert(1, Run("s", "a", "2", None))
    tasks = {run: Task("gt", run.file or "", Settings(format="tum")) for run in runs}
    monkeypatch.setattr(comparison, "step_of_run", lambda task: steps[task.estimate])
    monkeypatch.setattr(
        comparison, "evaluate_run", lambda task: Outcome({}, unit=task.step, error=task.estimate)
    )
    said = []
    found = _scored(tasks, 1, said.append)
    assert [run for run, _ in found] == runs
    assert [outcome.error for _, outcome in found] == [
        *("s/a", "a: has no run 2 on s", "s/b", "s/c", "t/a", "u/a")
    ]
    units = [outcome.unit for run, outcome in found if run.file]
    assert units == [0.25, 0.25, 0.25, 0.125, None]
    assert said == [
        *(f"looking at {number}/5" for number in range(1, 6)),
        *("", *(f"scoring {number}/5" for number in range(1, 6)), ""),
    ]


def test_notes_on_a_reference_are_told_each_time(examples, tmp_path):
    text = (examples / "tum/reference.txt").read_text()
    (tmp_path / "gt.txt").write_text(text + text.splitlines()[-1])
    patterns = str(tmp_path / "gt.txt"), str(examples / "tum/{system}mate.txt")
    for _ in range(2):
        (note,) = compare(*patterns, format="tum").notes
        assert note == "gt: duplicates in the reference (of stamp or name), left out: 1"


def test_by_default_no_other_process_works(examples, monkeypatch):
    def fail(*arguments, **options):
        raise AssertionError("another process is started")

    monkeypatch.setattr(processes, "ProcessPoolExecutor", fail)
    patterns = [str(examples / f"tum/{name}.txt") for name in ("reference", "{system}mate")]
    assert compare(*patterns, format="tum").failed == []
    with pytest.raises(AssertionError, match="another process"):
        compare(*patterns, format="tum", jobs=2)


def test_the_oldest_results_leave_a_cache_that_is_full(examples, tmp_path):
    old = tmp_path / f"{'0' * 64}.npz"
    old.touch()
    os.truncate(old, 10**9)  # takes no room on the disk
    os.utime(old, (0, 0))
    patterns = (str(examples / f"tum/{name}.txt") for name in ("reference", "{system}mate"))
    compare(*patterns, format="tum", cache=tmp_path)
    assert not old.exists()
    assert len(list(tmp_path.iterdir())) == 2


def test_a_comparison_says_what_it_is_of(found):
    assert repr(found) == (
        "Comparison(systems=['a_b', 'c'], sequences=['car', 'helix'], runs=12, failed=1)"
    )


def test_numbers_that_json_has_not_are_null():
    assert _finite({"a": [1.5, float("nan"), (float("inf"), 2)], "b": "x", "c": None}) == {
        "a": [1.5, None, [None, 2]],
        "b": "x",
        "c": None,
    }


def test_a_pool_shows_how_far_it_is():
    shown = []
    with Pool(1, shown.append) as pool:
        tasks = {Run("s", "a", str(number), None): number for number in range(3)}
        assert dict(pool.work(lambda task: task + 1, tasks, "counting")) == {
            run: task + 1 for run, task in tasks.items()
        }
    assert shown == ["counting 1/3", "counting 2/3", "counting 3/3", ""]
