"""Broken files of JSON and arrays, and numbers that no double holds."""

import io
import json
import tracemalloc

import numpy as np
import pytest

from alignscores.io import FileError, read_arrays, read_nerf, recognise

MATRIX = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


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


NO_ARRAYS = "is not a file of arrays"


@pytest.mark.parametrize(
    ("read", "content", "reason"),
    [
        (read_nerf, lambda: b"[" * 200_000, "is not JSON that can be read"),
        (read_nerf, lambda: b'{"frames": [], "frames": []}', "has the name 'frames' twice"),
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
def test_hostile_files_are_refused(tmp_path, read, content, reason):
    path = tmp_path / "x"
    path.write_bytes(content())
    try:
        with pytest.raises(FileError, match=reason) as caught:
            read(str(path))
        assert len(str(caught.value)) < 300
    except MemoryError:  # which whoever scores makes a line of
        assert b"10000000000" in content()


@pytest.mark.parametrize("text", [" " * 1_000_000, "#\n" * 500_000])
def test_a_format_is_recognised_in_little_memory(tmp_path, text):
    path = tmp_path / "x.txt"
    path.write_text(text)
    tracemalloc.start()
    try:
        with pytest.raises(FileError, match="has no line of numbers"):
            recognise(path)
        assert tracemalloc.get_traced_memory()[1] < 100e6
    finally:
        tracemalloc.stop()
