"""Metrics by name: in the table, the JSON and a file."""

import csv
import json

from alignscores import evaluate
from alignscores.metrics import METRICS, SCORES, metric
from tests.files import AT_STAMPS, COLMAP, TUM

NAMES = list(SCORES)
EXAMPLES = [entry.example or entry.name for entry in METRICS if entry.name not in SCORES]


def test_metrics_are_those_of_the_scored_poses(score, run, examples, tmp_path):
    """Those of the library for the poses that are scored; or none, and why."""
    path = tmp_path / "scores.csv"
    names = [*NAMES, *EXAMPLES]
    options = ["--metrics", ",".join(names), "--missing", "fail", "--seed", 3, *AT_STAMPS]
    (result,) = score(*TUM, *options, "--save_csv", path)
    assert list(result["metrics"]) == names
    files = (examples / file for file in TUM[1:])
    matches = evaluate(*files, sync="nearest", max_gap=0.0).matches
    for name in EXAMPLES:
        try:
            expected = metric(name)(matches.gt_poses, matches.est_poses)
        except ValueError:
            expected = None
        assert result["metrics"][name] == expected
    with path.open() as file:
        (row,) = csv.DictReader(file)
    assert row["name"] == "estimate.txt"
    saved = {name: float(row[name]) if row[name] else None for name in names}
    assert saved == result["metrics"]
    # In blocks, which all have the names, no wider than the terminal.
    lines = [line for line in run(*TUM, *options)[1].splitlines() if line.startswith("estimate")]
    assert len(lines) > 4
    assert max(map(len, lines)) <= 100
    assert [name for line in lines[::2] for name in line.split()[1:] if "[" not in name] == [
        name.partition("_")[0] for name in names
    ]


def test_the_table_has_the_metrics_in_their_order(run, score, tmp_path):
    options = "--metrics", "ATE, recall@1m,30deg:hloc-sim3,ate", "--missing", "ignore"
    header, row, _ = run(*TUM, *options, *AT_STAMPS)[1].splitlines()
    assert header.split() == ["estimate", "ATE", "[m]", "recall@1m,30deg:hloc-sim3", "[%]"]
    assert row.split() == ["estimate.txt", "1.03", "91.89"]
    (plain,) = score(*TUM, "--save_csv", tmp_path / "own.csv")
    assert plain["metrics"] == {}
    columns = (tmp_path / "own.csv").read_text().splitlines()[0].split(",")
    assert columns[:2] == ["name", "file"]
    assert {"TAS", "RAS", "PAS", "half_distance", "half_angle", "ate", "lost"} < set(columns)


def test_lengths_in_metres_where_the_reference_has_none(run):
    names = "auc@30:vggt,recall@5cm,5deg:hloc-sim3,auc@5:colmap,ate"
    for name in ("recall@5cm,5deg:hloc-sim3", "auc@5:colmap"):
        note = f"the reference's unit counts as a metre in {name}"
        assert note in run(*COLMAP, "--metrics", names)[2]
        assert note not in run(*TUM, "--metrics", names)[2]


def test_a_metric_without_a_value_is_a_dash_and_null(run, lines, write):
    """More than half of the cameras lost: the median is not finite."""
    files = *TUM[:2], write(lines[:15]), *AT_STAMPS, "--metrics", "median:hloc,half_distance,kitti"
    (result,) = json.loads(run(*files, "--json")[1])["results"]
    assert set(result["metrics"].values()) == {None}
    assert run(*files)[1].splitlines()[1].split() == ["est.txt", "-", "-", "-"]
