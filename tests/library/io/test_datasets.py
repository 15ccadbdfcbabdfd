"""Every command on the page of data sets gives scores, with made numbers in the format of its row.

The formats are those of the documents and readers that the page cites.
"""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

PAGE = Path(__file__).parents[3] / "docs/how-to/datasets.md"
N = 40
TIMES = np.arange(N) / 10
STAMPS = 1_700_000_000 + TIMES
RNG = np.random.default_rng(0)
POSITIONS = np.cumsum(RNG.random((N, 3)), axis=0)
ROTATIONS = Rotation.random(N, rng=0)
PRISM = POSITIONS + ROTATIONS.apply([0.1, 0, 0.2]) + 0.01 * RNG.random((N, 3))
QUATERNIONS, MATRICES = ROTATIONS.as_quat(), ROTATIONS.as_matrix()
VALUES = {
    **{"t": STAMPS, "ns": STAMPS * 1e9, "start": TIMES, "n": np.arange(N), "0": 0 * TIMES},
    **{"whole": np.floor(STAMPS), "rest": (STAMPS % 1) * 1e9, "1": 0 * TIMES + 1},
    **dict(zip("xyz", POSITIONS.T, strict=True)),
    **dict(zip("abc", PRISM.T, strict=True)),
    **dict(zip(["qx", "qy", "qz", "qw"], QUATERNIONS.T, strict=True)),
    **{f"r{i}{j}": MATRICES[:, i - 1, j - 1] for i in (1, 2, 3) for j in (1, 2, 3)},
    **dict(zip(["u", "v", "w"], ROTATIONS.as_rotvec().T, strict=True)),
}
XYZ, Q, W = "x y z", "x y z qx qy qz qw", "x y z qw qx qy qz"
ROWS = "r11 r12 r13 x", "r21 r22 r23 y", "r31 r32 r33 z", "0 0 0 1"
MATRIX, FOUR_ROWS = " ".join(ROWS[:3]), " ".join(ROWS)


def text(columns, by=" ", header="", end=""):
    """A table of these columns, a pose a line."""
    values = np.column_stack([VALUES[name] for name in columns.split()])
    rows = [by.join(f"{value:.6f}" for value in row) + end + "\n" for row in values]
    return "".join([f"{header}\n" if header else "", *rows])


def folder(name):
    """A file with a matrix for each pose."""
    return {
        name.format(row): "\n".join(
            " ".join(f"{VALUES[column][row]:.6f}" for column in line.split()) for line in ROWS
        )
        for row in range(N)
    }


TUM = text(f"t {Q}", header="# timestamp tx ty tz qx qy qz qw")
NS = text(f"ns {Q}")
EUROC = (
    "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
)
BIASES = ",v_RS_R_x [m s^-1],b_w_RS_S_x [rad s^-1]"
EST = {"est.txt": TUM}
KITTI = {"est.txt": text(MATRIX)}
ROSTOPIC = ",".join(
    ["%time,field.header.stamp"]
    + [f"field.pose.position.{axis}" for axis in "xyz"]
    + [f"field.pose.orientation.{axis}" for axis in "xyzw"]
)
FILES = {  # the row of the page -> files in its format
    "TUM RGB-D": {"groundtruth.txt": TUM},
    "TUM-VI, EuRoC": {"data.csv": text(f"ns {W} 0 0", ",", EUROC + BIASES)},
    "EuRoC's prism": {"data.csv": text("ns a b c", ",", EUROC[: EUROC.index(",q_RS")])},
    "KITTI": {"00.txt": text(MATRIX), **KITTI},
    "4Seasons": {"GNSSPoses.txt": text(f"ns {Q} 1 0 0", ",")},
    "TartanAir": {"pose_left.txt": text(Q), "est.txt": text(Q)},
    "ScanNet": {**folder("pose/{}.txt"), **folder("est/{}.txt")},
    "7-Scenes": {**folder("seq-01/frame-{:06d}.pose.txt"), "est.txt": text(f"n {Q}")},
    "Replica": {"traj.txt": text(FOUR_ROWS), "est.txt": text(FOUR_ROWS)},
    "MCD": {"pose_inW.csv": text(f"n t {Q}", ",", "num,t,x,y,z,qx,qy,qz,qw")},
    "Newer College": {
        "registered_poses.csv": text(f"whole rest {Q}", ",", "#sec,nsec,x,y,z,qx,qy,qz,qw")
    },
    "UZH-FPV": {"groundtruth.txt": TUM},
    "Hilti 2021": {"gt.txt": "".join(text(f"t {XYZ} 0 0 0 1").splitlines(True)[::8])},
    "Oxford Spires": {"gt-tum.txt": TUM},
    "LaMAria": {"R_01_easy.txt": NS, "est.txt": NS},
    "a total station, GNSS in metres": {"prism.txt": text("t a b c")},
    "`rostopic echo -p`": {"gt.csv": text(f"0 ns {Q}", ",", ROSTOPIC)},
    "ORB-SLAM3, DROID-SLAM, MASt3R-SLAM": {"groundtruth.txt": TUM, "est.txt": NS},
    "OpenVINS": {
        "groundtruth.txt": TUM,
        "est.txt": text(f"t {Q}" + 12 * " 0", header="# timestamp(s) tx ty tz qx qy qz qw Pr11"),
    },
    "VINS-Mono, VINS-Fusion": {
        "data.csv": text(f"ns {W} 0 0", ",", EUROC + BIASES),
        "vins_result_loop.csv": text(f"ns {W}", ",", end=","),
    },
    "FAST-LIO2": {
        "groundtruth.txt": TUM,
        "pos_log.txt": text(f"start u v w {XYZ}" + 18 * " 0"),
    },
    "KISS-ICP": {"00.txt": text(MATRIX), "00_poses_kitti.txt": text(MATRIX)},
    "VSLAM-LAB": {
        "groundtruth.csv": text(f"ns {Q}", ",", "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw"),
        "00000_KeyFrameTrajectory.csv": text(
            f"ns {Q}", ",", "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw"
        ),
    },
}
WITHOUT_ROTATIONS = {"EuRoC's prism", "Hilti 2021", "a total station, GNSS in metres", "FAST-LIO2"}

ELSEWHERE = {
    "hloc",
    "OpenSfM",
    "g2o, GTSAM",
    "NTU VIRAL",
    "ROS bags",
    "COLMAP, GLOMAP",
    "nerfstudio",
    "VGGT, Depth Anything 3",
    "Pi3 and other networks",
}


def commands():
    """The name of each row of the page -> its command."""
    rows = [line.split("|") for line in PAGE.read_text().splitlines() if "| `alignscores" in line]
    return {row[1].partition("[")[0].strip(): row[-2].strip(" `") for row in rows}


def test_each_row_of_the_page_has_a_file():
    """Bags, models and arrays are in cli/test_formats.py, the other ones in test_cases.py."""
    assert commands().keys() == FILES.keys() | ELSEWHERE


@pytest.mark.parametrize("name", FILES)
def test_the_command_of_a_row_gives_scores(command, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    for file, content in {"est.txt": TUM, **FILES[name]}.items():
        Path(file).parent.mkdir(exist_ok=True, parents=True)
        if not Path(file).exists():
            Path(file).write_text(content)
    code, out, err = command(*shlex.split(commands()[name])[1:], "--json")
    assert code == 0, err
    (result,) = json.loads(out)["results"]
    assert (result["n"], result["TAS"] > 0.9) == (5 if "Hilti" in name else N, True)
    assert (result["PAS"] is None) == (name in WITHOUT_ROTATIONS)


def test_the_recipe_of_vslam_lab(command, tmp_path, monkeypatch):
    """Both lines as they stand among the recipes; the table has evo's columns and the scores."""
    monkeypatch.chdir(tmp_path)
    for file, content in FILES["VSLAM-LAB"].items():
        Path(file).write_text(content)
    recipes = (PAGE.parent / "recipes.md").read_text()
    lines = [line.split() for line in recipes.splitlines() if "00000.zip" in line]
    assert [words[0] for words in lines] == ["alignscores", "evo_res"]
    assert command(*lines[0][1:])[0] == 0
    code = "from evo.cli.entry_points import res; res()"  # what the command evo_res runs
    words = [sys.executable, "-c", code, *lines[1][1:]]
    environment = {**os.environ, "HOME": str(tmp_path)}
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    columns = Path("table.csv").read_text().partition("\n")[0].split(",")
    assert {"rmse", "mean", "median", "std", "max", "TAS", "RAS", "PAS", "coverage"} <= {*columns}
