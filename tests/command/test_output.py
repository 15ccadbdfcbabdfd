"""The table, the JSON and the notes."""

import json
import re
import shutil
import sys

import numpy as np
import pytest

from tests.files import AT_STAMPS, TUM

PAPER = "--registration", "pcr99"
HEADER = ["TAS", "RAS", "PAS", "half [m]", "half [deg]", "median [m]", "median [deg]", "ATE [m]"]
HEADER += ["coverage"]


def columns(line):
    return [cell.strip() for cell in line.split("  ") if cell.strip()]


@pytest.mark.parametrize("options", [[], PAPER, [*AT_STAMPS, "--missing", "ignore"]])
def test_the_table_has_the_same_columns_whatever_the_options(run, score, options):
    header, row, conditions, scale = run(*TUM, *options)[1].splitlines()
    (result,) = score(*TUM, *options)
    assert columns(header) == ["estimate", *HEADER]
    values = dict(zip(HEADER, columns(row)[1:], strict=True))
    assert values["TAS"] == f"{result['TAS']:.3f}"
    assert values["half [m]"] == f"{result['half_distance']:#.3g}"
    assert values["coverage"] == f"{1 - result['lost']:.1%}"
    assert f"d = {result['unit']:.3g} m" in conditions
    registration = "pcr99, mean over seeds 0 to 9" if options == PAPER else "refined"
    assert scale.startswith("scale: estimate.txt is 0.")
    assert conditions.startswith(f"alignment: similarity ({registration}); 40 frames at 10 Hz, ")


def test_the_median_is_that_of_the_frames_with_a_pose(run, tmp_path):
    saved = "--save_errors", tmp_path / "errors.csv"
    row = columns(run(*TUM, *AT_STAMPS, *saved)[1].splitlines()[1])
    lines = (tmp_path / "errors.csv").read_text().splitlines()[1:]
    errors = np.array([[float(value) for value in line.split(",")[2:4]] for line in lines])
    medians = np.median(errors[np.isfinite(errors[:, 0])], axis=0)
    assert row[6:8] == [f"{median:#.3g}" for median in medians]


def test_verbose_explains_each_column(run):
    plain, verbose = run(*TUM)[1], run(*TUM, "-v")[1]
    assert verbose.startswith(plain)
    lost, terms = verbose.removeprefix(plain).strip().split("\n\n")
    words = re.findall(r"^\w+", terms, re.MULTILINE)
    assert words == ["TAS", "half", "median", "ATE", "coverage", "d", "refined", "cost"]
    rows = [columns(line) for line in lost.splitlines()]
    assert rows[0] == [
        *("estimate", "score", "from [s]", "to [s]", "frames", "cause", "cost"),
        "share of 1 - score",
    ]
    assert {row[1] for row in rows[1:]} == {"TAS", "RAS"}


@pytest.mark.parametrize(("width", "n_columns"), [(100, 9), (80, 7), (40, 4)])
def test_a_narrow_terminal_loses_columns_from_the_right_but_coverage(
    run, monkeypatch, width, n_columns
):
    monkeypatch.setenv("COLUMNS", str(width))
    header, row, *below = run(*TUM)[1].splitlines()
    assert columns(header)[1:] == [*HEADER[: n_columns - 1], "coverage"]
    assert max(len(header), len(row)) <= max(width, 44)
    assert (f"too narrow for: {', '.join(HEADER[n_columns - 1 : -1])}" in below) == (n_columns < 9)


def test_long_names_are_cut(run, lines, write):
    file = write(lines, f"a{'x' * 80}b.txt")
    name = run(*TUM[:2], file)[1].splitlines()[1].split()[0]
    assert (len(name), name[0], name[-5:]) == (27, "a", "b.txt")


def test_the_table_is_in_the_order_of_the_files(run, score, lines, write):
    fields = [line.split() for line in lines]
    worse = [" ".join([cells[0], "0 0 0", *cells[4:]]) for cells in fields[:19]]
    files = write(worse + lines[19:], "worse.txt"), "tum/estimate.txt", TUM[1]
    names = ["worse.txt", "estimate.txt", "reference.txt"]
    assert [result["name"] for result in score(*TUM[:2], *files)] == names
    assert [line.split()[0] for line in run(*TUM[:2], *files)[1].splitlines()[1:4]] == names


def test_names_have_as_many_parts_as_make_them_unique(score, examples, tmp_path):
    files = [tmp_path / name for name in ("orb/0.txt", "dso/0.txt", "dso/1.txt")]
    for file in files:
        file.parent.mkdir(exist_ok=True)
        shutil.copy(examples / TUM[2], file)
    names = [result["name"] for result in score(*TUM[:2], *files)]
    assert names == ["orb/0.txt", "dso/0.txt", "dso/1.txt"]


def test_a_result_is_the_same_alone_and_next_to_others(score):
    (single,) = score(*TUM)
    assert score(*TUM, TUM[1])[0] == single


def test_a_bad_estimate_does_not_stop_the_others(run, tmp_path, write):
    bad, none = write("1 2", "bad.txt"), tmp_path / "none.txt"
    code, out, err = run(*TUM[:2], bad, TUM[2], none, "--json")
    assert code == 1
    printed = json.loads(out)
    assert [result["name"] for result in printed["results"]] == ["estimate.txt"]
    assert [entry["file"] for entry in printed["failed"]] == [str(bad), str(none)]
    errors = [entry["error"] for entry in printed["failed"]]
    assert "line 1: has 2 columns" in errors[0]
    assert "No such file" in errors[1]
    assert err.splitlines() == [f"alignscores: error: {error}" for error in errors]


def test_json_names_a_reference_that_cannot_be_read(run, tmp_path):
    for files in ("none.txt", TUM[2]), (TUM[1], TUM[2], "--frames", "none.txt"):
        code, out, err = run("tum", *files, "--json", "--save_json", tmp_path / "a.json")
        printed = json.loads(out)
        assert json.loads((tmp_path / "a.json").read_text()) == printed
        (failed,) = printed["failed"]
        assert (code, printed["results"], failed["file"]) == (1, [], "none.txt")
        assert err == f"alignscores: error: {failed['error']}\n"


def test_similar_notes_share_a_line(run, lines, write):
    """As of estimates of one system with its clock off."""
    stamped = [line.split(maxsplit=1) for line in lines]
    shifted = [f"{float(stamp) + 0.35:.3f} {pose}" for stamp, pose in stamped]
    files = [write(shifted, f"est{number}.txt") for number in range(3)]
    notes = run(*TUM[:2], *files)[2].splitlines()
    assert any("est0.txt: its clock is off" in note for note in notes)
    assert all(note.endswith("(and 2 more like it)") for note in notes)
    assert not any("est1.txt: " in note for note in notes)
    notes = run(*TUM[:2], *files[:2])[2].splitlines()
    assert all(note.endswith("(and one like it for est1.txt)") for note in notes)


def test_progress_is_for_a_terminal_and_leaves_nothing_there(run, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    err = run(*TUM, "tum/none.txt")[2]
    assert "\r\x1b[K1/2 estimate.txt " in err
    assert "\r\x1b[K2/2 none.txt " in err
    left = [line.rpartition("\r\x1b[K")[2] for line in err.split("\n")]
    assert all(line.startswith("alignscores: ") or not line for line in left)
