"""Estimates of several models: reconstructions of one scene, each in its own coordinate frame.

TAS, RAS and PAS of a set are those of its best model, with all images that are not in it missing:
an estimate is one coordinate frame, and cutting it into parts that are aligned apart does not raise
its TAS. COLMAP's AUC of relative poses takes the pairs of all models.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Indices
from ..io import FileError, FilePath, Trajectory
from .evaluation import Evaluation, Model
from .match import match
from .reading import read_estimate
from .settings import Settings

__all__ = ["ModelPoses", "in_order", "poses_of_models", "read_models"]

Estimate = FilePath | Trajectory | Mapping[str, Trajectory]


@dataclass(frozen=True, eq=False)
class ModelPoses:
    """The poses of m models, row by row the images of the reference."""

    est_poses: Floats  # (m, n, 4, 4); not finite for images that a model lacks
    outliers: Indices  # (m,) number of images in each that the reference lacks


def read_models(estimate: Estimate, settings: Settings) -> dict[str, Trajectory]:
    """Return the models of an estimate by name, camera-to-world: all, or the one in the settings.

    An estimate that is a single model, or of a format without models, is one without a name.
    """
    models: Mapping[str, Trajectory] = {}
    if isinstance(estimate, Mapping):
        models = estimate
    elif not isinstance(estimate, Trajectory) and settings.est_file_format.read_models:
        models = settings.est_file_format.read_models(estimate)
    if settings.model is not None and settings.model not in models:
        has = f"its models are {', '.join(models)}" if models else "it is a single model"
        where = "the estimate" if isinstance(estimate, (Trajectory, Mapping)) else estimate
        raise FileError(where, f"has no model {settings.model!r}: {has}")
    if not models and not isinstance(estimate, Mapping):
        return {"": read_estimate(estimate, settings)}
    names = models if settings.model is None else [settings.model]
    return {name: read_estimate(models[name], settings) for name in names}


def poses_of_models(
    reference: Trajectory, models: Mapping[str, Trajectory], settings: Settings
) -> ModelPoses:
    """Return the poses of models for the images of a reference."""
    stacked, outliers = [], []
    for poses in models.values():
        try:
            matches = match(reference, poses.with_rotations(), settings)
        except ValueError:  # no image in common
            n = int(np.isfinite(reference.poses).all(axis=(1, 2)).sum())
            stacked.append(np.full((n, 4, 4), np.nan))
            outliers.append(len(poses.keys))
        else:
            stacked.append(matches.est_poses)
            outliers.append(matches.unmatched)
    return ModelPoses(np.stack(stacked), np.array(outliers))


def in_order(
    models: Mapping[str, Trajectory], poses: ModelPoses, scored: Mapping[str, Evaluation]
) -> tuple[Model, ...]:
    """Return a row a model, the one with the best PAS first, without rotations the best TAS."""
    covered = np.isfinite(poses.est_poses).all(axis=(2, 3)).mean(axis=1)
    rows = []
    for (name, poses_of_model), coverage in zip(models.items(), covered.tolist(), strict=True):
        scores = scored[name].scores if name in scored else {}
        of_name = {key: scores.get(key) for key in ("TAS", "RAS", "PAS")}
        rows.append(Model(name, len(poses_of_model.keys), coverage, **of_name))

    def score(model: Model) -> tuple[float, float]:
        main = model.TAS if model.PAS is None else model.PAS
        return -1.0 if main is None else main, model.coverage

    return tuple(sorted(rows, key=score, reverse=True))
