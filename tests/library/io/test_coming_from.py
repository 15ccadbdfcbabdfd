"""Every line of ours on the page for those who come from another program gives scores."""

import json
import shlex
import shutil
from pathlib import Path

import pytest

from .test_datasets import EUROC, MATRIX, NS, TUM, W, text

PAGE = Path(__file__).parents[3] / "docs/how-to/coming-from.md"
MADE = {
    **dict.fromkeys(["groundtruth.txt", "est.txt", "gt.txt", "MH01_GT.txt"], TUM),
    **dict.fromkeys(["stamped_groundtruth.txt", "stamped_traj_estimate.txt"], TUM),
    "f_dataset-MH01_mono.txt": NS,
    **dict.fromkeys(["00.txt", "00_est.txt"], text(MATRIX)),
    "data.csv": text(f"ns {W} 0 0", ",", EUROC),
}


def commands():
    """Our command of each row."""
    rows = [line.split("|") for line in PAGE.read_text().splitlines() if "| `alignscores " in line]
    return [row[-2].strip(" `") for row in rows]


def test_the_page_has_a_command_for_a_user_of_evo():
    assert any(line.startswith("alignscores tum ") for line in commands())


@pytest.mark.parametrize("line", commands())
def test_the_command_of_a_row_gives_scores(command, examples, tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    for file, content in MADE.items():
        Path(file).write_text(content)
    colmap = examples / "colmap"
    shutil.copytree(colmap / "reference", "reference/sparse/0")
    for number in range(2):
        shutil.copytree(colmap / "estimate", f"sparse/{number}")
    images = (colmap / "reference/images.txt").read_text().splitlines()
    rows = [row.split() for row in images if not row.startswith("#") and row.endswith(".png")]
    Path("results.txt").write_text("".join(f"{' '.join([row[9], *row[1:8]])}\n" for row in rows))
    code, out, err = command(*shlex.split(line)[1:], "--json")
    assert code == 0, err
    (result,) = json.loads(out)["results"]
    assert result["TAS"] > 0.8
    assert all(value is not None for value in result["metrics"].values())
    assert Path("run.zip").exists() == ("run.zip" in line)
