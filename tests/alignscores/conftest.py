"""Factories of trajectories for the tests of the scores."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

EXAMPLES = Path(__file__).resolve().parents[1] / "data"
REAL = Path(__file__).resolve().parents[3] / "shared" / "real"


@pytest.fixture(scope="session")
def examples():
    """Folder of the example trajectories, one scene in every format."""
    return EXAMPLES


@pytest.fixture(scope="session")
def real():
    """Folder of the real trajectories; skips where it is not there."""
    if not REAL.is_dir():
        pytest.skip(f"no real trajectories at {REAL}")
    return REAL


def _cloud(kind, n, seed):
    rng = np.random.default_rng([seed, n])
    t = np.arange(n, dtype=float)
    zero = np.zeros(n)
    tilt = Rotation.random(rng=rng)
    if kind == "cube":
        return rng.random((n, 3)) - 0.5
    if kind == "axis":
        return np.column_stack([t, zero, zero])
    if kind == "oblique line":
        return tilt.apply(np.column_stack([t, zero, zero]))
    if kind == "plane":
        return np.column_stack([rng.random((n, 2)), zero])
    if kind == "oblique plane":
        return tilt.apply(np.column_stack([rng.random((n, 2)), zero]))
    if kind == "helix":  # the golden angle: no cameras line up
        return np.column_stack([np.cos(2.4 * t), np.sin(2.4 * t), t / 20])
    if kind == "clusters":  # standard deviations from 0.001 to 1
        return rng.normal(size=(n, 3)) * 10.0 ** -(t[:, None] % 4) + 3 * (t[:, None] % 4)
    if kind == "straight then bend":  # the first half lies exactly on a line
        half = n // 2
        bend = 0.1 * np.arange(1, n - half + 1)
        curve = np.column_stack([np.sin(bend), 1 - np.cos(bend), 0.05 * bend])
        line = np.column_stack([0.1 * np.arange(half) - 0.1 * (half - 1), np.zeros((half, 2))])
        return tilt.apply(np.vstack([line, curve]))
    raise ValueError(kind)


@pytest.fixture(scope="session")
def cloud():
    """(kind, n, seed) -> (n, 3) ground-truth positions of about unit size."""
    return _cloud


@pytest.fixture(scope="session")
def another_world():
    """(positions, seed, scale=, offset=) -> the positions after a random similarity."""

    def transform(positions, seed, *, scale=2.5, offset=10.0):
        rng = np.random.default_rng([seed, 1])
        moved = Rotation.random(rng=rng).apply(positions)
        return scale * (moved + offset * rng.uniform(-1, 1, 3))

    return transform


@pytest.fixture(scope="session")
def noisy_scene(another_world):
    """(n, outliers, sigma, seed) -> ground truth in a unit cube and estimate in another world.

    The last cameras of the estimate are outliers in a cube of side 10.
    """

    def make(n, outliers, sigma, seed):
        rng = np.random.default_rng([seed, n, outliers])
        gt = rng.random((n, 3)) - 0.5
        est = gt + rng.normal(0, sigma, (n, 3))
        est[n - outliers :] = rng.uniform(-5, 5, (outliers, 3))
        return gt, another_world(est, seed)

    return make


@pytest.fixture(scope="session")
def noisy_rotations():
    """(n, outliers, sigma_deg, seed) -> rotations and their estimate in another world."""

    def make(n, outliers, sigma_deg, seed):
        rng = np.random.default_rng([seed, n, outliers, 2])
        gt = Rotation.random(n, rng=rng)
        noise = Rotation.from_rotvec(rng.normal(0, sigma_deg, (n, 3)), degrees=True)
        est = (Rotation.random(rng=rng) * noise * gt).as_matrix()
        if outliers:  # SciPy 1.15 makes no array of no rotations
            est[n - outliers :] = Rotation.random(outliers, rng=rng).as_matrix()
        return gt.as_matrix(), est

    return make


@pytest.fixture
def command(capsys):
    """(arguments) -> exit code, stdout, stderr of the command line."""
    from alignscores.cli import main  # not where the kernel of a wheel is tested

    def command(*arguments):
        try:
            code = main(list(map(str, arguments)))
        except SystemExit as stop:
            code = stop.code
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return command


@pytest.fixture
def write(tmp_path):
    """(lines or content, name) -> path of a file with them."""

    def write(content, name="est.txt"):
        path = tmp_path / name
        content = "\n".join(content) if isinstance(content, list) else content
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write
