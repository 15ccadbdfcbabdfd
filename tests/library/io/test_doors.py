"""Files that never end, are no files, or are too large end in one sentence, without a hang."""

import os
import subprocess
import sys
import threading
import tracemalloc

import numpy as np
import pytest

from alignscores import evaluate, files
from alignscores.io import FileError, read_arrays, read_tum, recognise
from alignscores.yaml_files import load_yaml

POSE = "0 1 2 3 0 0 0 1\n"


@pytest.fixture
def link(tmp_path):
    """A link to itself."""
    (tmp_path / "link").symlink_to(tmp_path / "link")
    return tmp_path / "link"


@pytest.fixture
def pipe(tmp_path):
    """(content) -> a named pipe into which a thread writes the content, in small parts."""
    threads = []

    def pipe(content, name="pipe"):
        os.mkfifo(tmp_path / name)

        def feed():
            with (tmp_path / name).open("wb") as file:
                for start in range(0, len(content), 1000):
                    file.write(content[start : start + 1000])

        threads.append(threading.Thread(target=feed))
        threads[-1].start()
        return tmp_path / name

    yield pipe
    for thread in threads:
        thread.join()


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", "/dev/tty"])
def test_a_device_is_no_file(path):
    for read in (read_tum, recognise, read_arrays):
        with pytest.raises(FileError, match=f"{path}: is a device, not a file"):
            read(path)


def test_a_link_to_itself_is_a_sentence(link, examples, command):
    with pytest.raises(FileError, match="link: cannot be read"):
        read_tum(link)
    code, out, err = command("tum", examples / "tum/reference.txt", link)
    assert (code, out) == (1, "")
    assert err.startswith(f"alignscores: error: {link}: cannot be read (")
    with pytest.raises(ValueError, match="cannot be read"):
        load_yaml(link)


def test_pipes_are_read_once_to_their_end(pipe, examples):
    """Their format is detected, too."""
    names = "reference", "estimate"
    contents = [(examples / f"tum/{name}.txt").read_bytes() for name in names]
    pipes = [pipe(content, name) for name, content in zip(names, contents, strict=True)]
    expected = evaluate(*[examples / f"tum/{name}.txt" for name in names])
    assert evaluate(*pipes).to_dict()["PAS"] == expected.to_dict()["PAS"]


def test_a_wrong_line_of_a_pipe_is_named(pipe):
    with pytest.raises(FileError, match="pipe, line 4: has 3 columns, the first row 8"):
        read_tum(pipe(b"# t\n\n" + POSE.encode() + b"1 2 3\n"))
    with pytest.raises(
        FileError, match="second, line 2: a quaternion of length 2 is not a rotation"
    ):
        read_tum(pipe(f"{POSE}1 1 2 3 0 0 0 2\n".encode(), "second"))


def test_a_silent_pipe_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MAX_SILENCE", 0.05)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match=r"pipe: is a pipe that sent nothing for 0.05 s"):
        read_tum(tmp_path / "pipe")


def test_an_endless_pipe_is_too_large(monkeypatch):
    monkeypatch.setattr(files, "MAX_PIPE", 10**6)
    code = f"while True: print({POSE.strip()!r})"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as program:
        with pytest.raises(FileError, match="has more than 1 MB, the largest size that is read"):
            read_tum(f"/dev/fd/{program.stdout.fileno()}")
        program.stdout.close()


def test_large_files_are_refused_before_they_are_read(tmp_path):
    path = tmp_path / "est.txt"
    with path.open("wb") as file:
        file.truncate(files.MAX_BYTES + 1)  # a hole, which takes no space
    with pytest.raises(FileError, match="has more than 500 MB"):
        read_tum(path)


def test_large_arrays_are_refused_before_they_are_unpacked(tmp_path):
    path = tmp_path / "est.npz"
    n = files.MAX_BYTES // 128 + 1
    np.savez_compressed(path, p=np.zeros((n, 4, 4), np.int8))
    with pytest.raises(FileError, match="the array p takes 500 MB, more than the 500 MB"):
        read_arrays(path)
    np.savez_compressed(path, p=np.zeros((n // 4, 4, 4), np.int8))
    tracemalloc.start()
    with pytest.raises(FileError, match=r"p\[0\]: the last row of the matrix must be 0 0 0 1$"):
        read_arrays(path)
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()
    poses = np.tile(np.eye(4), (3, 1, 1))
    np.savez_compressed(path, p=poses, depth=np.zeros((3, 1000, 1000)))
    assert len(read_arrays(path).keys) == 3  # what is no pose is not read
