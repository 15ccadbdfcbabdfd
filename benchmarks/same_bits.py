"""Compare scenes at once with one by one, bit for bit: ``python -m benchmarks.same_bits``.

Random scenes of 0 to 60 cameras of which up to all are lost, degenerate ones among them.
"""

import argparse
import sys
import warnings
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, PASResult, pas, pas_batch, ras_angle, tas_distance
from alignscores.arrays import Floats

__all__ = ["differences", "random_scenes"]

KINDS = "cloud", "line", "grid", "bend", "places", "plane", "large", "tiny", "one place", "far off"
SETTINGS: tuple[dict[str, Any], ...] = (
    {},
    {"registration": "refined", "distances": True},
    {"registration": "refined", "alignment": "rigid", "unit": 1.0, "distances": True},
    {"alignment": "yaw", "up": "y", "unit": 1.0},
    {"alignment": "none", "unit": 1.0, "distances": True},
)


def random_scenes(n_scenes: int) -> tuple[list[Floats], list[Floats]]:
    """Return poses of scenes, (n, 4, 4) each, and their estimates."""
    pairs = [_scene(np.random.default_rng(seed), seed % len(KINDS)) for seed in range(n_scenes)]
    return [gt for gt, _ in pairs], [est for _, est in pairs]


def differences(scenes: tuple[list[Floats], list[Floats]], **settings: Any) -> list[int]:
    """Return the scenes whose results differ from those that they have alone."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        batch = pas_batch(*scenes, **settings)
        alone = {k: v for k, v in settings.items() if k not in ("distances", "threads")}
        group = {k: v for k, v in settings.items() if k in ("alignment", "up")}
        wrong = []
        for index, (gt, est) in enumerate(zip(*scenes, strict=True)):
            try:
                expected = pas(gt, est, **alone)
            except ValueError:  # no cameras, or no d
                same = bool(np.isnan(batch.score[index]))
            else:
                same = batch.score[index] == expected.score and _same(batch[index], expected)
            if len(gt) and settings.get("distances"):
                assert batch.tas.distances is not None
                assert batch.ras.angles is not None
                distance = tas_distance(gt[:, :3, 3], est[:, :3, 3], **group)
                angle = ras_angle(gt[:, :3, :3], est[:, :3, :3], **group)
                found = batch.tas.distances[index], batch.ras.angles[index]
                same = same and np.array_equal(found, (distance, angle), equal_nan=True)
            if not same:
                wrong.append(index)
    return wrong


def _same(a: PASResult, b: PASResult) -> bool:
    return all(
        np.array_equal(x, y, equal_nan=True)
        for result, other in ((a.tas, b.tas), (a.ras, b.ras))
        for x, y in (
            (result.errors, other.errors),
            (result.thresholds, other.thresholds),
            (result.cumulative_frequency, other.cumulative_frequency),
            (_numbers(result.alignment), _numbers(other.alignment)),
        )
    ) and (a.tas.unit, a.tas.n_hypotheses) == (b.tas.unit, b.tas.n_hypotheses)


def _numbers(alignment: Any) -> Floats:
    """Return the numbers of an alignment of positions or rotations."""
    if alignment is None or isinstance(alignment, np.ndarray):
        return np.asarray([] if alignment is None else alignment)
    return np.hstack([alignment.scale, alignment.rotation.ravel(), alignment.translation])


def _scene(rng: np.random.Generator, kind: int) -> tuple[Floats, Floats]:
    n = int(rng.integers(61))
    gt = np.tile(np.eye(4), (n, 1, 1))
    if n == 0:
        return gt, gt
    positions = rng.normal(size=(n, 3))
    match KINDS[kind]:
        case "line":
            positions[:, 1:] = 0
        case "grid":
            positions = rng.integers(4, size=(n, 3)).astype(float)
        case "bend":
            positions[: n // 2, 1:] = 0
        case "places":
            positions = positions[np.arange(n) % 3]
        case "plane":
            positions[:, 2] = 0
        case "large":
            positions *= 1e150
        case "tiny":
            positions *= 1e-160
        case "far off":
            positions += 1e6
    gt[:, :3, 3] = positions
    gt[:, :3, :3] = Rotation.random(n, rng=rng).as_matrix()
    est = gt.copy()
    spread = np.abs(positions).max() or 1.0
    est[:, :3, 3] += rng.choice([0, 1e-9, 0.01, 0.1]) * spread * rng.normal(size=(n, 3))
    turns = rng.choice([0, 0.01, 0.1, 0.5]) * rng.normal(size=(n, 3))
    est[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix() @ est[:, :3, :3]
    wrong = rng.random(n) < rng.choice([0, 0.1, 0.3, 0.6, 0.95])
    est[wrong] = est[rng.permutation(n)[wrong]]
    world = Rotation.random(rng=rng).as_matrix()
    est[:, :3] = world @ est[:, :3]
    est[:, :3, 3] *= np.exp(rng.normal())
    if KINDS[kind] == "one place":
        est[:, :3, 3] = 1
    est[rng.random(n) < rng.choice([0, 0, 0.05, 0.3, 0.7, 1])] = np.nan
    return gt, est


def main() -> int:
    """Compare all scenes under all settings, on one and two threads."""
    from tqdm import tqdm  # which the scenes, in the tests of the library, do without

    parser = argparse.ArgumentParser(prog="python -m benchmarks.same_bits", description=__doc__)
    parser.add_argument("--scenes", type=int, default=10_000, help="their number (10000)")
    scenes = random_scenes(parser.parse_args().scenes)
    wrong = 0
    for settings in tqdm(SETTINGS, disable=None):
        for threads in (1, 2):
            found = differences(scenes, threads=threads, **settings)
            print(f"{settings}, {threads} threads: {len(found)} of {len(scenes[0])} differ")
            wrong += len(found)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
