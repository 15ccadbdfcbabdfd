"""All metrics of the paper by its names, evaluated side by side on one scene."""

from collections.abc import Sequence
from functools import cached_property
from math import ceil, floor, inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from alignscores import AlignmentScore, Similarity, ras, tas
from alignscores.histogram import equal_steps
from alignscores.registration import Registration, pcr99
from alignscores.translation import closest_pair_distances
from baselines import ate, dre, dte, maa, rotation_statistics

from .cameras import Scene
from .config import ROTATION_STATISTICS, split_metric

__all__ = ["Evaluation", "evaluate"]

Floats = NDArray[np.float64]


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
    evaluation = Evaluation(scene, registration_seed)
    return {metric: evaluation.value(metric) for metric in metrics}


class Evaluation:
    """One scene under many metrics, which share what they have in common.

    There is one alignment for each choice of registration, and one set of errors, however many
    thresholds and weights these are scored with: metrics are compared on the same errors.

    Parameters
    ----------
    scene : Scene
        Ground-truth and estimated cameras.
    registration_seed : SeedSequence
        Seed of the random registration.
    """

    def __init__(self, scene: Scene, registration_seed: np.random.SeedSequence) -> None:
        self._scene = scene
        self._seed = registration_seed
        self._position_errors: dict[tuple[object, ...], Floats] = {}

    def value(self, metric: str) -> float:
        """Evaluate a metric, given by its name, possibly with options."""
        name, options = split_metric(metric)
        match name:
            case "TAS":
                return self._tas(**options)
            case "RAS":
                return self._ras(**options)
            case "PAS":
                return self._pas(**options)
            case "mAA":
                return maa(self._scene.gt_poses, self._scene.est_poses, **options)
        scene = self._scene.estimated  # those below have no value for a camera that is missing
        match name:
            case "ATE":
                return ate(scene.gt_positions, scene.est_positions)
            case "DTE":
                return dte(scene.gt_poses, scene.est_poses)
            case "DRE":
                return dre(scene.gt_rotations, scene.est_rotations)
        assert name in ROTATION_STATISTICS
        return self._rotation_statistics[name]

    def _tas(
        self,
        *,
        max_threshold: float = 1.0,
        n_thresholds: float = 100,
        quantile: float = 0.75,
        **registration: Any,
    ) -> float:
        unit = self._unit(quantile)
        errors = self._errors_of(unit, max_threshold, **registration)
        return _score(errors, unit, max_threshold, n_thresholds)

    def _ras(self, *, max_threshold_deg: float = 10.0, n_thresholds: float = 100) -> float:
        return _score(self._rotation_errors, 1.0, max_threshold_deg, n_thresholds)

    def _pas(self, *, weight: float = 0.5, **registration: Any) -> float:
        return weight * self._tas(**registration) + (1 - weight) * self._ras()

    def _errors_of(
        self,
        unit: float,
        max_threshold: float,
        *,
        registration: str = "pcr99",
        n_hypotheses: int = 1000,
        seed: int | None = None,
        **options: float,
    ) -> Floats:
        """Position errors under a registration, computed once for each."""
        # PCR-99 knows nothing of the thresholds.
        target = None if registration == "pcr99" else unit * max_threshold
        key = (registration, n_hypotheses, seed, target, *sorted(options.items()))
        if key not in self._position_errors:
            scene = self._scene
            self._position_errors[key] = tas(
                scene.gt_positions,
                scene.est_positions,
                rng=self._registration_seed(seed),
                unit=unit,
                n_hypotheses=n_hypotheses,
                max_threshold=max_threshold,
                registration=self._pcr99(**options) if options else registration,
            ).errors
        return self._position_errors[key]

    def _registration_seed(self, seed: int | None) -> np.random.SeedSequence:
        """Return the scene's seed, or one of its children."""
        if seed is None:
            return self._seed
        return np.random.SeedSequence(self._seed.entropy, spawn_key=(*self._seed.spawn_key, seed))

    def _pcr99(self, *, order: float = 0.1, prescreen: float = 0.1) -> Registration:
        """Return the paper's registration with another prescreening threshold or another m."""
        m = max(4, floor(_exact(order * len(self._scene.gt_positions)) + 0.5))

        def register(
            gt: Floats, est: Floats, /, *, order: int, **settings: Any
        ) -> tuple[Similarity | None, int]:
            return pcr99(gt, est, order=min(m, len(gt)), prescreen=prescreen, **settings)

        return register

    def _unit(self, quantile: float) -> float:
        """Return d of the paper for any quantile, an order statistic."""
        rank = ceil(_exact(quantile * len(self._closest_pairs)))
        return float(self._closest_pairs[rank - 1])

    @cached_property
    def _closest_pairs(self) -> Floats:
        return np.sort(closest_pair_distances(self._scene.gt_positions))

    @cached_property
    def _rotation_errors(self) -> Floats:
        return ras(self._scene.gt_rotations, self._scene.est_rotations).errors

    @cached_property
    def _rotation_statistics(self) -> dict[str, float]:
        scene = self._scene.estimated
        return rotation_statistics(scene.gt_rotations, scene.est_rotations)


def _score(errors: Floats, unit: float, largest: float, count: float) -> float:
    """Score errors; with infinitely many thresholds it is the area under a straight line."""
    if count == inf:
        return float(np.clip(1 - errors / (unit * largest), 0, None).mean())
    return AlignmentScore(errors, unit * equal_steps(largest, int(count), "largest")).score


def _exact(product: float) -> float:
    """Take the rounding error off a share of a number: 0.07 of 100 is 7, not a little more."""
    return round(product, 9)
