"""Files that would fill the memory, and numbers that no double holds."""

import gzip
import io
import json
from pathlib import Path

import numpy as np
import pytest

from alignscores.trajectories.files import FileError, read_arrays, read_nerf, read_tum
from alignscores.trajectories.recognition import recognise

LINE = b"%d 1 2 3 0 0 0 1\n"
MATRIX = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


@pytest.fixture
def small(monkeypatch):
    """The bound at 1 MB."""
    monkeypatch.setenv("ALIGNSCORES_MAX_MB", "1")


def transforms(number):
    frame = {"file_path": "a.png", "transform_matrix": MATRIX}
    return json.dumps({"frames": [frame]}).replace("[1,", f"[{number},").encode()


def packed(**arrays):
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def header(shape):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        file, {"descr": "<f8", "fortran_order": False, "shape": shape}
    )
    return file.getvalue()


LARGE = "has more than 1 MB; set ALIGNSCORES_MAX_MB higher"
NO_ARRAYS = "is not a file of arrays"


@pytest.mark.parametrize(
    ("read", "content", "reason"),
    [
        (read_tum, lambda: LINE * 100_000, LARGE),
        (read_tum, lambda: gzip.compress(LINE * 100_000), LARGE),
        (read_tum, lambda: gzip.compress(gzip.compress(b"0" * 10**8)), "is not text"),
        (recognise, lambda: b"1 1\n" * 300_000, LARGE),
        (read_nerf, lambda: b"[" * 200_000, "is not JSON that can be read"),
        (
            read_nerf,
            lambda: transforms("1" + "0" * 5000),
            "is not JSON that can be read",
        ),
        (read_arrays, lambda: header((10**14, 4, 4)) + bytes(64), NO_ARRAYS),
        (read_arrays, lambda: header((2, 4, 4)).replace(b"(2,", b"((("), NO_ARRAYS),
        (read_arrays, lambda: packed(a=np.zeros((2, 4, 4)))[:-30], NO_ARRAYS),
    ],
)
def test_hostile_files_are_refused(small, tmp_path, read, content, reason):
    path = tmp_path / "x"
    path.write_bytes(content())
    try:
        with pytest.raises(FileError, match=reason) as caught:
            read(str(path))
        assert len(str(caught.value)) < 300
    except MemoryError:  # which whoever scores makes a line of
        assert b"10000000000" in content()


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no /dev/zero")
def test_what_has_no_end_is_refused(small):
    with pytest.raises(FileError, match=LARGE):
        read_tum("/dev/zero")


def test_the_bound_can_be_raised(tmp_path, monkeypatch):
    path = tmp_path / "x.txt"
    path.write_bytes(b"-1 1 2 3 1 0 0 0\n" + b"".join(LINE % n for n in range(59_999)))
    monkeypatch.setenv("ALIGNSCORES_MAX_MB", "4.5")
    assert len(read_tum(path).keys) == 60_000
    for wrong in ("0", "x", "nan"):
        monkeypatch.setenv("ALIGNSCORES_MAX_MB", wrong)
        with pytest.raises(ValueError, match="ALIGNSCORES_MAX_MB must be a number of MB above 0"):
            read_tum(path)
