"""The files that are written."""

import csv
import shutil
from collections import Counter

import numpy as np
import pytest

from alignscores.io import read_kitti, read_tum
from tests.files import AT_STAMPS, COLMAP, KITTI, TUM


def test_save_errors_has_every_expected_frame(run, tum, tmp_path, write):
    """And no other one of a denser reference; a status says why an error is missing or infinite."""
    files = "tum", tum(391, 100, "gt.txt"), tum(40, 10, "est.txt", lost=(10, 25)), "--max_gap", 0
    frames = write([str(i / 10) for i in (*range(12), 90)], "frames.txt")
    for options, expected in (
        (["--missing", "ignore"], {"matched": 25, "left out": 15}),
        (["--missing", "fail"], {"matched": 25, "lost": 15}),
        (["--frames", frames], {"matched": 10, "lost": 2, "no reference pose": 1}),
    ):
        assert run(*files, *options, "--save_errors", tmp_path / "e.csv")[0] == 0
        with (tmp_path / "e.csv").open() as file:
            rows = list(csv.DictReader(file))
        assert Counter(row["status"] for row in rows) == expected
        errors = {row["status"]: row["position_error"] for row in rows}
        assert errors.get("lost", "inf") == "inf"
        assert errors.get("left out", "") == errors.get("no reference pose", "") == ""


@pytest.mark.parametrize(("files", "read"), [(TUM, read_tum), (KITTI, read_kitti)])
def test_an_aligned_trajectory_has_the_errors_that_are_saved(
    run, score, tmp_path, examples, files, read
):
    path = tmp_path / "aligned.txt"
    options = () if files is KITTI else ("--missing", "ignore", *AT_STAMPS)
    saved = "--save_aligned", path, "--save_errors", tmp_path / "e.csv"
    assert run(*files, *options, *saved)[0] == 0
    aligned, estimate = read(path), read(examples / files[2])
    np.testing.assert_array_equal(aligned.keys, estimate.keys)
    with (tmp_path / "e.csv").open() as file:
        errors = {row["camera"]: row["position_error"] for row in csv.DictReader(file)}
    reference = read(examples / files[1])
    for key, pose in zip(reference.keys.tolist(), reference.poses, strict=True):
        row = np.argmin(np.abs(aligned.keys - key))
        error = np.linalg.norm(aligned.poses[row, :3, 3] - pose[:3, 3])
        if np.isfinite(error) and errors[str(key)]:
            assert error == pytest.approx(float(errors[str(key)]), abs=1e-6)
    (before,), (after,) = score(*files), score(*files[:2], path)
    assert after["RAS"] == pytest.approx(before["RAS"], abs=1e-9)
    assert after["TAS"] == pytest.approx(before["TAS"], abs=0.02)
    assert run(*files, files[2], "--save_aligned", path)[0] == 0
    assert {file.name for file in tmp_path.glob("aligned_*")} == {
        "aligned_estimate.txt",
        "aligned_estimate (2).txt",
    }


def test_each_estimate_keeps_its_name_in_its_file(run, tmp_path, examples):
    for name in ("v1.1", "v1.2"):
        shutil.copy(examples / TUM[2], tmp_path / name)
    files = TUM[1], tmp_path / "v1.1", tmp_path / "v1.2"
    assert run("tum", *files, "--save_aligned", tmp_path / "aligned.txt")[0] == 0
    assert {file.name for file in tmp_path.glob("aligned_*")} == {
        "aligned_v1.1.txt",
        "aligned_v1.2.txt",
    }


def test_what_was_not_aligned_is_not_saved(run, tmp_path, write, lines):
    fields = [line.split() for line in lines]
    standing = [" ".join([stamp, "1 2 3", *rotation]) for stamp, _, _, _, *rotation in fields]
    path = tmp_path / "aligned.txt"
    code, out, err = run(*TUM[:2], write(standing), "--save_aligned", path)
    assert code == 1
    assert f"error: {path}: is not written, since est.txt could not be aligned\n" in err
    assert out.startswith("estimate ")
    assert not path.exists()


def test_a_folder_has_every_result(run, tmp_path):
    """It is created, and has every result; of several estimates each has an aligned file."""
    folder = tmp_path / "results"
    command = *TUM, TUM[1], "--frames", TUM[1]
    assert run(*command, "-o", folder)[0] == 0
    names = ["scores.json", "errors.csv", "scores.csv", "scores.md", "scores.tex"]
    names += ["plot.png", "page.html"]
    names += ["aligned_estimate.txt", "aligned_reference.txt"]
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)
    for name in ("json", "csv", "latex"):  # what they print instead of the table
        printed = run(*command, f"--{name}")[1]
        assert printed == (folder / f"scores.{name.replace('la', '')}").read_text()
    assert run(*COLMAP, "-o", folder)[0] == 0  # again, and in a format without aligned files


def test_a_plot_is_saved_as_the_name_says(run, tmp_path):
    path = tmp_path / "plot.pdf"
    assert run(*KITTI, "--save_plot", path)[0] == 0
    assert path.read_bytes().startswith(b"%PDF")
    assert list(tmp_path.iterdir()) == [path]


def test_plot_needs_a_display(run):
    code, out, err = run(*TUM, "--plot")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "no display" in err
