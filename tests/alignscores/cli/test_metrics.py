"""Metrics by name: in the table, the JSON and a file."""

import csv
import json
import re

import numpy as np
import pytest

from alignscores import Settings
from alignscores.cli.metrics import metric_table
from alignscores.metrics import LEVELS, SCORES
from alignscores.protocols import PROTOCOLS, protocol
from alignscores.trajectories.association import match
from alignscores.trajectories.files import read_tum

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"
# Each camera of the reference has the pose of its own stamp, or none.
AT_STAMPS = "--sync", "nearest", "--max_gap", 0
COLMAP = "colmap", "colmap/reference", "colmap/estimate"
NAMES = [family.example for family in SCORES]
EXAMPLES = [family.example for family in PROTOCOLS]


def test_values(score, run, examples, tmp_path):
    """Those of the library for the poses that are scored; or none, and why."""
    path = tmp_path / "metrics.csv"
    names = [*NAMES, *EXAMPLES]
    options = ["--metrics", ",".join(names), "--missing", "fail", "--seed", 3, *AT_STAMPS]
    (result,) = score(*TUM, *options, "--save_metrics", path)
    assert list(result["metrics"]) == names
    assert [result["metrics"][name] for name in NAMES] == [result[name] for name in NAMES]
    both = (read_tum(examples / file) for file in TUM[1:])
    matches = match(*both, missing="fail", sync="nearest", max_gap=0.0)
    poses = matches.gt_poses, matches.est_poses
    arrays = [block for world in poses for block in (world[:, :3, 3], world[:, :3, :3])]
    refused: list[str] = []
    for name in EXAMPLES:
        try:
            expected = protocol(name)(*arrays, rng=3, stamps=matches.keys)
        except ValueError as error:
            refused.append(f"estimate.txt: no value of {name}: {error}")
            expected = None
        assert result["metrics"][name] == expected
    assert 0 < len(refused) < 9  # three of them errors of videos, which lack no frame
    assert result["notes"] == refused
    with path.open() as file:
        (row,) = csv.DictReader(file)
    assert row.pop("estimate") == "estimate.txt"
    assert {name: float(x) if x else None for name, x in row.items()} == result["metrics"]
    # In blocks, which all have the names, no wider than the table.
    _, out, _ = run(*TUM, *options)
    lines = [line for line in out.splitlines() if line.startswith("estimate")]
    assert len(lines) > 4
    assert max(map(len, lines)) <= 100
    assert [name for line in lines[::2] for name in line.split()[1:] if "[" not in name] == names


def test_only_what_was_asked_for(run, score, tmp_path):
    options = "--metrics", "ATE, recall@1m,30deg:hloc-sim3,ate", "--missing", "ignore"
    _, out, err = run(*TUM, *options, *AT_STAMPS)
    header, row, settings = out.splitlines()
    assert header.split() == ["estimate", "ATE", "[m]", "recall@1m,30deg:hloc-sim3", "[%]"]
    assert row.split() == ["estimate.txt", "1.03", "91.89"]
    assert (settings, err) == ("seed 0; missing cameras: ignore", "")
    (plain,) = score(*TUM, "--save_metrics", tmp_path / "own.csv")
    assert plain["metrics"] == {}
    assert (tmp_path / "own.csv").read_text().splitlines()[0] == ",".join(["estimate", *NAMES])


def test_list_of_metrics(run):
    code, out, err = run("tum", "--metrics", "help")
    assert (code, err) == (0, "")
    listed = [line.split()[0] for line in out.splitlines()]
    expected = [*NAMES, *(family.syntax for family in (*LEVELS, *PROTOCOLS))]
    assert listed[: len(expected)] == expected


@pytest.mark.parametrize(
    ("files", "names", "message"),
    [
        (
            TUM,
            "tas,auc@30",
            "'auc@30'; close to it are auc@30:vggt, auc@5:colmap",
        ),
        (
            TUM,
            "pass",
            "unknown metric 'pass'; close to it are PAS, TAS, RAS; --metrics help lists",
        ),
        (TUM, "tas,", "unknown metric ''; close to it are "),
        (COLMAP, "rpe@1m", "rpe@1m needs cameras in the order of time, but images are matched by "),
    ],
)
def test_wrong_names(run, files, names, message):
    code, out, err = run(*files, "--metrics", names)
    assert (code, out) == (2, "")
    last = err.splitlines()[-1]
    assert last.startswith(f"alignscores {files[0]}: error: argument --metrics: ")
    assert message in last


def test_lengths_in_metres_where_the_reference_has_none(run):
    names = "auc@30:vggt,recall@5cm,5deg:hloc-sim3,auc@5:colmap,ate"
    _, _, err = run(*COLMAP, "--metrics", names)
    note = "the reference's unit is taken for a metre in recall@5cm,5deg:hloc-sim3, auc@5:colmap"
    assert err == f"alignscores: note: {note}\n"
    assert run(*TUM, "--metrics", names)[2] == ""


def test_what_has_no_value(score, run, lines, write):
    """More than half of the cameras lost: the median is not finite."""
    files = *TUM[:2], write(lines[:15]), "--missing", "fail", *AT_STAMPS
    (result,) = score(*files, "--metrics", "median:hloc,half,kitti")
    assert result["metrics"] == dict.fromkeys(["median:hloc", "half_distance", "kitti"])
    notes = "\n".join(result["notes"])
    assert "no value of median:hloc: it is not finite, with so many cameras lost" in notes
    assert "no value of kitti: the KITTI errors need all poses" in notes
    _, out, _ = run(*files, "--metrics", "median:hloc,half,kitti")
    assert out.splitlines()[1].split() == ["est.txt", "-", "-", "-"]


def test_parts_are_no_world(run, tmp_path, examples):
    (tmp_path / "sparse").mkdir()
    for part in "01":
        (tmp_path / "sparse" / part).symlink_to(examples / "colmap/estimate")
    _, out, _ = run(*COLMAP[:2], tmp_path / "sparse", "--metrics", "tas,auc@30:vggt", "--json")
    (result,) = json.loads(out)["results"]
    assert result["metrics"] == {"TAS": result["TAS"], "auc@30:vggt": None}
    note = "no value of auc@30:vggt: they need one world, not 2 parts"
    assert any(note in text for text in result["notes"])


@pytest.mark.parametrize("length", [5, 60, 200])
def test_width(length):
    names = ["TAS", "recall@0.123456m,0.123456deg:hloc-sim3", *EXAMPLES]
    rows = {"ab"[i] + "x" * length + "yz"[i]: dict.fromkeys(names, 0.00123456) for i in (0, 1)}
    settings = Settings(format="tum", metrics=tuple(names))
    lines = metric_table(rows, settings).splitlines()
    assert max(map(len, lines)) <= 100
    blocks = "\n".join(lines).split("\n\n")
    assert all(re.match(r"estimate .*\na\S*y .*\nb\S*z .*$", block) for block in blocks)
    np.testing.assert_array_less([block.count("\n") for block in blocks], 3)
