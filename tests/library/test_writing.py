"""Files are written whole, under names that nobody foresees, and nothing else is touched."""

import os
import stat
import sys
from pathlib import Path

import pytest

from alignscores.writing import write_whole

if sys.platform == "win32":
    pytest.skip("modes, links and pipes of POSIX", allow_module_level=True)


def modes(folder):
    return {path.name: stat.S_IMODE(path.lstat().st_mode) for path in folder.iterdir()}


def test_a_file_keeps_its_mode_and_a_new_one_has_the_usual_one(tmp_path):
    path = tmp_path / "old.csv"
    path.write_text("old")
    for mode in (0o600, 0o640, 0o644, 0o444, 0o666):
        path.chmod(mode)
        write_whole(path, b"new")
        assert path.read_bytes() == b"new"
        assert modes(tmp_path) == {"old.csv": mode}
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "a.csv", b"new")
    finally:
        os.umask(before)
    assert modes(tmp_path)["a.csv"] == 0o640


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo])
def test_what_is_no_file_is_left_alone(tmp_path, make):
    make(tmp_path / "a.csv")
    with pytest.raises(ValueError, match="it is a folder, a pipe or a device, not a file"):
        write_whole(tmp_path / "a.csv", b"1")
    assert not (tmp_path / "a.csv").is_file()
    assert set(modes(tmp_path)) == {"a.csv"}


@pytest.mark.parametrize(
    ("name", "reason"),
    [("pipe", "it is a folder, a pipe or a device"), ("x" * 252, "File name too long")],
)
def test_the_command_says_so_in_one_line(run, tmp_path, name, reason):
    path = tmp_path / f"{name}.csv"
    if name == "pipe":
        os.mkfifo(path)
    code, _, err = run("tum", "tum/reference.txt", "tum/estimate.txt", "--save_errors", path)
    assert (code, err.count("\n")) == (1, 1)
    assert f"{path}: cannot be written ({reason}" in err
