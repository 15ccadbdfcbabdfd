"""All metrics of the paper by its names, evaluated side by side on one scene."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from alignscores import pas, ras, tas
from baselines import ate, dre, dte, maa, rotation_statistics

from .cameras import Scene
from .config import ROTATION_STATISTICS, split_metric

__all__ = ["evaluate"]


def evaluate(
    scene: Scene, metrics: Sequence[str], registration_seed: np.random.SeedSequence
) -> dict[str, float]:
    """Evaluate metrics on a scene.

    Parameters
    ----------
    scene : Scene
        Ground-truth and estimated cameras.
    metrics : sequence of str
        Names out of `experiments.config.METRICS`, possibly with options: "TAS(max_threshold=0.5)".
    registration_seed : SeedSequence
        Seed of the random registration in TAS and PAS, the same for all of them.

    Returns
    -------
    dict of str to float
        The values, in the order of `metrics`. ATE in ground-truth units, rotation errors in
        degrees, the rest without unit.

    Notes
    -----
    Cameras that are missing in the estimate count as failures in TAS, RAS, PAS and mAA. ATE, DTE,
    DRE and the rotation statistics have no value for them and are evaluated on the other cameras
    alone, as is usual: to lose a bad camera improves them.
    """
    values: dict[str, float] = {}
    for metric in sorted(metrics, key=lambda metric: metric != "PAS"):  # which has TAS and RAS
        if metric not in values:
            name, options = split_metric(metric)
            values |= _evaluate(name, options, metric, scene, registration_seed)
    return {metric: values[metric] for metric in metrics}


def _evaluate(
    name: str, options: dict[str, Any], metric: str, scene: Scene, seed: np.random.SeedSequence
) -> dict[str, float]:
    """Evaluate one metric, with those that come with it; `metric` is its name with the options."""
    if name == "PAS":
        scores = pas(scene.gt_poses, scene.est_poses, rng=seed, **options)
        return {metric: scores.score, "TAS": scores.tas.score, "RAS": scores.ras.score}
    if name == "TAS":
        result = tas(scene.gt_positions, scene.est_positions, rng=seed, **options)
        return {metric: result.score}
    if name == "RAS":
        return {metric: ras(scene.gt_rotations, scene.est_rotations, **options).score}
    if name == "mAA":
        return {metric: maa(scene.gt_poses, scene.est_poses, **options)}
    scene = scene.estimated
    if name == "ATE":
        return {metric: ate(scene.gt_positions, scene.est_positions)}
    if name == "DTE":
        return {metric: dte(scene.gt_poses, scene.est_poses)}
    if name == "DRE":
        return {metric: dre(scene.gt_rotations, scene.est_rotations)}
    assert name in ROTATION_STATISTICS
    return rotation_statistics(scene.gt_rotations, scene.est_rotations)
