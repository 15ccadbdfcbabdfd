"""Closed-form similarities between point sets, many at once, as the protocols fit them."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Indices

__all__ = ["ERRORS_AT_ONCE", "Fit", "Transform", "block_size", "fit", "random_triplets"]

ERRORS_AT_ONCE = 1 << 15  # 256 KiB, which stay in the cache


@dataclass(frozen=True, eq=False)
class Transform:
    """Similarities ``target = scale * rotation @ source + translation``, one or many."""

    scale: Floats  # (...)
    rotation: Floats  # (..., 3, 3)
    translation: Floats  # (..., 3)

    def __getitem__(self, index: int) -> "Transform":
        return Transform(self.scale[index], self.rotation[index], self.translation[index])

    @classmethod
    def joined(cls, parts: Iterable["Transform"]) -> "Transform":
        """Put single similarities in one."""
        parts = list(parts)
        fields = ("scale", "rotation", "translation")
        return cls(*(np.stack([getattr(part, name) for part in parts]) for name in fields))

    def squared_distances(self, source: Floats, target: Floats) -> Floats:
        """Return the squared distances (..., n) between the moved source and the target."""
        offsets = (self.scale[..., None, None] * self.rotation) @ source.T
        offsets += self.translation[..., None]
        offsets -= target.T
        return np.asarray(np.einsum("...kn,...kn->...n", offsets, offsets))

    def distances(self, source: Floats, target: Floats) -> Floats:
        """Return the distances (..., n) between the moved source and the target."""
        return np.asarray(np.sqrt(self.squared_distances(source, target)))


@dataclass(frozen=True, eq=False)
class Fit:
    """The best rotations from source to target, and the moments that the scales follow from."""

    rotation: Floats
    source_mean: Floats
    target_mean: Floats
    source_variance: Floats  # mean squared distance from the mean
    target_variance: Floats
    correlation: Floats  # mean scalar product of target and rotated source, both from their means

    def rigid(self) -> Transform:
        """Return the motion without a scale."""
        return self._with(np.ones_like(self.correlation))

    def least_squares(self) -> Transform:
        """Return the similarity with the smallest squared errors in the target."""
        return self._with(self.correlation / self.source_variance)

    def inverse_least_squares(self) -> Transform:
        """Return the inverse of the similarity with the smallest squared errors in the source."""
        return self._with(self.target_variance / self.correlation)

    def _with(self, scale: Floats) -> Transform:
        turned = (self.rotation @ self.source_mean[..., None])[..., 0]
        return Transform(scale, self.rotation, self.target_mean - scale[..., None] * turned)


def fit(source: Floats, target: Floats) -> Fit:
    """Fit rotations between centred (..., k, 3) point sets by the SVD of their covariance.

    Where points coincide the scales are not finite. Source: Umeyama, "Least-squares estimation of
    transformation parameters between two point patterns", PAMI 1991.
    """
    source_mean, target_mean = source.mean(axis=-2), target.mean(axis=-2)
    x, y = source - source_mean[..., None, :], target - target_mean[..., None, :]
    number = source.shape[-2]
    covariance = np.einsum("...ki,...kj->...ij", y, x) / number
    u, values, vt = np.linalg.svd(covariance)
    sign = np.sign(np.linalg.det(u @ vt))
    u[..., 2] *= sign[..., None]
    values[..., 2] *= sign
    return Fit(
        rotation=u @ vt,
        source_mean=source_mean,
        target_mean=target_mean,
        source_variance=np.asarray(np.einsum("...ki,...ki->...", x, x) / number),
        target_variance=np.asarray(np.einsum("...ki,...ki->...", y, y) / number),
        correlation=np.asarray(values.sum(axis=-1)),
    )


def block_size(n: int) -> int:
    """Return how many similarities of n cameras are evaluated at once."""
    return max(1, ERRORS_AT_ONCE // max(n, 1))


def random_triplets(n: int, count: int, rng: np.random.Generator) -> Indices:
    """Draw `count` times three different numbers below n."""
    first, second, third = (rng.integers(n - k, size=count) for k in range(3))
    second += second >= first
    third += third >= np.minimum(first, second)
    third += third >= np.maximum(first, second)
    return np.stack([first, second, third], axis=1)
