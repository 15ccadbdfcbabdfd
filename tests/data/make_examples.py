"""Make the example trajectories in this folder: one scene in every format.

A camera goes round a loop of 40 poses, looking about. The estimate lives in a world of its own
(scale, rotation, origin) with 2 cm and 1 degree of noise; 3 poses are far off, 2 were not
estimated, and one is NaN where the format can tell it. ``python tests/data/make_examples.py`` makes
the files again.
"""

import json
from pathlib import Path

import numpy as np
import pycolmap
from scipy.spatial.transform import Rotation

FOLDER = Path(__file__).parent
N, MISSING, LOST, OUTLIERS = 40, (5, 17), 9, (3, 21, 30)
START, RATE = 1_700_000_000, 10  # seconds, poses a second


def scene():
    """Return the reference and the estimated poses (n, 4, 4), camera-to-world, OpenCV axes."""
    rng = np.random.default_rng(5)
    t = np.linspace(0, 2 * np.pi, N, endpoint=False)
    gt = np.tile(np.eye(4), (N, 1, 1))
    gt[:, :3, 3] = np.column_stack([4 * np.cos(t), 3 * np.sin(t), np.sin(2 * t)])
    heading = Rotation.from_euler("z", t[:, None])
    nod = Rotation.from_euler("xy", np.column_stack([0.6 * np.sin(3 * t), 0.4 * np.cos(2 * t)]))
    gt[:, :3, :3] = (heading * nod * Rotation.from_euler("x", -90, degrees=True)).as_matrix()

    world = Rotation.from_rotvec([0.5, -1.2, 0.8])
    noise = Rotation.from_rotvec(rng.normal(0, 1, (N, 3)), degrees=True)
    positions = gt[:, :3, 3] + rng.normal(0, 0.02, (N, 3))
    positions[list(OUTLIERS)] += rng.normal(0, 3, (len(OUTLIERS), 3))
    est = np.tile(np.eye(4), (N, 1, 1))
    est[:, :3, 3] = 0.7 * world.apply(positions) + [10.0, -5.0, 2.0]
    est[:, :3, :3] = (world * noise * Rotation.from_matrix(gt[:, :3, :3])).as_matrix()
    return gt, est


def estimated():
    """Return the rows of the estimate that there are."""
    return [row for row in range(N) if row not in MISSING]


def write_tum(path, poses, rows, delay, *, lost):
    """Write ``timestamp tx ty tz qx qy qz qw``."""
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for row in rows:
        values = [*poses[row, :3, 3], *quaternions[row]]
        if lost and row == LOST:
            values = [np.nan] * 7
        lines.append(f"{START + row / RATE + delay:.6f} " + " ".join(f"{x:.12f}" for x in values))
    path.write_text("\n".join(lines) + "\n")


def write_euroc(path, poses):
    """Write a reference as EuRoC's data.csv; the velocities and biases are zero."""
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=True)
    lines = ["#timestamp, p_x [m], p_y, p_z, q_w [], q_x, q_y, q_z, v (3), b_w (3), b_a (3)"]
    for row, (pose, quaternion) in enumerate(zip(poses, quaternions, strict=True)):
        values = ",".join(f"{x:.12f}" for x in [*pose[:3, 3], *quaternion, *np.zeros(9)])
        lines.append(f"{START * 10**9 + row * 10**9 // RATE},{values}")
    path.write_text("\n".join(lines) + "\n")


def write_kitti(path, poses, lost=()):
    """Write the upper three rows of each matrix; those that are lost as NaN."""
    rows = poses[:, :3].reshape(-1, 12).copy()
    rows[list(lost)] = np.nan
    path.write_text("".join(" ".join(f"{x:.12f}" for x in row) + "\n" for row in rows))


def write_nerf(path, poses, rows):
    """Write transforms.json with OpenGL camera axes."""
    frames = [
        {
            "file_path": f"./images/{row:04d}.png",
            "transform_matrix": (poses[row] @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist(),
        }
        for row in rows
    ]
    path.write_text(json.dumps({"camera_angle_x": 0.9, "frames": frames}, indent=1) + "\n")


def colmap_model(poses, rows):
    """Return a model without points."""
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model="PINHOLE", width=640, height=480, params=[500, 500, 320, 240], camera_id=1
    )
    model.add_camera_with_trivial_rig(camera)
    for row in rows:
        image = pycolmap.Image(name=f"{row:04d}.png", camera_id=1, image_id=row + 1)
        pose = pycolmap.Rigid3d(np.linalg.inv(poses[row])[:3])
        model.add_image_with_trivial_frame(image, pose)
    return model


def main():
    """Write all files."""
    gt, est = scene()
    everything = list(range(N))
    found = [row for row in estimated() if row != LOST]  # images and frames are there or not
    for name in ("tum", "kitti", "euroc", "nerf", "colmap/reference", "colmap/estimate"):
        (FOLDER / name).mkdir(parents=True, exist_ok=True)
    write_tum(FOLDER / "tum/reference.txt", gt, everything, 0.0, lost=False)
    write_tum(FOLDER / "tum/estimate.txt", est, estimated(), 0.002, lost=True)
    write_euroc(FOLDER / "euroc/data.csv", gt)
    write_tum(FOLDER / "euroc/estimate.txt", est, estimated(), 0.002, lost=True)
    write_kitti(FOLDER / "kitti/reference.txt", gt)
    write_kitti(FOLDER / "kitti/estimate.txt", est, (*MISSING, LOST))
    write_nerf(FOLDER / "nerf/reference.json", gt, everything)
    write_nerf(FOLDER / "nerf/estimate.json", est, found)
    colmap_model(gt, everything).write_text(str(FOLDER / "colmap/reference"))
    colmap_model(est, found).write_binary(str(FOLDER / "colmap/estimate"))


if __name__ == "__main__":
    main()
