"""The medoid of rotations: however it is searched, the same as from all distances."""

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores.averaging import rotation_angles, tlud_mean
from alignscores.medoid import medoid


def sums_of_distances(rotations):
    flat = rotations.reshape(-1, 9)
    parts = np.array_split(flat, 1 + len(flat) // 100)  # which fit in the cache
    distances = (scipy.spatial.distance.cdist(part, flat) for part in parts)
    return np.concatenate([np.minimum(part, 0.5).sum(axis=1) for part in distances])


@settings(max_examples=60)
@given(
    seed=st.integers(0, 10_000),
    n=st.one_of(st.integers(1, 60), st.integers(300, 900), st.integers(2001, 2400)),
    noise_deg=st.sampled_from([0.0, 1e-7, 1e-3, 0.1, 1.0, 5.0, 20.0, 180.0]),
    outliers=st.sampled_from([0.0, 0.1, 0.48, 0.9]),
    agree=st.booleans(),
    drift_deg=st.sampled_from([0.0, 1.0, 40.0]),
)
def test_no_rotation_is_cheaper_than_the_medoid(seed, n, noise_deg, outliers, agree, drift_deg):
    """With noise of any size, a drift, and any share of outliers, which may agree."""
    rng = np.random.default_rng(seed)
    path = Rotation.from_rotvec(np.cumsum(rng.normal(0, drift_deg / n**0.5, (n, 3)), axis=0))
    noise = Rotation.from_rotvec(rng.normal(0, noise_deg, (n, 3)), degrees=True)
    rotations, k = (path * noise).as_matrix(), int(outliers * n)
    others = (
        Rotation.from_euler("x", 90, degrees=True) * noise if agree else Rotation.random(n, rng=rng)
    )
    rotations[:k] = others.as_matrix()[:k]
    sums = sums_of_distances(rotations)
    with pytest.MonkeyPatch.context() as patch:  # bounds, in parts as of 5000 rotations
        patch.setattr("alignscores.medoid.N_ALL_PAIRS", 2000)
        patch.setattr("alignscores.medoid.AT_ONCE", 25 * n)
        assert sums[medoid(rotations)] <= sums.min() + 1e-11 * n


@pytest.mark.parametrize(("seed", "n"), [(0, 2000), (1, 2000), (2, 5100)])
def test_the_medoid_where_one_in_twenty_agrees(seed, n):
    rng = np.random.default_rng(seed)
    rotations = Rotation.random(n, rng=rng).as_matrix()
    rotations[:100] = Rotation.from_rotvec(rng.normal(0, 0.15, (100, 3))).as_matrix()
    sums = sums_of_distances(rotations)
    assert medoid(rotations) == np.argmin(sums)


@pytest.mark.parametrize("noise", [0.0, 1e-16])
def test_many_rotations_that_coincide(noise):
    """Compared in pairs they would take minutes."""
    rotation = Rotation.from_euler("z", 30, degrees=True).as_matrix()
    rotations = rotation + noise * np.random.default_rng(0).normal(size=(50_000, 3, 3))
    assert rotation_angles((tlud_mean(rotations) @ rotation.T)[None])[0] < 1e-9
