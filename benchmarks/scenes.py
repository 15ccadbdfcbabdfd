"""Measure many small scenes at once: ``python -m benchmarks.scenes``."""

import argparse
import importlib.util
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from alignscores import AlignmentWarning, pas_batch, ras_batch, tas_batch
from alignscores.arrays import Floats
from alignscores.protocols import vggt_auc, vggt_auc_batch
from experiments.scenes import make_scene
from experiments.tables import write_files

from .__main__ import machine, markdown
from .contenders import SIGMA_T
from .floor import compiled_loop, counter

__all__: list[str] = []

N_CAMERAS = 20
TURNS = 3

PAGE = """\
# Benchmarks of many scenes

Written by `python -m benchmarks.scenes`: seconds for {n_scenes:,} scenes of
{n_cameras} poses (a cube, 30 % outliers, 3 cm and 3 degrees of noise), each the median of {turns}
turns in which all take part. Processor time of one thread, BLAS on one thread, 1000 hypotheses,
seed 0. The ratios are those of one turn, and mean more than the times.

Machine: {machine}.

{table}

Least squares is the alignment alone, by pycolmap (extra `bench`), by evo, or by NumPy for all at
once; any outlier moves it. pycolmap's robust estimation has 1000 trials. The floor
([floor.c](../../benchmarks/floor.c)) counts the inliers of 1000 given hypotheses.

With two threads the busier one takes {share:.2f} of the time of one, for the refined TAS.
"""


def main() -> int:
    """Measure all and write the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.scenes",
        description="Measure many small scenes at once; write scene-benchmarks.md.",
    )
    parser.add_argument("--output", type=Path, default=Path("docs"), help="folder (docs)")
    parser.add_argument("--scenes", type=int, default=1000, help="their number (1000)")
    options = parser.parse_args()
    gt, est = scenes(options.scenes)
    calls = contenders(gt, est)
    with threadpool_limits(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        turns = [{name: clock(call) for name, call in calls.items()} for _ in range(TURNS)]
        share = busier_share(gt, est)
    rows = [
        [
            name,
            f"{statistics.median(turn[name] for turn in turns):.3g}",
            *(_ratio(turns, name, other) for other in ("pycolmap, robust", "floor")),
        ]
        for name in calls
    ]
    table = markdown(["", "seconds", "/ pycolmap, robust", "/ floor"], rows)
    page = options.output / "reference" / "scene-benchmarks.md"
    text = PAGE.format(
        n_scenes=options.scenes,
        n_cameras=N_CAMERAS,
        turns=TURNS,
        machine=machine(),
        table=table,
        share=share,
    )
    write_files({page: text.encode()})
    print(page)
    return 0


def scenes(n_scenes: int) -> tuple[Floats, Floats]:
    """Return ground truth and estimate of scenes, (B, n, 4, 4)."""
    made = [
        make_scene(
            np.random.default_rng(seed),
            geometry="cube",
            volume=0.1 * N_CAMERAS,
            n_cameras=N_CAMERAS,
            n_outliers=round(0.3 * N_CAMERAS),
            sigma_t=SIGMA_T,
            sigma_r_deg=3.0,
        )
        for seed in range(n_scenes)
    ]
    return np.array([one.gt_poses for one in made]), np.array([one.est_poses for one in made])


def contenders(gt: Floats, est: Floats) -> dict[str, Callable[[], object]]:
    """Return what is measured, by its name."""
    worlds = gt[..., :3, 3].copy(), est[..., :3, 3].copy()
    turned = gt[..., :3, :3].copy(), est[..., :3, :3].copy()
    calls: dict[str, Callable[[], object]] = {
        "`tas_batch`": lambda: tas_batch(*worlds),
        "`tas_batch`, refined": lambda: tas_batch(*worlds, registration="refined"),
        "`ras_batch`": lambda: ras_batch(*turned),
        "`pas_batch`, refined": lambda: pas_batch(gt, est, registration="refined"),
        "`pas_batch`, refined, with distances": lambda: pas_batch(
            gt, est, registration="refined", distances=True
        ),
        "`vggt_auc_batch`": lambda: vggt_auc_batch(gt, est, 30),
        "`vggt_auc`, one by one": lambda: [
            vggt_auc(*pair, 30) for pair in zip(gt, est, strict=True)
        ],
        "NumPy, least squares": lambda: least_squares(*worlds),
    }
    if importlib.util.find_spec("evo"):
        from evo.core.geometry import umeyama_alignment

        calls["evo, least squares"] = lambda: [
            umeyama_alignment(a.T, b.T, True) for a, b in zip(*worlds, strict=True)
        ]
    if importlib.util.find_spec("pycolmap"):
        import pycolmap

        options = pycolmap.RANSACOptions(
            max_error=3 * SIGMA_T, min_num_trials=1000, max_num_trials=1000
        )
        calls["pycolmap, least squares"] = lambda: [
            pycolmap.estimate_sim3d(a, b) for a, b in zip(*worlds, strict=True)
        ]
        calls["pycolmap, robust"] = lambda: [
            pycolmap.estimate_sim3d_robust(a, b, options) for a, b in zip(*worlds, strict=True)
        ]
    if (library := compiled_loop()) is not None:
        count = counter(library, np.zeros((1000, 3, 4)), worlds[0][0], worlds[1][0], 0.01)
        calls["floor"] = lambda: [count() for _ in worlds[0]]
    return calls


def least_squares(gt: Floats, est: Floats) -> Any:
    """Return scale and rotation of the least-squares similarity of each scene."""
    a, b = (world - world.mean(axis=1, keepdims=True) for world in (gt, est))
    u, s, vt = np.linalg.svd(b.swapaxes(1, 2) @ a)
    signs = np.ones_like(s)
    signs[:, 2] = np.linalg.det(u @ vt)
    return (s * signs).sum(axis=1) / (a * a).sum(axis=(1, 2)), (u * signs[:, None]) @ vt


def clock(call: Callable[[], object]) -> float:
    """Return the processor time of a call in seconds."""
    start = time.process_time()
    call()
    return time.process_time() - start


def busier_share(gt: Floats, est: Floats) -> float:
    """Return the time of the calling thread with two threads, relative to that with one."""

    def calling(threads: int) -> float:
        start = time.thread_time()
        tas_batch(gt[..., :3, 3], est[..., :3, 3], registration="refined", threads=threads)
        return time.thread_time() - start

    return statistics.median(calling(2) for _ in range(TURNS)) / statistics.median(
        calling(1) for _ in range(TURNS)
    )


def _ratio(turns: list[dict[str, float]], name: str, other: str) -> str:
    """Return the median ratio of two in the same turn; a dash where one is not there."""
    if other not in turns[0]:
        return "–"
    return f"{statistics.median(turn[name] / turn[other] for turn in turns):.2f}"


if __name__ == "__main__":
    sys.exit(main())
