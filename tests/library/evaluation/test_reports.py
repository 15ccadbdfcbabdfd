"""Public reports, rebuilt as small files in ``shared/cases``: how each must end, by every door.

The values are those of an independent calculation, whose scores are 0.005 to 0.01 lower.
"""

import json
import re
import shlex
from pathlib import Path

import pytest

from alignscores import compare, evaluate
from alignscores.io import FORMATS

CASES = Path(__file__).resolve().parents[4] / "shared" / "cases"
OFFSET_26 = "offset of -90569539.4(8[7-9]|9[0-7])"  # within 5 ms of the true one
ENDS = [  # case, arguments, scores (TAS, RAS, ATE) or the reason of the refusal, and a note
    ("01", "lowres_wide.traj est.txt", r"7 columns, .* rotation vectors, 't rx ry rz x y z'", ""),
    ("01", "lowres_wide.traj est.txt --ref_columns 't rx ry rz x y z'", (0.07, 0.06), "--ref_inv"),
    (
        "01",
        "lowres_wide.traj est.txt --ref_columns 't rx ry rz x y z' --ref_invert",
        (0.47, 0.84, 0.050),
        "",
    ),
    (
        "01b",
        "lowres_wide.traj est.txt",
        "7 columns, whose meaning is unknown.*t rx ry rz x y z",
        "",
    ),
    ("02", "poses.txt est_kitti.txt", (0.905, 0.917, 0.172), "41 of 300 frames"),
    ("02", "poses.txt est_indexed.txt", (0.905, 0.917, 0.172), "41 of 300 frames"),
    ("03", "gt.txt est.txt", "216 of 240 poses", ""),
    ("03", "gt.txt est_full.txt", "216 of 240 poses", ""),
    ("04", "gt.txt results.txt", "the file seems to hold several runs", ""),
    ("04", "gt.txt appended.txt", "the file seems to hold several runs", ""),
    ("05", "gt.txt est454.txt", "write the number of its frame .*, or a row of nan", ""),
    ("05", "gt.txt est454.txt --missing ignore", "write the number of its frame", ""),
    (
        "06",
        "stamped_groundtruth.txt stamped_traj_estimate.txt --alignment yaw --body_rotation auto",
        (0.66, 0.87),
        "a constant rotation of the camera frame was removed",
    ),
    (
        "06",
        "stamped_groundtruth.txt stamped_traj_estimate.txt --alignment yaw",
        (0.66, 0.01),
        "--body_rotation auto removes it",
    ),
    ("07", "colmap gt results.txt", (0.856, 0.862), "matched by the end of their path"),
    ("07", "gt results.txt", (0.856, 0.862), "matched by the end of their path"),
    ("08", "Alpha_gt.txt est.txt --alignment rigid", (0.99, None, 0.078), "too sparse"),
    (
        "09",
        "unity.txt colmap.txt",
        (0.326, 0.066),
        "the reference, or the estimate, is left-handed",
    ),
    ("09", "nerf unity_transforms.json colmap --est_format colmap", (0.326, 0.066), "left-hand"),
    ("10", "kitti gt.txt relative.txt", "motions from frame to frame", ""),
    ("10", "kitti gt_rel.txt relative.txt", (0.01, 0.958), "motions from frame to frame"),
    ("10", "gt.txt relative_n.txt", (0.025, 0.104), "motions from frame to frame"),
    ("11", "airsim_rec.txt est.txt", (0.875, 0.835), "time stamps in ms"),
    ("12", "data.csv robot0.txt", "count by one", ""),
    ("12", "gt.txt robot0.txt", "count by one", ""),
    ("13", "gt.txt graph.g2o", "time stamps in seconds, the estimate frame numbers", ""),
    ("13", "gt.txt graph.g2o --est_columns '- n x y z qx qy qz qw'", "is not a text table", ""),
    ("13", "gt_indexed.txt graph.g2o", "200 poses, the estimate 40", ""),
    ("14", "pose est.txt", (0.832, 0.917, 0.031), "no pose for 10.0%"),
    ("14", "pose est_padded", (0.832, 0.917, 0.031), "no pose for 10.0%"),
    ("14", "pose traj_full.txt", (0.832, 0.917, 0.031), "no pose for 10.0%"),
    ("15", "traj.txt est_index.txt", (0.855, 0.03), "180 deg about x"),
    ("15", "traj.txt est_index.txt --body_rotation auto", (0.855, 0.95), ""),
    ("15", "traj.txt est_fps.txt", "frame numbers, the estimate time stamps", ""),
    ("16", "colmap gt reconstruction.json", "leave out the format to have it detected", ""),
    ("16", "gt reconstruction.json", (0.638, 0.640), "it has 2 models; scored is 0"),
    ("17", "gt est", (0.951, 0.956), ""),
    ("18", "traj_1.txt traj_2.txt", (0.962, 1.0), "under alignments 179 deg apart"),
    ("19", "gt_1hz.txt lio_10hz.txt --alignment rigid", (0.99, 0.957, 0.0835), "too sparse"),
    ("20", "closed_loop_trajectory.csv est.txt", "its header names 2 clocks", ""),
    (
        "20",
        "closed_loop_trajectory.csv est.txt --ref_columns '- t_us - x y z qx qy qz qw'",
        (0.705, 0.842),
        "4 of 12 columns ignored",
    ),
    ("20", "short_names.csv est.txt", "its header names 2 clocks", ""),
    ("21", "bus_outside.txt svin.txt", (0.757, 0.048), "--ref_columns 't x y z qw qx qy qz'"),
    (
        "21",
        "bus_outside.txt svin.txt --ref_columns 't x y z qw qx qy qz'",
        (0.752, 0.835),
        "",
    ),
    ("22", "gt.txt est.txt", "7 columns, whose meaning is unknown", ""),
    (
        "22",
        "gt.txt est.txt --ref_columns 'n x y z - - -'",
        "frame numbers, the estimate time stamps",
        "",
    ),
    ("23", "gt.npz vggt.npz", (0.219, 0.075), "--est_invert corrects it"),
    ("23", "gt.npz vggt.npz --invert", (0.953, 0.925), ""),
    ("24", "poses_gt.txt poses.txt", (0.875, 0.835), ""),
    ("24", "poses_gt.txt poses_noheader.txt", (0.875, 0.835), "1 of 9 columns ignored"),
    ("25", "gt.txt static.txt", (0.0, 0.0), "all poses are identical"),
    ("26", "gt.txt est.txt", rf"best with an {OFFSET_26}.* --t_offset auto", ""),
    ("26", "gt.txt est.txt --t_offset auto", (0.793, 0.835), f"time {OFFSET_26}"),
    ("27", "gt.txt frozen.txt", (0.507, 0.626), "78 of 300 poses repeat an earlier one"),
    ("27", "gt.txt gap.txt", (0.550, 0.675), ""),
    ("29", "j_gt.txt j_est.txt", (0.081, 0.071), "best with an offset of 1.35"),
    ("29", "j_gt.txt j_est.txt --t_offset auto", (0.825, 0.94), "time offset of 1.35"),
    ("30", "c_gt_ms.txt c_est_ms.txt", (0.276, 0.847), "--columns 't_ms x y z qx qy qz qw'"),
    ("30", "c_gt_ms.txt c_estk_ms.txt", (0.049, 0.145), "--columns 't_ms x y z qx qy qz qw'"),
    ("30", "c_gt_s.txt c_est_ms.txt", "only 1 of 600 poses .* --est_columns 't_ms", ""),
    ("30", "c_gt_us.txt c_estk_us.txt", (0.049, 0.145), "--columns 't_us x y z qx qy qz qw'"),
    ("30", "c_gt_ms.txt c_est_ms.txt --columns 't_ms x y z qx qy qz qw'", (0.745, 0.849), ""),
    ("31", "d_gps.txt d_est.txt", "seems to have latitudes and longitudes", ""),
    ("34", "b_gt.txt b_euler.txt", "a quaternion of length 1.87 is not a rotation", ""),
    ("34", "b_gt.txt b_eulerdeg.txt", "a quaternion of length 90.6 is not a rotation", ""),
    ("34", "b_gt.txt b_euler.txt --est_columns 't x y z'", (0.798, None), "no rotations"),
    ("35", "k_gt.txt k_est.txt --t_max_diff 1e25", "t_max_diff is in seconds", ""),
    ("35", "k_gt.txt k_est.txt --t_offset auto", (0.84, 0.955), "offset of -12345.59"),
    ("36", "g_w2c.npz e_c2w.npz", (0.176, 0.057), "poses of (g_w2c.npz|the ref).*--ref_invert"),
    ("36", "g_w2c.npz e_c2w.npz --ref_invert", (0.877, 0.927), ""),
    ("36", "a_w2c.npz a_e_w2c.npz", (0.193, 0.228), "--ref_invert --est_invert corrects it"),
    (
        "36",
        "g_w2c.npz e_w2c.npz",
        (0.901, 0.228),
        "both g_w2c.npz and e_w2c.npz seem to be world-to-camera .*--ref_inv",
    ),
    ("40", "reference.txt both.csv", "names 2 poses; choose .* 't - - - - - - - x y z qx", ""),
    ("40", "reference.txt both2.csv", "names 2 poses; choose .* 't - - - x y z'", ""),
    ("40", "reference.txt both3.csv", "names 2 poses; choose .* 't - - - x y z qx", ""),
    ("41", "r.csv e2.csv", (0.8805, 0.8612), ""),
    ("41", "tum r.csv e2.csv", (0.8805, 0.8612), ""),
    ("41", "reference.txt e2.csv", (0.8805, 0.8612), ""),
]


@pytest.fixture
def folder(monkeypatch):
    """(number) -> go to the folder of a case; skip where it is not there."""

    def folder(number):
        folders = [*CASES.glob(f"{number}-*")]
        if not folders:
            pytest.skip(f"no case {number} at {CASES}")
        monkeypatch.chdir(folders[0])

    return folder


def parsed(arguments):
    """Files and settings of a command."""
    words = shlex.split(arguments)
    settings = {"format": words.pop(0)} if words[0] in FORMATS else {}
    files = [words.pop(0), words.pop(0)]
    while words:
        name = words.pop(0).removeprefix("--")
        settings[name] = True if name.endswith("invert") else words.pop(0)
    return files, settings


def agree(values, right):
    """TAS, RAS and ATE, as far as they are known."""
    for value, expected, tolerance in zip(values, right, (0.016, 0.016, 0.001), strict=False):
        if expected is not None:
            assert value == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize("row", ENDS, ids=lambda row: " ".join(row[:2]))
def test_a_report_ends_as_it_must(folder, command, row):
    """By the command; every door has its numbers (see `test_doors`)."""
    number, arguments, end, note = row
    folder(number)
    code, out, err = command(*shlex.split(arguments), "--json")
    assert "Traceback" not in err
    if isinstance(end, str):
        assert code == 1
        assert re.search(end, err)
        return
    assert code == 0
    (printed,) = json.loads(out)["results"]
    agree([printed["TAS"], printed["RAS"], printed["ate"]], end)
    assert re.search(note, err)
    if not note:
        assert "corrected)" not in err


BY_EVERY_DOOR = [  # settings of either file, a refusal, a note, a remedy, a hint, a failure
    ("01", "lowres_wide.traj est.txt --ref_columns 't rx ry rz x y z' --ref_invert"),
    ("34", "b_gt.txt b_euler.txt --est_columns 't x y z'"),
    *(("07", "gt results.txt"), ("16", "gt reconstruction.json"), ("41", "tum r.csv e2.csv")),
    *(("26", "gt.txt est.txt"), ("20", "short_names.csv est.txt"), ("14", "pose est.txt")),
    *(("29", "j_gt.txt j_est.txt --t_offset auto"), ("30", "c_gt_ms.txt c_est_ms.txt")),
    *(("23", "gt.npz vggt.npz"), ("25", "gt.txt static.txt")),
]


@pytest.mark.parametrize("named", BY_EVERY_DOOR, ids=" ".join)
def test_a_report_ends_alike_by_function_and_comparison(folder, named):
    ((number, arguments, end, note),) = [row for row in ENDS if row[:2] == named]
    folder(number)
    files, settings = parsed(arguments)
    if isinstance(end, str):
        with pytest.raises(ValueError, match=end):
            evaluate(*files, **settings)
        return
    evaluation = evaluate(*files, **settings)
    agree([evaluation.tas, evaluation.ras, evaluation.ate], end)
    compared = compare(files[0], {"system": files[1]}, **settings)
    agree(compared.runs.iloc[0][["TAS", "RAS", "ATE"]], end)
    for notes in (evaluation.notes, [*compared.notes, *compared.failed]):
        assert re.search(note, "\n".join(map(str, notes)))


def test_runs_of_one_pose_are_failures_in_a_comparison(folder, command):
    """Also where all quaternions are zero; a gate on the score holds for them."""
    folder("25")
    patterns = "cmp/{sequence}/gt.txt", "cmp/{sequence}/{system}/{run}.txt"
    means = compare(*patterns).summary.query("sequence.isna()").set_index("system")["PAS"]
    assert means[["idle", "zeroq", "empty"]].tolist() == pytest.approx([0.203] * 3, abs=0.001)
    code, out, err = command("compare", *patterns, "--fail_on", "PAS<0.5,failed>0.7", "--json")
    assert code == 3
    runs = json.loads(out)["runs"]
    for system in ("idle", "zeroq", "empty"):
        assert f"{system}: PAS" in err
        assert f"{system}: failed 75% > 70%" in err
        failed = [run for run in runs if (run["system"], run["status"]) == (system, "failed")]
        assert len(failed) == 6
        assert not any(run["notes"] for run in failed)
        assert all(err.count(f"{run['error']}; it counts as a failure\n") == 1 for run in failed)
    assert err.count("all poses are identical; none counts") == 12
