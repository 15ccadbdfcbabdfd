"""Time TAS and RAS against other programs: ``python -m benchmarks``."""

import argparse
import ctypes
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from timeit import Timer

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from alignscores import ras, tas
from alignscores.arrays import Floats
from experiments.scenes import make_scene

__all__ = ["main"]

SIZES = 10, 100, 1000, 10_000
SHORTEST = 0.02  # seconds; what is quicker is called several times a turn
SIGMA_T = 0.03
N_HYPOTHESES = 1000
RUNS = 3  # of each of two versions
ROOT = Path(__file__).parents[1]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print milliseconds of processor time, the least of several turns in which all take part."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--largest", type=int, default=SIZES[-1], help="cameras (10000)")
    parser.add_argument(
        "--scenes", type=int, default=1000, help="small scenes, one after the other (1000)"
    )
    parser.add_argument("--turns", type=int, default=10, help="turns; the least counts (10)")
    against = "checkout of another version, compiled there; its times stand in brackets"
    parser.add_argument("--against", metavar="FOLDER", type=Path, help=against)
    options = parser.parse_args(arguments)
    if options.against and not (options.against / "alignscores/__init__.py").is_file():
        parser.error(f"argument --against: {options.against} is not a checkout of alignscores")
    if options.against:
        return compare(options)
    columns = {f"{n:,}": draw(1, n) for n in SIZES if n <= options.largest}
    columns[f"{options.scenes:,} x 20"] = draw(options.scenes, 20)
    try:
        with threadpool_limits(limits=1):
            times = [measure(contenders(*poses), options.turns) for poses in columns.values()]
    except (ImportError, FileNotFoundError) as error:
        needs = "a C compiler, and pip install -e '.[bench]'"
        parser.exit(1, f"benchmarks: {error}; they need {needs}\n")
    print("milliseconds", *columns, sep=" | ")
    for name in times[0]:
        print(name, *(f"{1000 * column[name]:.3g}" for column in times), sep=" | ")
    return 0


def compare(options: argparse.Namespace) -> int:
    """Print the medians of runs of two versions in turns, the other one's in brackets."""
    sizes = [f"--{name}={vars(options)[name]}" for name in ("largest", "scenes", "turns")]
    command = [sys.executable, "-P", __file__, *sizes]
    runs: list[list[pd.DataFrame]] = [[], []]
    for _ in range(RUNS):
        for folder, tables in zip((ROOT, options.against), runs, strict=True):
            variables = {**os.environ, "PYTHONPATH": str(folder.resolve())}
            process = subprocess.run(command, env=variables, check=False, stdout=subprocess.PIPE)
            if process.returncode:  # it has printed why
                return process.returncode
            tables.append(pd.read_csv(BytesIO(process.stdout), sep=r" \| ", engine="python"))
    ours, other = (
        pd.concat(tables).groupby("milliseconds", sort=False).median() for tables in runs
    )
    print("milliseconds", *ours, sep=" | ")
    for name in ours.index:
        pairs = zip(ours.loc[name].tolist(), other.loc[name].tolist(), strict=True)
        print(name, *(f"{time:.3g} ({others:.3g})" for time, others in pairs), sep=" | ")
    return 0


def draw(n_scenes: int, n_cameras: int) -> tuple[Floats, Floats]:
    """Return ground truth and estimate of scenes, (n_scenes, n_cameras, 4, 4), 30 % outliers."""
    scenes = [
        make_scene(
            np.random.default_rng([seed, n_cameras]),
            geometry="cube",
            volume=0.1 * n_cameras,
            n_cameras=n_cameras,
            n_outliers=round(0.3 * n_cameras),
            sigma_t=SIGMA_T,
            sigma_r_deg=3.0,
        )
        for seed in range(n_scenes)
    ]
    return (
        np.array([scene.gt_poses for scene in scenes]),
        np.array([scene.est_poses for scene in scenes]),
    )


def contenders(gt: Floats, est: Floats) -> dict[str, Callable[[], object]]:
    """Return what is measured by its name: all scenes, one after the other."""
    import pycolmap
    from evo.core.geometry import umeyama_alignment

    options = pycolmap.RANSACOptions(
        max_error=3 * SIGMA_T, min_num_trials=N_HYPOTHESES, max_num_trials=N_HYPOTHESES
    )
    clouds = list(zip(gt[..., :3, 3].copy(), est[..., :3, 3].copy(), strict=True))
    least_squares = [(a.T.copy(), b.T.copy(), True) for a, b in clouds]
    frames = [(a[:, :3, :3].copy(), b[:, :3, :3].copy()) for a, b in zip(gt, est, strict=True)]
    return {
        "TAS": lambda: [tas(*pair) for pair in clouds],
        "TAS, refined": lambda: [tas(*pair, registration="refined") for pair in clouds],
        "RAS": lambda: [ras(*pair) for pair in frames],
        "pycolmap, robust": lambda: [
            pycolmap.estimate_sim3d_robust(*pair, options) for pair in clouds
        ],
        "evo, least squares": lambda: [umeyama_alignment(*pair) for pair in least_squares],
        "C loop": inlier_counter(clouds),
    }


def inlier_counter(clouds: list[tuple[Floats, Floats]]) -> Callable[[], None]:
    """Compile floor.c, and return a function that counts the inliers of all hypotheses with it."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "floor.so"
        source = Path(__file__).with_name("floor.c")
        flags = ["-O3", "-march=native", "-shared", "-fPIC"]
        subprocess.run(["cc", *flags, "-o", library, source], check=True)
        count_inliers = ctypes.CDLL(str(library)).count_inliers
    doubles = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    count_inliers.argtypes = [doubles, ctypes.c_size_t, doubles, doubles, ctypes.c_size_t]
    count_inliers.argtypes += [ctypes.c_double, np.ctypeslib.ndpointer(np.intc)]
    hypotheses = np.random.default_rng(0).normal(size=(N_HYPOTHESES, 3, 4))
    counts = np.zeros(N_HYPOTHESES, dtype=np.intc)
    stacks = [(gt.T.copy(), est.T.copy()) for gt, est in clouds]

    def count() -> None:
        for gt, est in stacks:
            count_inliers(hypotheses, N_HYPOTHESES, gt, est, gt.shape[1], 0.01, counts)

    return count


def measure(calls: dict[str, Callable[[], object]], turns: int) -> dict[str, float]:
    """Return the least processor time of each in seconds; what else the machine does hits all."""
    best = dict.fromkeys(calls, np.inf)
    for _ in range(turns):
        for name, call in calls.items():
            timer = Timer(call, timer=time.process_time)
            number = max(1, round(SHORTEST / timer.timeit(1)))
            best[name] = min(best[name], timer.timeit(number) / number)
    return best


if __name__ == "__main__":
    sys.exit(main())
