"""Geometric median, geodesic L1 and L2 mean: reference values, optimality, coincidence."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores.averaging import geodesic_l1_means, rotation_angles
from baselines.averages import geometric_medians, rotation_l1_means, rotation_l2_means


def test_geometric_median_equals_reference(reference_cases):
    """The jitter of the published code, in one case, is below the tolerance."""
    for case in reference_cases.values():
        for cloud in ("gt", "est"):
            points = case[f"{cloud}_xyz"]
            median = geometric_medians(points[None])[0]
            np.testing.assert_allclose(median, case[f"geomed_{cloud}"], rtol=0, atol=1e-12 * 100)
            distance = np.median(np.linalg.norm(points - median, axis=1))
            assert distance == pytest.approx(float(case[f"geomed_{cloud}_median_dist"]), rel=1e-9)


def test_l1_mean_equals_reference(reference_cases):
    """`l1_R`, which takes the estimate to the ground truth, and the residual angles.

    Not where the published code added jitter: there the rotations are exact.
    """
    compared = 0
    for case in reference_cases.values():
        if case.meta["dte_jitter_in_l1"]:
            continue
        gt, est = case["gt_R"], case["est_R"]
        mean = rotation_l1_means((gt @ est.transpose(0, 2, 1))[None])[0]
        np.testing.assert_allclose(mean, case["l1_R"], rtol=0, atol=1e-12)
        errors = rotation_angles((mean @ est).transpose(0, 2, 1) @ gt)
        np.testing.assert_allclose(errors, case["l1_err_deg"], rtol=0, atol=1e-9)
        compared += 1
    assert compared == len(reference_cases) - 2


@pytest.mark.parametrize(("majority", "outliers"), [(4, 1), (3, 2), (6, 4), (60, 40), (2, 0)])
def test_l1_mean_rests_on_a_majority(majority, outliers):
    """Passing over the coincident rotations would throw the mean at the outliers."""
    rng = np.random.default_rng(majority)
    rotations = np.tile(np.eye(3), (majority + outliers, 1, 1))
    if outliers:
        rotations[:outliers] = Rotation.random(outliers, rng=rng).as_matrix()
    stacks, identity = rotations[None], np.eye(3)[None]
    np.testing.assert_array_equal(rotation_l1_means(stacks), identity)
    np.testing.assert_array_equal(geodesic_l1_means(stacks, identity), identity)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 30), outliers=st.integers(0, 10))
def test_l2_mean_is_stationary(seed, n, outliers):
    """The log maps add up to nothing."""
    rng = np.random.default_rng(seed)
    rotations = Rotation.from_rotvec(rng.normal(0, 10, (n, 3)), degrees=True).as_matrix()
    outliers = min(outliers, n // 2)
    if outliers:
        rotations[:outliers] = Rotation.random(outliers, rng=rng).as_matrix()
    mean = rotation_l2_means(rotations[None])[0]
    step = Rotation.from_matrix(rotations @ mean.T).as_rotvec().mean(axis=0)
    assert np.linalg.norm(step) < 1e-11
    np.testing.assert_allclose(mean @ mean.T, np.eye(3), atol=1e-13)
