"""Inputs of the frozen results: 60 scenes, a few runs with time stamps, and pieces of real runs.

Scenes and runs are drawn here, so that they stay the same whatever happens to the study's scenes.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tests.files import REAL

N_SCENES = 60
SEQUENCES = {"MH_03": 1403637160.0, "V2_02": 1413393915.0}  # start of each piece of EuRoC
SYSTEMS = {"vislam_ba": 3, "vislam_rp": 3, "vio_mono": 1}  # and how many runs of each


def scene(index, alignment="similarity"):
    """Return ground truth and estimate (n, 4, 4), in frames that differ by what is aligned."""
    n = (5, 10, 20, 50, 150)[index % 5]
    path = ("cube", "line", "loop")[index // 5 % 3]
    fault = ("noise", "outliers", "missing", "far")[index // 15]
    rng = np.random.default_rng(index)
    t = np.linspace(0, 1, n)
    positions = {
        "cube": rng.uniform(-0.5, 0.5, (n, 3)),
        "line": np.outer(t, [1.0, 2.0, 2.0]),
        "loop": np.column_stack([np.cos(6 * t), np.sin(6 * t), 0.2 * np.sin(12 * t)]),
    }[path]
    gt = poses(Rotation.from_quat(rng.normal(size=(n, 4))), positions)
    est = disturbed(gt, rng, 0.02, 2.0)
    if fault in ("outliers", "far"):
        k = n // (3 if fault == "outliers" else 10)
        est[n - k :, :3, 3] = rng.uniform(-5, 5, (k, 3))
        est[n - k :, :3, :3] = Rotation.from_quat(rng.normal(size=(n, 4)))[:k].as_matrix()
    if fault == "missing":
        est[::5] = np.nan
    frame = np.eye(4)
    if alignment == "yaw":
        frame[:3, :3] = Rotation.from_euler("z", rng.uniform(-3, 3)).as_matrix()
    elif alignment != "none":
        frame[:3, :3] = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    if alignment != "none":
        frame[:3, 3] = rng.normal(scale=1000 if fault == "far" else 3, size=3)
    est = frame @ est
    est[:, :3, 3] *= 2.5 if alignment == "similarity" else 1.0
    return gt, est


def write_made_runs(folder):
    """Write two sequences of 40 s at 20 Hz, and two runs each of three systems."""
    times = 1_600_000_000 + np.arange(800) / 20
    for number, sequence in enumerate(("hall", "yard")):
        t = np.arange(800) / 20 * (0.3 + 0.1 * number)
        positions = np.column_stack([4 * np.cos(t), 3 * np.sin(t), np.sin(2 * t) + 0.05 * t])
        turns = np.column_stack([0.3 * np.sin(2 * t), 0.2 * np.cos(3 * t), t])
        gt = poses(Rotation.from_rotvec(turns), positions)
        write_tum(folder / sequence / "groundtruth.txt", times, gt)
        for run in range(2):
            rng = np.random.default_rng([number, run])
            keyframes = np.flatnonzero(rng.random(800) < 0.15)
            systems = {
                "frames": (slice(20, 780), 0.0, 0.02),
                "keyframes": (keyframes, 0.0, 0.01),
                "late": (slice(100, 700), 0.05, 0.02),
            }
            for system, (rows, delay, sigma) in systems.items():
                est = disturbed(gt, rng, sigma, 1.0)
                est[:, :3, 3] = 0.5 * est[:, :3, 3] + 7
                write_tum(
                    folder / sequence / system / f"{run}.txt", (times + delay)[rows], est[rows]
                )


def write_real_runs(folder):
    """Write 40 s of two EuRoC sequences, and fr2/desk and KITTI 00 thinned.

    They are cut from ``shared/real``, whose licences keep the files out of the repository; its
    README says where they come from.
    """
    for sequence, start in SEQUENCES.items():
        files = ["groundtruth.txt", *(f"{s}/{i}.txt" for s, k in SYSTEMS.items() for i in range(k))]
        for file in files:
            lines = _lines(REAL / "euroc" / sequence / file)
            piece = (line for line in lines if start <= float(line.split()[0]) < start + 40)
            _write_lines(folder / sequence / file, piece)
    for name, step in (("groundtruth", 5), ("ORB", 10), ("ORB_kf_mono", 1)):
        lines = _lines(REAL / f"fr2_desk_{name}.txt")[::step]
        _write_lines(folder / "fr2_desk" / f"{name}.txt", lines)
    for name in ("gt", "ORB", "SPTAM"):
        _write_lines(
            folder / "KITTI_00" / f"{name}.txt", _lines(REAL / f"KITTI_00_{name}.txt")[::12]
        )


def poses(rotations, positions):
    """Return matrices (n, 4, 4)."""
    matrices = np.tile(np.eye(4), (len(positions), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = rotations.as_matrix(), positions
    return matrices


def disturbed(gt, rng, sigma, degrees):
    """Return poses with normal errors of these standard deviations along each axis."""
    errors = Rotation.from_rotvec(rng.normal(0, degrees, (len(gt), 3)), degrees=True)
    est = poses(errors, gt[:, :3, 3] + rng.normal(0, sigma, (len(gt), 3)))
    est[:, :3, :3] @= gt[:, :3, :3]
    return est


def write_tum(path, times, matrices):
    """Write ``timestamp tx ty tz qx qy qz qw``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    quaternions = Rotation.from_matrix(matrices[:, :3, :3]).as_quat()
    np.savetxt(path, np.column_stack([times, matrices[:, :3, 3], quaternions]), fmt="%.12f")


def _lines(path):
    return [line for line in path.read_text().splitlines() if not line.startswith("#")]


def _write_lines(path, lines):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
