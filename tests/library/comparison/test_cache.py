"""Results that are stored with ``--cache FOLDER``: when one is used, and when it is computed."""

import json
import shutil
from functools import partial

import pytest

FILES = "tum", "gt.ref", "{system}.txt", "--jobs", 1


@pytest.fixture
def run(command, monkeypatch, tmp_path):
    """(arguments) -> as `command`, of ``compare`` without a cache."""
    monkeypatch.chdir(tmp_path)
    return partial(command, "compare")


@pytest.fixture
def files(examples, tmp_path):
    """A folder with a reference and two estimates."""
    shutil.copy(examples / "tum/reference.txt", tmp_path / "gt.ref")
    shutil.copy(examples / "tum/estimate.txt", tmp_path / "a.txt")
    lines = (examples / "tum/estimate.txt").read_text().splitlines()
    (tmp_path / "b.txt").write_text("\n".join([*lines, lines[-1]]))  # which takes a note
    return tmp_path


def test_results_are_taken_from_there_and_others_computed(files, run, compare):
    computed = run(*FILES, "--json")
    assert run(*FILES, "--json", "--cache", "cache") == computed
    assert run(*FILES, "--json", "--cache", "cache") == computed
    for path in (files / "cache").iterdir():
        stored = json.loads(path.read_text())
        if not stored["row"]["notes"]:  # a
            stored["row"]["unit"] = 7.0  # which tells where it is from
            path.write_text(json.dumps(stored))
        else:
            path.unlink()
    results = compare(*FILES, "--cache", "cache")["runs"]
    units = {result["system"]: result["unit"] for result in results}
    assert units["a"] == 7.0
    assert 0 < units["b"] < 1


def test_other_options_have_other_results(files, run):
    run(*FILES, "--cache", "cache")
    for options in (["--seed", "1"], ["--invert"], ["--metrics", "kitti"]):
        assert run(*FILES, *options, "--cache", "cache") == run(*FILES, *options)


def test_a_file_that_changed_has_a_new_result(files, run):
    shutil.copy(files / "gt.ref", files / "rgb")
    options = *FILES, "--frames", "rgb", "--json"
    run(*options, "--cache", "cache")
    for name in ("a.txt", "gt.ref", "rgb"):
        path = files / name
        path.write_text("\n".join(path.read_text().splitlines()[:-1]))
        assert run(*options, "--cache", "cache") == run(*options)


def test_a_folder_that_cannot_be_written_to_is_noted(files, run):
    code, out, err = run(*FILES, "--cache", "gt.ref")
    assert (code, err) == (0, "")
    assert out.count("is not stored in gt.ref: ") == 2  # one a system


def with_entry(part, key, value):
    """(text) -> the text of a stored result with another entry."""

    def changed(text):
        stored = json.loads(text)
        stored[part][key] = value
        return json.dumps(stored)

    return changed


DAMAGES = {
    "cut": lambda text: text[:1],
    "a list": lambda text: "[1, 2]",
    "empty": lambda text: "{}",
    "unit": with_entry("row", "unit", "abc"),
    "n": with_entry("row", "n", "abc"),
    "a list of scores": with_entry("row", "TAS", [1]),
    "a score in words": with_entry("row", "TAS", "0.5"),
    "nothing lost": with_entry("row", "lost", None),
    "status": with_entry("row", "status", "x"),
    "times": with_entry("errors", "time", "0"),
    "one frame": with_entry("errors", "covered", [1]),
}


def test_what_a_damaged_file_holds_is_computed_again(files, run):
    (files / "b.txt").unlink()
    computed = run(*FILES, "--json", "--cache", "cache")
    for name, damage in DAMAGES.items():
        (path,) = (files / "cache").iterdir()
        path.write_text(damage(path.read_text()))
        assert run(*FILES, "--json", "--cache", "cache") == computed, name
