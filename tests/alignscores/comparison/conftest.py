"""Made benchmarks: systems of known quality over sequences and runs, in TUM format."""

import json
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from experiments.scenes import make_scene


@pytest.fixture
def run(tmp_path, command, monkeypatch):
    """(arguments) -> exit code, stdout, stderr; in a folder and with a cache of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return partial(command, "compare")


@pytest.fixture
def compare(run):
    """(arguments) -> the JSON output."""

    def compare(*arguments):
        return json.loads(run(*arguments, "--jobs", 1, "--json")[1])

    return compare


@pytest.fixture
def benchmark_of(tmp_path):
    """(systems, sequences, runs, n) -> patterns of a benchmark that is written.

    `systems` are sigma_t, sigma_r_deg, every so many frames, and the share that is lost at the end.
    """

    def benchmark_of(systems, sequences=("car", "helix"), runs=3, n=120):
        for index, geometry in enumerate(sequences):
            for system, (sigma_t, sigma_r, step, lost) in systems.items():
                for number in range(runs):
                    seed = [index, *system.encode(), number]
                    errors = np.random.default_rng(seed)
                    scene = make_scene(  # the first draws are of the path
                        np.random.default_rng([index]),
                        geometry=geometry,
                        n_cameras=n,
                        n_outliers=0,
                        sigma_t=0.0,
                        sigma_r_deg=0.0,
                    )
                    turns = Rotation.from_rotvec(
                        errors.normal(scale=np.radians(sigma_r) / np.sqrt(3), size=(n, 3))
                    )
                    rotations = turns.as_matrix() @ scene.gt_rotations
                    positions = scene.gt_positions + errors.normal(scale=sigma_t, size=(n, 3))
                    keep = slice(0, round(n * (1 - lost)), step)
                    folder = tmp_path / geometry
                    (folder / system).mkdir(parents=True, exist_ok=True)
                    write_tum(folder / "gt.txt", scene.gt_rotations, scene.gt_positions)
                    write_tum(folder / system / f"{number}.txt", rotations, 3 * positions + 1, keep)
        return "tum", "{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"

    return benchmark_of


def write_tum(path, rotations, positions, keep=slice(None)):
    """Write poses, 0.1 s apart."""
    stamps = np.arange(len(positions)) / 10
    quaternions = Rotation.from_matrix(rotations).as_quat()
    np.savetxt(path, np.column_stack([stamps, positions, quaternions])[keep])
