"""Example trajectories, and functions that write others, for the tests of all levels."""

import json
import shutil
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

EXAMPLES = Path(__file__).resolve().parent / "data"
REAL = Path(__file__).resolve().parents[2] / "shared" / "real"
FILES = {
    "tum": ("tum/reference.txt", "tum/estimate.txt"),
    "kitti": ("kitti/reference.txt", "kitti/estimate.txt"),
    "euroc": ("euroc/data.csv", "euroc/estimate.txt"),
    "colmap": ("colmap/reference", "colmap/estimate"),
    "nerf": ("nerf/reference.json", "nerf/estimate.json"),
}
TUM, KITTI, COLMAP = ((name, *FILES[name]) for name in ("tum", "kitti", "colmap"))
# Each camera of the reference has the pose of its own stamp, or none.
AT_STAMPS = "--sync", "nearest", "--max_gap", 0


def write_tum(path, rotations, positions, keep=slice(None)):
    """Write poses, 0.1 s apart."""
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations, positions
    write_stamped(path, np.arange(len(poses))[keep] / 10, poses[keep])


def write_stamped(path, stamps, poses):
    """Write poses, also those that are not finite, in the format TUM."""
    quaternions = np.full((len(poses), 4), np.nan)
    finite = np.isfinite(poses).all(axis=(1, 2))
    quaternions[finite] = Rotation.from_matrix(poses[finite, :3, :3]).as_quat()
    np.savetxt(path, np.column_stack([stamps, poses[:, :3, 3], quaternions]), fmt="%.17g")


def write_model(path, names, poses):
    """Write a COLMAP model with these images, camera-to-world, and the cameras of the example."""
    path.mkdir(parents=True)
    for file in ("cameras.txt", "points3D.txt"):
        shutil.copy(EXAMPLES / "colmap/reference" / file, path)
    lines = []
    for number, (name, pose) in enumerate(zip(names, poses, strict=True), 1):
        quaternion = Rotation.from_matrix(pose[:3, :3].T).as_quat(scalar_first=True)
        translation = -pose[:3, :3].T @ pose[:3, 3]
        numbers = " ".join(map(repr, [*quaternion.tolist(), *translation.tolist()]))
        lines += [f"{number} {numbers} 1 {name}", ""]
    (path / "images.txt").write_text("\n".join([*lines, ""]))


def write_nerf(path, names, poses):
    matrices = (poses @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist()  # OpenGL's camera axes
    frames = [
        {"file_path": str(name), "transform_matrix": matrix}
        for name, matrix in zip(names, matrices, strict=True)
    ]
    path.write_text(json.dumps({"frames": frames}))


write_poses = {  # (path, keys, poses) of a format
    "tum": write_stamped,
    "euroc": write_stamped,
    "kitti": lambda path, _, poses: np.savetxt(path, poses[:, :3].reshape(-1, 12), fmt="%.17g"),
    "colmap": write_model,
    "nerf": write_nerf,
}
