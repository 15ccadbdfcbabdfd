"""Score of a perfect estimate under a reference that has errors itself."""

import warnings

import numpy as np
import scipy

from ..arrays import Floats
from ..pose import pas
from ..validation import AlignmentWarning
from .settings import Settings

__all__ = ["simulated_scores"]

DRAWS = 19  # a perfect estimate is below all of them in one of 20 cases


def simulated_scores(poses: Floats, unit: float, settings: Settings) -> dict[str, list[float]]:
    """Return mean and lowest TAS, RAS and PAS of true poses that differ from the reference.

    The errors are normal and independent, with the standard deviations of `reference_sigma`.
    """
    assert isinstance(settings.reference_sigma, tuple)
    sigma, sigma_deg = settings.reference_sigma
    rng = np.random.default_rng(settings.seed)
    scores = []
    for _ in range(DRAWS):
        true = poses.copy()
        true[:, :3, 3] += sigma * rng.standard_normal((len(poses), 3))
        turns = np.radians(sigma_deg) * rng.standard_normal((len(poses), 3))
        true[:, :3, :3] @= scipy.spatial.transform.Rotation.from_rotvec(turns).as_matrix()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AlignmentWarning)  # of so few frames; it scores 0
            result = pas(
                poses,
                true,
                rng=settings.seed,
                unit=unit,
                weight=settings.weight,
                max_threshold_deg=settings.max_threshold_deg,
                registration=settings.registration,
                **settings.tas_options,
            )
        scores.append((result.tas.score, result.ras.score, result.score))
    columns = zip(("TAS", "RAS", "PAS"), np.transpose(scores), strict=True)
    return {name: [float(values.mean()), float(values.min())] for name, values in columns}
