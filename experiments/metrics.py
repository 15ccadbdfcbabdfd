"""All metrics of the paper by its names, evaluated side by side on one scene."""

from collections.abc import Sequence

import numpy as np

from alignscores import pas, ras, tas
from baselines import ate, dre, dte, maa, rotation_statistics

from .cameras import Scene
from .config import ROTATION_STATISTICS

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
        Names out of `experiments.config.METRICS`.
    registration_seed : SeedSequence
        Seed of the random registration in TAS and PAS.

    Returns
    -------
    dict of str to float
        The values, in the order of `metrics`. ATE in ground-truth units, rotation errors in
        degrees, the rest without unit.
    """
    values: dict[str, float] = {}
    if "PAS" in metrics:
        scores = pas(scene.gt_poses, scene.est_poses, rng=registration_seed)
        values |= {"PAS": scores.score, "TAS": scores.tas.score, "RAS": scores.ras.score}
    elif "TAS" in metrics:
        values["TAS"] = tas(scene.gt_positions, scene.est_positions, rng=registration_seed).score
    if "RAS" in metrics and "RAS" not in values:
        values["RAS"] = ras(scene.gt_rotations, scene.est_rotations).score
    if "ATE" in metrics:
        values["ATE"] = ate(scene.gt_positions, scene.est_positions)
    if "DTE" in metrics:
        values["DTE"] = dte(scene.gt_poses, scene.est_poses)
    if "mAA" in metrics:
        values["mAA"] = maa(scene.gt_poses, scene.est_poses)
    if "DRE" in metrics:
        values["DRE"] = dre(scene.gt_rotations, scene.est_rotations)
    if any(name in metrics for name in ROTATION_STATISTICS):
        values |= rotation_statistics(scene.gt_rotations, scene.est_rotations)
    return {name: values[name] for name in metrics}
