"""Results that are stored with ``--cache FOLDER``: when one is used, and when it is computed."""

import json
import os
import shutil

import pytest

FILES = "tum", "gt.ref", "{system}.txt", "--jobs", 1


@pytest.fixture
def files(examples, tmp_path):
    """A folder with a reference and two estimates."""
    shutil.copy(examples / "tum/reference.txt", tmp_path / "gt.ref")
    shutil.copy(examples / "tum/estimate.txt", tmp_path / "a.txt")
    lines = (examples / "tum/estimate.txt").read_text().splitlines()
    (tmp_path / "b.txt").write_text("\n".join([*lines, lines[-1]]))  # which takes a note
    return tmp_path


def entries(folder):
    return {path.name: path.stat().st_mtime_ns for path in (folder / "cache").iterdir()}


def test_a_further_comparison_takes_all_results_from_there(files, run):
    computed = run(*FILES, "--json")
    assert run(*FILES, "--json", "--cache", "cache") == computed
    before = entries(files)
    assert len(before) == 2
    assert run(*FILES, "--json", "--cache", "cache") == computed
    assert entries(files) == before


def test_nothing_is_stored_without_the_option(files, run, monkeypatch):
    home = files / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    assert run(*FILES)[0] == 0
    assert list(home.iterdir()) == []


def test_interrupted_work_resumes(files, run, compare):
    """What is stored is taken, and the rest is computed."""
    run(*FILES, "--cache", "cache")
    for path in (files / "cache").iterdir():
        stored = json.loads(path.read_text())
        if stored["estimate"] == "a.txt":
            path.write_text(json.dumps({**stored, "unit": 7.0}))  # which tells where it is from
        else:
            path.unlink()
    results = compare(*FILES, "--cache", "cache")["results"]
    units = {result["system"]: result["unit"] for result in results}
    assert units["a"] == 7.0
    assert 0 < units["b"] < 1
    assert len(entries(files)) == 2


def test_files_of_the_same_content_share_a_result(files, run, compare):
    """Whose notes name the file that was asked for."""
    run(*FILES, "--cache", "cache")
    before = entries(files)
    (files / "b.txt").rename(files / "c.txt")
    (files / "gt.ref").rename(files / "other.ref")
    code, out, err = run("tum", "other.ref", "{system}.txt", "--json", "--cache", "cache")
    assert code == 0
    assert {result["system"] for result in json.loads(out)["results"]} == {"a", "c"}
    assert entries(files) == before
    assert "b.txt" not in out + err


@pytest.mark.parametrize(
    "options",
    [
        *(["--weight", "0.3"], ["--seed", "1"], ["--invert"], ["--metrics", "kitti"]),
        *(["--frames", "gt.ref"], ["--unit", "0.5"]),
    ],
)
def test_other_options_have_results_of_their_own(files, run, options):
    run(*FILES, "--cache", "cache")
    before = entries(files)
    code, out, err = run(*FILES, *options, "--json", "--cache", "cache")
    assert (code, out, err) == run(*FILES, *options, "--json")
    assert len(entries(files)) == 4
    assert before.items() <= entries(files).items()


@pytest.mark.parametrize(("name", "new"), [("a.txt", 1), ("gt.ref", 2), ("rgb", 2)])
def test_a_file_that_changed_has_a_new_result(files, run, name, new):
    shutil.copy(files / "gt.ref", files / "rgb")
    options = *FILES, "--frames", "rgb", "--json"
    run(*options, "--cache", "cache")
    path = files / name
    path.write_text("\n".join(path.read_text().splitlines()[:-1]))
    assert run(*options, "--cache", "cache") == run(*options)
    assert len(entries(files)) == 2 + new


def test_a_model_that_changed_has_a_new_result(examples, tmp_path, run):
    for name in ("reference", "estimate"):
        shutil.copytree(examples / "colmap" / name, tmp_path / name)
    patterns = "colmap", "reference", "{system}mate", "--json"
    run(*patterns, "--cache", "cache")
    images = tmp_path / "estimate/images.bin"
    images.write_bytes(images.read_bytes().replace(b"0003.png", b"0099.png"))
    assert run(*patterns, "--cache", "cache") == run(*patterns)
    assert len(entries(tmp_path)) == 2


@pytest.mark.parametrize("content", [b"", b"{", b"[1, 2]", b"{}", b"\xff", b"null", b"[" * 10**5])
def test_what_cannot_be_read_is_computed_again(files, run, content):
    expected = run(*FILES, "--json", "--cache", "cache")
    whole = {path: path.read_bytes() for path in (files / "cache").iterdir()}
    for path in whole:
        path.write_bytes(content or whole[path][:-100])
    assert run(*FILES, "--json", "--cache", "cache") == expected
    assert {path: path.read_bytes() for path in whole} == whole


@pytest.mark.parametrize("folder", ["gt.ref", os.devnull])
def test_a_folder_that_cannot_be_written_to_is_noted(files, run, folder):
    code, out, err = run(*FILES, "--cache", folder)
    assert (code, out) == run(*FILES)[:2]
    notes = [line for line in err.splitlines() if f"is not stored in {folder}: " in line]
    assert len(notes) == 2  # one a system
