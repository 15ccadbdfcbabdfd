"""Write the flight of the documentation: a drone's 75 s at 10 Hz, and what four systems make of it.

``python make.py [FOLDER]`` writes the files next to this script, or those in another folder:

- ``groundtruth.txt``: the reference, as of motion capture
- ``vio.txt``: a pose a frame, in another frame and 3 % too large, with drift, 6 s without poses and
  three wrong relocalisations
- ``mono.txt``: a monocular system's keyframes, of unknown scale
- ``late.txt``: like ``vio.txt``, without its outliers and gap, but 80 ms late
- ``inverted.txt``: world-to-camera poses

``python make.py runs FOLDER`` writes a benchmark instead: five runs of three systems on two
sequences of 40 s. All are synthetic, and their seeds are fixed.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

START = 1_700_000_000.0
CAMERA = Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # looks ahead, y down


def flight(phase=0.5):
    """Return stamps, positions and rotations: 2 s on the ground, then loops in a hall."""
    t = np.arange(750) / 10
    s = np.where(t < 2, 0, (t - 2) ** 2 / (t + 2)) * 2 * np.pi / 70
    positions = np.column_stack(
        [3 * np.sin(2 * s), 2 * np.sin(3 * s + phase), 1.3 - 0.9 * np.cos(s)]
    )
    angles = np.column_stack([1.5 * np.sin(s) + s, 0.15 * np.sin(5 * s), 0.2 * np.sin(4 * s)])
    return START + t, positions, Rotation.from_euler("ZYX", angles) * CAMERA


def disturbed(truth, rng, drift, noise):
    """Return the poses with errors in metres: a random walk to ``drift``, and independent noise.

    The rotations drift and scatter by 0.2 radians for each metre.
    """
    times, positions, rotations = truth
    steps = rng.normal(scale=drift / np.sqrt(len(times)), size=(len(times), 6))
    errors = np.cumsum(steps, axis=0) + rng.normal(scale=noise, size=steps.shape)
    turned = Rotation.from_rotvec(0.2 * errors[:, 3:])
    return times, positions + errors[:, :3], turned * rotations


def moved(poses, scale, rotation, origin):
    """Return the poses in another frame."""
    times, positions, rotations = poses
    return times, scale * rotation.apply(positions) + origin, rotation * rotations


def rows(poses, index):
    """Return some of the poses."""
    times, positions, rotations = poses
    return times[index], positions[index], rotations[index]


def vio(truth, rng, drift=0.08):
    """Return a visual-inertial estimate: right vertical axis, heading and origin of its own."""
    poses = disturbed(truth, rng, drift, 0.004)
    return moved(poses, 1.03, Rotation.from_euler("z", 0.7), [4.0, -2.0, 0.3])


def mono(truth, rng, drift=0.03):
    """Return a monocular estimate: keyframes 0.3 to 1.6 s apart, of unknown scale."""
    poses = disturbed(truth, rng, drift, 0.01)
    keyframes = np.cumsum(rng.integers(3, 17, size=150))
    poses = rows(poses, keyframes[keyframes < len(truth[0])])
    return moved(poses, 0.41, Rotation.from_rotvec([0.4, -1.1, 0.8]), [0.2, 0.1, 1.0])


def with_failures(poses, rng):
    """Return the poses without 6 s of them, and with three wrong relocalisations."""
    times, positions, rotations = poses
    wrong = np.array([140, 141, 520])
    positions[wrong] += rng.normal(scale=1.2, size=(3, 3))
    turned = Rotation.from_rotvec(rng.normal(size=(3, 3)))
    rotations[wrong] = turned * rotations[wrong]
    return rows((times, positions, rotations), (times < START + 33) | (times >= START + 39))


def inverted(poses):
    """Return world-to-camera poses."""
    times, positions, rotations = poses
    return times, -rotations.inv().apply(positions), rotations.inv()


def write(path, poses):
    """Write a file of the format TUM."""
    times, positions, rotations = poses
    path.parent.mkdir(parents=True, exist_ok=True)
    table = np.column_stack([times, positions, rotations.as_quat(canonical=True)])
    header = "timestamp tx ty tz qx qy qz qw"
    np.savetxt(path, table, fmt=["%.2f", *3 * ["%.3f"], *4 * ["%.4f"]], header=header)


def write_flight(folder):
    """Write the five files."""
    truth = flight()
    rng = np.random.default_rng(1)
    write(folder / "groundtruth.txt", truth)
    write(folder / "vio.txt", with_failures(vio(truth, rng), rng))
    write(folder / "mono.txt", mono(truth, rng))
    times, *others = vio(truth, rng)
    write(folder / "late.txt", (times + 0.08, *others))
    write(folder / "inverted.txt", inverted(vio(truth, rng)))


def write_runs(folder):
    """Write two sequences with five runs each of three systems."""
    systems = {"mono": mono, "vio": vio, "vio_tuned": lambda truth, rng: vio(truth, rng, 0.07)}
    for number, sequence in enumerate(("hall", "atrium")):
        truth = rows(flight(phase=0.5 + number), slice(400))
        write(folder / sequence / "groundtruth.txt", truth)
        for index, (system, estimate) in enumerate(systems.items()):
            for run in range(1, 6):
                rng = np.random.default_rng([number, index, run])
                write(folder / sequence / system / f"{run}.txt", estimate(truth, rng))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["runs", folder]:
            write_runs(Path(folder))
        case []:
            write_flight(Path(__file__).parent)
        case [folder]:
            write_flight(Path(folder))
        case _:
            sys.exit("usage: make.py [FOLDER], or make.py runs FOLDER")
