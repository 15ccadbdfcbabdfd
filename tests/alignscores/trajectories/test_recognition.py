"""Which format a file has, by its name and its first lines."""

import pytest

from alignscores.trajectories.files import FileError
from alignscores.trajectories.files.vslamlab import HEADER
from alignscores.trajectories.recognition import recognise

NAME_IT = "; name the format: alignscores FORMAT REF EST"
ROW = "1 2 3 0 0 0 1"
NS = 1_700_000_000_000_000_000


def columns(n, by=" "):
    return by.join(map(str, range(n)))


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        *[(["{"], "nerf"), (["[", "x"], "nerf"), (["# a comment", "", " {"], "nerf")],
        *[([HEADER], "vslamlab"), ([HEADER.replace(",", '","')], "vslamlab")],
        *[([columns(8)], "tum"), ([columns(12)], "kitti"), ([columns(16)], "kitti")],
        *[([columns(17)], "kitti"), ([columns(8, ",")], "euroc"), ([columns(17, ", ")], "euroc")],
        *[(["# x", f"0.5 {ROW}"], "tum"), ([f"0.5 {ROW}", "other words"], "tum")],
        # The stamps tell nanoseconds, by their size or their steps; those that are numbers.
        *[([f"{NS} {ROW}"], "euroc"), ([f"{NS // 10**9} {ROW}"], "tum")],
        ([f"0 {ROW}", f"50000000 {ROW}", f"100000000 {ROW}"], "euroc"),
        ([f"0 {ROW}", f"50 {ROW}", f"100 {ROW}"], "tum"),
        *[([f"nan {ROW}", f"0.5 {ROW}"], "tum"), ([f"inf {ROW}", f"{NS} {ROW}"], "euroc")],
        *[([f"nan {ROW}"], "tum"), ([f"0.5 {ROW}", f"x {ROW}", f"1 {ROW}"], "tum")],
    ],
)
def test_the_format_of_text(tmp_path, lines, expected):
    path = tmp_path / "poses.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert recognise(str(path)) == expected


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("# only this\n", " has no lines that tell its format"),
        ("# x\n\na 2 3 4 5 6 7\n", ", line 3: has 7 columns, by which no format can be told"),
        ("a 2 3 4 5 6 7 8\n", ", line 1: has 8 columns, by which no format can be told"),
    ],
)
def test_text_of_no_format(tmp_path, text, reason):
    path = tmp_path / "poses.txt"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=f"{reason}{NAME_IT}"):
        recognise(str(path))


def test_some_formats_are_told_by_the_name():
    """Whatever stands there."""
    assert {recognise(f"/nowhere/a.{ending}") for ending in ("bag", "mcap", "db3")} == {"bag"}
    assert {recognise(f"/nowhere/a.{ending}") for ending in ("npy", "npz")} == {"arrays"}


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        *[(["metadata.yaml"], "bag"), (["images.bin"], "colmap"), (["0/images.txt"], "colmap")],
        (["metadata.yaml", "images.txt"], "bag"),
    ],
)
def test_the_format_of_a_folder(tmp_path, files, expected):
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert recognise(str(tmp_path)) == expected


def test_where_nothing_tells_the_format(tmp_path):
    (tmp_path / "metadata.yaml").mkdir()
    for path, reason in (
        (str(tmp_path), "is a folder with neither a COLMAP model nor a bag"),
        ("-", "nothing tells the format of what stands on stdin"),
    ):
        with pytest.raises(FileError) as caught:
            recognise(path)
        assert str(caught.value).endswith(f"{reason}{NAME_IT}")
