"""Which format a file or a folder has, by its name or content; texts are in test_tables.py."""

import pytest

from alignscores.trajectories.files import FileError
from alignscores.trajectories.recognition import recognise

NAME_IT = "; name the format: alignscores FORMAT REF EST"


def test_some_formats_are_told_by_the_name():
    """Whatever stands there."""
    assert {recognise(f"/nowhere/a.{ending}") for ending in ("bag", "mcap", "db3")} == {"bag"}
    assert {recognise(f"/nowhere/a.{ending}") for ending in ("npy", "npz")} == {"arrays"}


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        *[(["metadata.yaml"], "bag"), (["images.bin"], "colmap"), (["0/images.txt"], "colmap")],
        *[(["metadata.yaml", "images.txt"], "bag"), (["0.txt", "1.txt"], "matrices")],
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
        (str(tmp_path), "is a folder with no COLMAP model, bag or matrices in .txt files"),
        ("-", "the format of stdin is unknown"),
    ):
        with pytest.raises(FileError) as caught:
            recognise(path)
        assert str(caught.value).endswith(f"{reason}{NAME_IT}")
