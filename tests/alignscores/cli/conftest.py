"""The command line in the folder of the examples, and files made for it."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

FILES = {
    "tum": ("tum/reference.txt", "tum/estimate.txt"),
    "kitti": ("kitti/reference.txt", "kitti/estimate.txt"),
    "euroc": ("euroc/data.csv", "euroc/estimate.txt"),
    "colmap": ("colmap/reference", "colmap/estimate"),
    "nerf": ("nerf/reference.json", "nerf/estimate.json"),
}


@pytest.fixture
def run(examples, command, monkeypatch):
    """(arguments) -> exit code, stdout, stderr; in the folder of the examples."""
    monkeypatch.chdir(examples)
    return command


@pytest.fixture
def score(run):
    """(arguments) -> the results of the JSON output."""

    def score(*arguments):
        code, out, _ = run(*arguments, "--json")
        assert code == 0
        return json.loads(out)["results"]

    return score


@pytest.fixture
def process(examples, tmp_path):
    """(arguments, before=) -> the command in a process of its own, after some code."""

    def process(*arguments, before="", **environment):
        code = f"import sys; {before}; from alignscores.cli import main; sys.exit(main())"
        return subprocess.run(
            [sys.executable, "-c", code, *arguments],
            cwd=examples,
            env={**os.environ, "HOME": str(tmp_path), **environment},
            capture_output=True,
            text=True,
            timeout=100,
        )

    return process


@pytest.fixture
def lines(examples):
    """The lines of the TUM estimate: 38 poses, 0.1 s apart."""
    return (examples / "tum/estimate.txt").read_text().splitlines()[1:]


@pytest.fixture
def kitti(tmp_path):
    """(poses, name) -> path of a KITTI file with them."""

    def kitti(poses, name="estimate.txt"):
        np.savetxt(tmp_path / name, poses[:, :3].reshape(-1, 12))
        return tmp_path / name

    return kitti


@pytest.fixture
def tum(tmp_path):
    """(n, rate, name, lost=) -> a TUM file of a helix; the reference is that of a rate of 10."""

    def tum(n, rate, name, lost=(0, 0)):
        times = np.arange(n) / rate
        path = np.column_stack([np.cos(times), np.sin(times), times])
        noise = np.random.default_rng(n).normal(0, 0.01, (n, 3)) if "est" in name else 0.0
        poses = np.column_stack([times, path + noise, np.zeros((n, 3)), np.ones(n)])
        np.savetxt(tmp_path / name, np.delete(poses, slice(*lost), axis=0))
        return tmp_path / name

    return tum
