"""Common to all test modules: levels, reference values, factories of scenes, and the command."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib.abc import MetaPathFinder
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from scipy.spatial.transform import Rotation

from alignscores.arrays import Floats

from .files import EXAMPLES, REAL, write_tum

collect_ignore = ["snakemake_warm.py"]  # loads all experiments, for processes that Snakemake needs

os.environ["COLUMNS"] = "100"  # of tables; pytest-xdist sets 80

TESTS = Path(__file__).resolve().parent
REFERENCE = (  # the second has further cases of 200 cameras and more
    TESTS / "data" / "published.npz",
    TESTS.parents[1] / "shared" / "reference" / "alignment_scores_octave.npz",
)

# The processes that run tests in parallel inherit it, and the programs that they start: further
# threads of BLAS would only spin until a core is free.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Fonts and sources that programs keep for later: no test depends on the home directory.
os.environ["XDG_CACHE_HOME"] = str(TESTS.parent / ".pytest_cache" / "programs")
# Without it each of the many programs that tests start would compile the project anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


class SkipWithoutWheel(MetaPathFinder):
    """Asked last: a test that imports pycolmap is skipped where there is none, as on ARM Linux."""

    def find_spec(self, fullname, path, target=None):
        """Skip."""
        if fullname == "pycolmap":
            pytest.skip("pycolmap is not installed", allow_module_level=True)


sys.meta_path.append(SkipWithoutWheel())

# Same examples in every run, and no time limit for each: the machine may be busy.
settings.register_profile("alignscores", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("alignscores")


@pytest.hookimpl(optionalhook=True)  # a release tests its wheels without pytest-xdist
def pytest_xdist_auto_num_workers():
    """One process more than cores: some tests wait for the programs that they have started."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items):
    """Mark each test with its level, its folder; begin with the longest: no process waits then."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)
    for item in items:
        if TESTS in item.path.parents:
            item.add_marker(item.path.relative_to(TESTS).parts[0])


@dataclass(frozen=True)
class ReferenceCase:
    """One trajectory with the outputs of the published implementation; ``case["d_threshold"]``."""

    name: str
    meta: Mapping[str, Any]
    arrays: Mapping[str, Floats]

    def __getitem__(self, array):
        return self.arrays[array]


@pytest.fixture(scope="session")
def reference_cases():
    """All cases of the reference files by name."""
    cases = {}
    for path in filter(Path.exists, REFERENCE):
        with np.load(path, allow_pickle=False) as file:
            for text in file["cases"]:
                meta = json.loads(str(text))
                prefix = meta["case"] + "/"
                arrays = {k.removeprefix(prefix): file[k] for k in file if k.startswith(prefix)}
                cases[meta["case"]] = ReferenceCase(meta["case"], meta, arrays)
    return cases


@pytest.fixture
def reference_case(request, reference_cases):
    """One case, named by ``@pytest.mark.parametrize("reference_case", [...], indirect=True)``."""
    if request.param not in reference_cases:
        pytest.skip(f"{request.param} is not in {REFERENCE[0].name}")
    return reference_cases[request.param]


@pytest.fixture(scope="session")
def in_notebook():
    """(result) -> the HTML that a notebook shows of it."""
    return lambda result: result._repr_html_()


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


def _cloud(shape, n, seed):
    rng = np.random.default_rng([seed, n])
    t = np.arange(n, dtype=float)
    zero = np.zeros(n)
    tilt = Rotation.random(rng=rng)
    if shape == "cube":
        return rng.random((n, 3)) - 0.5
    if shape == "axis":
        return np.column_stack([t, zero, zero])
    if shape == "oblique line":
        return tilt.apply(np.column_stack([t, zero, zero]))
    if shape == "plane":
        return np.column_stack([rng.random((n, 2)), zero])
    if shape == "oblique plane":
        return tilt.apply(np.column_stack([rng.random((n, 2)), zero]))
    if shape == "helix":  # the golden angle: no cameras line up
        return np.column_stack([np.cos(2.4 * t), np.sin(2.4 * t), t / 20])
    if shape == "clusters":  # standard deviations from 0.001 to 1
        return rng.normal(size=(n, 3)) * 10.0 ** -(t[:, None] % 4) + 3 * (t[:, None] % 4)
    if shape == "straight then bend":  # the first half lies exactly on a line
        half = n // 2
        bend = 0.1 * np.arange(1, n - half + 1)
        curve = np.column_stack([np.sin(bend), 1 - np.cos(bend), 0.05 * bend])
        line = np.column_stack([0.1 * np.arange(half) - 0.1 * (half - 1), np.zeros((half, 2))])
        return tilt.apply(np.vstack([line, curve]))
    raise ValueError(shape)


@pytest.fixture(scope="session")
def cloud():
    """(shape, n, seed) -> (n, 3) ground-truth positions of about unit size."""
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
    """(arguments, before=) -> the command in a new process, after some code."""

    def process(*arguments, before="pass", **environment):
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
        turn = np.column_stack([np.zeros((n, 2)), np.sin(times / 2), np.cos(times / 2)])
        poses = np.column_stack([times, path + noise, turn])
        np.savetxt(tmp_path / name, np.delete(poses, slice(*lost), axis=0))
        return tmp_path / name

    return tum


@pytest.fixture(scope="session")
def scored(tmp_path_factory):
    """A folder of results: many tests compare the same runs."""
    return tmp_path_factory.mktemp("scored")


@pytest.fixture
def run_compare(tmp_path, command, monkeypatch, scored):
    """(arguments) -> as `command`, of ``compare``, in a new folder."""
    monkeypatch.chdir(tmp_path)
    return partial(command, "compare", "--cache", scored)


@pytest.fixture
def compare(run_compare):
    """(arguments) -> the JSON output."""

    def compare(*arguments):
        return json.loads(run_compare(*arguments, "--jobs", 1, "--json")[1])

    return compare


@pytest.fixture
def benchmark_of(tmp_path):
    """(systems, sequences, runs, n) -> patterns of a benchmark that is written, in TUM format.

    `systems` are sigma_t, sigma_r_deg, every so many frames, and the share that is lost at the end.
    """

    from experiments.scenes import make_scene  # as above

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


@pytest.fixture
def patterns(benchmark_of, tmp_path):
    """A benchmark of two systems; the second lacks a run."""
    files = benchmark_of({"a_b": (0.1, 1.0, 1, 0.0), "c": (0.3, 3.0, 1, 0.0)}, n=60)
    (tmp_path / "car/c/2.txt").unlink()
    return files
