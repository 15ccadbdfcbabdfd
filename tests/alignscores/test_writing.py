"""Files are written whole, under names that nobody foresees, and nothing else is touched."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from alignscores.writing import check_target, write_files, write_whole


def modes(folder):
    return {path.name: stat.S_IMODE(path.lstat().st_mode) for path in folder.iterdir()}


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o644, 0o444, 0o666])
def test_a_file_keeps_its_mode(tmp_path, mode):
    path = tmp_path / "a.csv"
    path.write_text("old")
    path.chmod(mode)
    write_whole(path, b"new")
    assert path.read_bytes() == b"new"
    assert modes(tmp_path) == {"a.csv": mode}


def test_a_new_file_has_the_usual_mode(tmp_path):
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "a.csv", b"new")
    finally:
        os.umask(before)
    assert modes(tmp_path) == {"a.csv": 0o640}


def test_a_secret_is_never_open_to_others(tmp_path, monkeypatch):
    path, seen = tmp_path / "a.csv", []
    path.touch(0o600)
    fdopen = os.fdopen

    def noted(descriptor, *arguments):
        seen.append(stat.S_IMODE(os.fstat(descriptor).st_mode))
        return fdopen(descriptor, *arguments)

    monkeypatch.setattr(os, "fdopen", noted)
    write_whole(path, b"new")
    assert seen == [0o600]


def test_a_link_is_replaced_and_its_target_stays(tmp_path):
    (tmp_path / "target").write_text("theirs")
    (tmp_path / "target").chmod(0o600)
    for name in ("there", "nowhere"):
        (tmp_path / name).symlink_to("target" if name == "there" else "none")
        write_whole(tmp_path / name, b"new")
        assert not (tmp_path / name).is_symlink()
        assert (tmp_path / name).read_bytes() == b"new"
    assert (tmp_path / "target").read_text() == "theirs"
    assert not (tmp_path / "none").exists()


def test_a_planted_name_is_not_followed(tmp_path, monkeypatch):
    """Where somebody guesses the temporary name after all."""
    (tmp_path / "target").write_text("theirs")
    monkeypatch.setattr("secrets.token_hex", lambda size: "0" * 2 * size)
    (tmp_path / f".{'0' * 16}.tmp").symlink_to("target")
    with pytest.raises(ValueError, match="File exists"):
        write_whole(tmp_path / "a.csv", b"new")
    assert (tmp_path / "target").read_text() == "theirs"
    assert set(modes(tmp_path)) == {"target", f".{'0' * 16}.tmp"}


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


def test_devices_and_long_names_are_refused(tmp_path):
    with pytest.raises(OSError, match="a pipe or a device"):
        check_target(Path(os.devnull))
    longest = tmp_path / f"{'x' * 251}.csv"
    write_whole(longest, b"")
    assert longest.exists()
    with pytest.raises(ValueError, match="File name too long"):
        write_whole(tmp_path / f"{'x' * 252}.csv", b"")


def test_processes_of_one_number_do_not_meet(tmp_path):
    """As in two containers that share a folder."""
    code = """
import os, sys
from pathlib import Path
from alignscores.writing import write_whole
os.getpid = lambda: 7
for _ in range(300):
    write_whole(Path(sys.argv[1]), sys.argv[2].encode() * 100_000)
"""
    path = tmp_path / "a"
    writers = [subprocess.Popen([sys.executable, "-c", code, path, letter]) for letter in "ab"]
    seen = set()
    while any(writer.poll() is None for writer in writers):
        if path.exists():
            seen.add(path.read_bytes())
    assert [writer.returncode for writer in writers] == [0, 0]
    assert seen <= {b"a" * 100_000, b"b" * 100_000}
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--save_errors", "{}/pipe.csv"], "pipe.csv cannot be written (it is a pipe or a device"),
        (["--save_errors", f"{{}}/{'x' * 252}.csv"], "cannot be written (File name too long)"),
        (["--save_errors", "{}/a.csv", "--profile", "{}/./a.csv"], "would both write"),
        (["--save_errors", "{}/a.csv", "--save_metrics", "{}/folder.csv/../a.csv"], "both write"),
        (["--save_page", f"{'y' * 300}/a.html"], "File name too long"),
    ],
)
def test_the_command_refuses_them_before_it_computes(run, tmp_path, monkeypatch, options, reason):
    def score(*arguments, **options):
        raise AssertionError

    monkeypatch.setattr("alignscores.cli.command.score", score)
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    options = [option.format(tmp_path) for option in options]
    code, out, err = run("tum", "tum/reference.txt", "tum/estimate.txt", *options)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert reason in err


def test_names_of_several_estimates_may_be_too_long(run, tmp_path):
    path = tmp_path / f"{'x' * 240}.txt"
    files = "tum/reference.txt", "tum/estimate.txt", "euroc/estimate.txt"
    code, out, err = run("tum", *files, "--save_aligned", path)
    assert (code, out) == (1, "")
    assert "File name too long" in err
