"""Files are written whole, under names that nobody foresees, and nothing else is touched."""

import os
import stat
import sys
from pathlib import Path

import pytest

from alignscores.writing import write_files, write_whole

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


OBSTACLES = {
    "folder": (Path.mkdir, "Is a directory"),
    "pipe": (os.mkfifo, "it is a pipe or a device"),
}


@pytest.mark.parametrize("kind", OBSTACLES)
def test_what_is_no_file_is_left_alone(tmp_path, kind):
    make, reason = OBSTACLES[kind]
    make(tmp_path / "b.csv")
    files = {tmp_path / "a.csv": b"1", tmp_path / "b.csv": b"2"}
    with pytest.raises(OSError, match=reason) as caught:
        write_files(files)
    assert caught.value.filename == str(tmp_path / "b.csv")
    assert set(modes(tmp_path)) == {"b.csv"}  # the other is not written, either


@pytest.mark.parametrize(
    ("name", "reason"),
    [("pipe", "it is a pipe or a device"), ("x" * 252, "File name too long")],
)
def test_the_command_says_so_in_one_line(run, tmp_path, name, reason):
    path = tmp_path / f"{name}.csv"
    if name == "pipe":
        os.mkfifo(path)
    code, _, err = run("tum", "tum/reference.txt", "tum/estimate.txt", "--save_errors", path)
    assert (code, err.count("\n")) == (1, 1)
    assert f"{path}: cannot be written ({reason}" in err
