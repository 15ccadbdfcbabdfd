"""Trajectories of one's own at several frame rates."""

from pathlib import Path

import pandas as pd
import pytest

from alignscores import ras, tas_profile
from alignscores.trajectories.files import read_kitti
from studies.__main__ import main

DATA = Path(__file__).resolve().parents[2] / "data" / "kitti"
FILE = """
example:
  format: {format}
  reference: {reference}
  estimates: {{mine: {estimate}}}
"""


def write(folder: Path, **changes: object) -> Path:
    files = {"reference": DATA / "reference.txt", "estimate": DATA / "estimate.txt"}
    path = folder / "mine.yaml"
    path.write_text(FILE.format(**{"format": "kitti", **files, **changes}))
    return path


def score(path: Path, output: Path) -> int:
    given = ["--part", "own", "--settings", f"trajectories={path}"]
    return main(["frame_rate", *given, "--output", str(output)])


def test_each_rate_is_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "rates.csv"
    assert score(write(tmp_path), output) == 0
    assert capsys.readouterr().out == f"{output}\n"
    table = pd.read_csv(output)
    assert table["every"].tolist() == [1, 2]  # with a fifth of them too few are left
    assert table["cameras"].tolist() == [40, 20]
    gt, est = (read_kitti(DATA / name).poses for name in ("reference.txt", "estimate.txt"))
    expected = tas_profile(gt[::2, :3, 3], est[::2, :3, 3]).half
    assert table["HalfDistance"][1] == pytest.approx(expected, rel=0.01)
    assert table["RAS"][1] == pytest.approx(ras(gt[::2, :3, :3], est[::2, :3, :3]).score)


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"format": "bvh"}, "example.format must be one of tum, kitti"),
        ({"reference": "nowhere.txt"}, "nowhere.txt"),
        ({"estimate": ""}, "example.estimates.mine"),
    ],
)
def test_wrong_files_end_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, str], problem: str
) -> None:
    assert score(write(tmp_path, **changes), tmp_path / "o.csv") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert problem in line
    assert not (tmp_path / "o.csv").exists()
