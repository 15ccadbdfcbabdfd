"""The whole command on made benchmarks whose truth is known."""

import json
import os
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import compare as library_compare
from tests.files import write_stamped

SYSTEMS = {  # sigma_t, sigma_r in degrees, every so many frames, share lost at the end
    "best": (0.1, 1.0, 1, 0.0),
    "sparse": (0.25, 2.5, 3, 0.0),
    "loses_track": (0.1, 1.0, 1, 0.6),
}
SYSTEM = {"a": (0.1, 1.0, 1, 0.0)}


def test_the_table_tells_the_truth_that_was_put_in(benchmark_of, compare, tmp_path):
    patterns = benchmark_of(SYSTEMS, sequences=("car", "helix", "cube"), runs=3, n=100)
    (tmp_path / "car/best/2.txt").unlink()
    compared = compare(*patterns)
    results = {(row["sequence"], row["system"], row["run"]): row for row in compared["runs"]}
    entries = {(row["system"], row["sequence"]): row for row in compared["summary"]}
    assert len(results) == 3 * 3 * 3
    gone = results["car", "best", "2"]
    assert (gone["status"], gone["PAS"], gone["half_angle"]) == ("missing", 0, None)
    assert results["car", "loses_track", "0"]["lost"] == 0.5  # half a gap is covered
    car = [results["car", "sparse", str(number)]["PAS"] for number in range(3)]
    assert entries["sparse", "car"]["PAS"] == pytest.approx(np.mean(car))
    assert entries["sparse", "car"]["PAS_sd"] == pytest.approx(np.std(car, ddof=1))
    assert entries["sparse", None]["PAS"] == pytest.approx(
        np.mean([entries["sparse", name]["PAS"] for name in ("car", "helix", "cube")])
    )
    assert (entries["best", None]["runs"], entries["best", None]["failed"]) == (9, 1)
    assert entries["best", None]["rank_best"] == 1
    pair = next(
        row
        for row in compared["pairs"]
        if {row["a"], row["b"]} == {"best", "sparse"} and row["sequence"] is None
    )
    assert pair["low"] < pair["difference"] < pair["high"]
    assert (pair["better"], pair["method"]) == ("best", "permutation within sequences")


@pytest.mark.parametrize("copied", ["3", "latest"])
def test_a_copy_counts_for_nothing(benchmark_of, compare, tmp_path, copied):
    """Nor is a run of its name missing on another sequence, where one is missing as before."""
    patterns = benchmark_of(SYSTEM, runs=3, n=60)
    (tmp_path / "helix/a/1.txt").unlink()
    before = compare(*patterns)
    text = (tmp_path / "car/a/2.txt").read_text()
    (tmp_path / f"car/a/{copied}.txt").write_text(f"# the same run\n{text}")
    after = compare(*patterns)
    rows = {(row["sequence"], row["run"]): row["status"] for row in after["runs"]}
    assert rows.pop(("car", copied)) == "copy"
    assert rows == {(row["sequence"], row["run"]): row["status"] for row in before["runs"]}
    assert (rows["helix", "1"], len(rows)) == ("missing", 6)
    assert after["summary"] == before["summary"]
    # A number of runs that is asked for stays.
    lines = dict(zip(("format", "reference", "estimate"), map(repr, patterns), strict=True))
    text = "".join(f"{key}: {value}\n" for key, value in [*lines.items(), ("runs", 4)])
    (tmp_path / "four.yaml").write_text(text)
    statuses = [(row["sequence"], row["status"]) for row in compare("four.yaml")["runs"]]
    assert statuses.count(("helix", "missing")) == 2
    assert statuses.count(("car", "missing")) == 0


def test_processes_do_not_matter(benchmark_of, run, tmp_path):
    """Nor does it if a reference was read before: its notes are printed each time."""
    patterns = benchmark_of(SYSTEM, ["car"], runs=2)
    reference = tmp_path / "car/gt.txt"
    reference.write_text(reference.read_text() + reference.read_text().splitlines()[-1])
    printed = run(*patterns, "--json", "--jobs", 1)
    assert printed == run(*patterns, "--json", "--jobs", 2)
    note = "car: duplicate stamps or names in the reference, left out: 1"
    assert note in json.loads(printed[1])["notes"]


def test_processes_that_are_kept_work_in_the_current_folder(
    benchmark_of, run, tmp_path, monkeypatch
):
    """Relative paths are those of now, also where processes of an earlier comparison go on."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0), "b": (0.2, 2.0, 1, 0.0)}, runs=5, n=40)
    printed = run(*patterns, "--json", "--jobs", 2)
    moved = tmp_path / "moved"
    moved.mkdir()
    for sequence in ("car", "helix"):
        (tmp_path / sequence).rename(moved / sequence)
    monkeypatch.chdir(moved)
    assert run(*patterns, "--json", "--jobs", 2) == printed


def test_hints_count_first_runs_the_only_checked_ones(benchmark_of, compare, tmp_path):
    """The clock of all runs on one of two sequences is off."""
    patterns = benchmark_of(SYSTEM, runs=2)
    for number in range(2):
        file = tmp_path / f"car/a/{number}.txt"
        stamped = [line.split(maxsplit=1) for line in file.read_text().splitlines()]
        file.write_text("".join(f"{float(t) + 2.4:.3f} {pose}\n" for t, pose in stamped))
    compared = compare(*patterns, "--jobs", 1)
    (note,) = (note for note in compared["notes"] if "clock" in note)
    assert note.startswith("car, a, run 0: its clock is off")
    assert note.endswith(" (in the first run of 1 of 2 sequences; further runs are not checked)")
    assert [bool(run["hints"]) for run in compared["runs"]] == [True, False, False, False]


def test_advice_for_one_system_is_its_entry_in_a_yaml_file(benchmark_of, compare, tmp_path):
    """An option would spoil the other systems, unless all of them need it."""
    patterns = benchmark_of({**SYSTEM, "b": (0.2, 1.0, 1, 0.0)}, ["car"], runs=1)

    def hints(*arguments):
        return [note for note in compare(*arguments)["notes"] if "world-to-camera" in note]

    _invert(tmp_path / "car/a/0.txt")
    (note,) = hints(*patterns)
    assert note.endswith("; systems: a: {invert: true} in a YAML file corrects it")
    keys = zip(("format", "reference", "estimate"), map(repr, patterns), strict=True)
    lines = [*(f"{key}: {value}" for key, value in keys), "systems: {a: {invert: true}}"]
    (tmp_path / "one.yaml").write_text("\n".join(lines))
    compared = compare("one.yaml")
    assert min(run["PAS"] for run in compared["runs"]) > 0.5
    # The option is for all; an entry takes it back.
    (note,) = (note for note in compare(*patterns, "--est_invert")["notes"] if "invert" in note)
    assert "; write systems: b: {invert: false} in a YAML file" in note
    lines[-1] = "systems: {b: {invert: false}}"
    (tmp_path / "other.yaml").write_text("\n".join(lines))
    assert compare("other.yaml", "--est_invert")["summary"] == compared["summary"]
    _invert(tmp_path / "car/b/0.txt")
    assert ["; --est_invert corrects it" in note for note in hints(*patterns)] == [True] * 2


def _invert(file):
    """Write the inverse poses of a file in its place."""
    rows = np.loadtxt(file)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = Rotation.from_quat(rows[:, 4:]).as_matrix(), rows[:, 1:4]
    write_stamped(file, rows[:, 0], np.linalg.inv(poses))


def test_wrong_files_are_a_line_each_and_the_rest_is_compared(
    benchmark_of, run, tmp_path, monkeypatch
):
    patterns = benchmark_of({**SYSTEM, "b": (0.3, 1.0, 1, 0.0)}, runs=3)
    (tmp_path / "car/a/0.txt").write_text("")
    (tmp_path / "car/b/1.txt").write_text("this is no trajectory\n")
    if hasattr(os, "mkfifo"):  # a pipe that nobody writes to
        (tmp_path / "car/b/1.txt").unlink()
        os.mkfifo(tmp_path / "car/b/1.txt")
    (tmp_path / "car/b/2.txt").write_bytes(b"\xff")
    (tmp_path / "helix/a/1.txt").unlink()
    (tmp_path / "new/c").mkdir(parents=True)
    (tmp_path / "new/c/0.txt").write_text("0 0 0 0 0 0 0 1\n")
    code, out, err = run(*patterns, "--json", "--jobs", 1)
    assert code == 1
    starts = ["sequence new: has no reference", "system c: has no run on a sequence with"]
    starts += ["car/a/0.txt: ", "car/b/1.txt", "car/b/2.txt, line 1: is not text"]
    starts += ["a: has no run 1 on helix; it counts as a failure"]
    for line, start in zip(err.splitlines(), starts, strict=True):
        assert line.startswith(f"alignscores: error: {start}")
    status = [entry["status"] for entry in json.loads(out)["runs"]]
    assert (status.count("scored"), status.count("failed"), status.count("missing")) == (8, 3, 1)


def test_columns_of_a_reference_are_named_by_its_own_option(benchmark_of, run, tmp_path):
    """The estimates have others."""
    _, reference, estimate = benchmark_of(SYSTEM, ["car"], runs=1)
    path = tmp_path / "car/gt.txt"
    rows = [line.split() for line in path.read_text().splitlines()]
    lines = [",".join([f"{float(t) * 1e6}", f"{float(t) * 1e9}", *pose]) for t, *pose in rows]
    path.write_text("\n".join(["t_us,t_ns,x,y,z,qx,qy,qz,qw", *lines]))
    code, _, err = run(reference, estimate)
    assert code == 1
    assert "its header names 2 clocks; choose one by --ref_columns 't_us - x y z qx qy" in err
    code, out, _ = run(reference, estimate, "--ref_columns", "t_us - x y z qx qy qz qw", "--json")
    assert code == 0
    assert {entry["status"] for entry in json.loads(out)["runs"]} == {"scored"}


@pytest.mark.parametrize(
    ("option", "reason"),
    [
        (("--t_start", 5), "no reference pose is expected with t_start 5.000000 s"),
        (("--t_start", 3.75), "2 of the reference's poses are expected; at least 4 are needed"),
        (("--frames", "frames.txt"), "no expected frame has a reference pose"),
    ],
)
def test_a_sequence_that_an_option_empties_is_left_out(
    benchmark_of, run, tmp_path, monkeypatch, option, reason
):
    """It is no failure of the systems."""
    monkeypatch.chdir(tmp_path)
    patterns = benchmark_of({**SYSTEM, "b": (0.3, 1.0, 1, 0.0)}, ["car"], runs=1, n=100)
    benchmark_of({**SYSTEM, "b": (0.3, 1.0, 1, 0.0)}, ["helix"], runs=1, n=40)
    (tmp_path / "frames.txt").write_text("".join(f"{t}\n" for t in range(5, 10)))
    code, out, err = run(*patterns, *option, "--json")
    compared = json.loads(out)
    assert code == 1
    assert err.startswith("alignscores: error: sequence helix: left out: ")
    assert reason in err
    assert {(entry["sequence"], entry["status"]) for entry in compared["runs"]} == {
        ("car", "scored")
    }
    assert compared["verdict"][-1] == "Left out: 1 of 2 sequences (helix); the errors say why."


def test_a_pair_names_the_sequences_that_it_has_no_runs_on(benchmark_of, compare, tmp_path):
    patterns = benchmark_of({**SYSTEM, "b": (0.3, 1.0, 1, 0.0)}, runs=5, n=40)
    for file in tmp_path.glob("helix/b/*.txt"):
        file.unlink()
    assert "of the run pairs on 1 of 2 sequences (" in compare(*patterns)["verdict"][0]


def test_the_ate_has_a_column_if_it_is_asked_for(benchmark_of, run_compare):
    patterns = benchmark_of({"a": (0.02, 1.0, 1, 0.0), "b": (0.1, 1.0, 1, 0.0)}, ["car"], n=40)
    for arguments, shown in (((), False), (("--metrics", "ate"), True)):
        header = next(
            line for line in run_compare(*patterns, *arguments)[1].splitlines() if "TAS" in line
        )
        assert ("ATE [m]" in header) == shown


def test_a_distance_that_no_run_is_given_is_no_failure(benchmark_of, compare, tmp_path):
    """Four cameras have none; nor has a run there that fails."""
    systems = {"a": (0.02, 1.0, 1, 0.0), "b": (0.1, 1.0, 1, 0.0)}
    patterns = benchmark_of(systems, ["car"], n=40)
    benchmark_of(systems, ["helix"], n=4)
    (tmp_path / "helix/a/1.txt").write_text("")
    entries = {(row["system"], row["sequence"]): row for row in compare(*patterns)["summary"]}
    assert entries["a", "helix"]["half_distance"] is None
    of_car = entries["a", "car"]["half_distance"]
    assert entries["a", None]["half_distance"] == of_car > 0
    assert entries["a", "helix"]["PAS"] == pytest.approx(
        2 / 3 * entries["a", "helix"]["PAS_scored"]
    )


def test_time_that_no_run_of_a_sequence_covers_is_one_note(
    benchmark_of, compare, tmp_path, monkeypatch
):
    """On one no run has the last 4 s, on the other a single one does."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.5), "b": (0.1, 1.0, 1, 0.5)}, n=100)
    benchmark_of({"b": (0.1, 1.0, 1, 0.0)}, ["car"], runs=1, n=100)
    monkeypatch.chdir(tmp_path)
    notes = library_compare(*patterns[1:], format="tum").notes
    (note,) = (note for note in notes if "no estimate covers" in note)
    assert note.startswith("helix: no estimate covers the last 4.0 s of the reference; they")
    entry = re.search("sequences: (helix): t_end: ([0-9.]+) in a YAML file", note)
    assert entry, note
    (tmp_path / "benchmark.yaml").write_text(
        "format: tum\nreference: '{sequence}/gt.txt'\nestimate: '{sequence}/{system}/{run}.txt'\n"
        f"sequences: {{ {entry[1]}: {{ t_end: {entry[2]} }} }}\n"
    )
    assert not any("no estimate covers" in note for note in compare("benchmark.yaml")["notes"])
    notes = library_compare(*patterns[1:], format="tum", missing="ignore").notes
    assert not any("no estimate covers" in note for note in notes)
