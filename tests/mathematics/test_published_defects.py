"""The defects of the published implementations that method.md lists: we have none of them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, ras, tas

both_registrations = pytest.mark.parametrize("registration", ["pcr99", "refined"])


@both_registrations
@pytest.mark.timeout(20)
@pytest.mark.parametrize("n", [4, 19, 20, 100, 300])
def test_no_endless_loop(registration, n):
    """Published: waits for 1000 hypotheses for ever."""
    gt = np.random.default_rng(n).random((n, 3))
    est = np.zeros((n, 3))
    est[:2, 0] = [1, 2]  # three distinct positions on a line, unlike the ground truth
    if registration == "refined":  # it starts from least-squares fits, too
        assert 0 < tas(gt, est, registration=registration).score < 0.6
        return
    with pytest.warns(AlignmentWarning):
        assert tas(gt, est, registration=registration).score == 0


@pytest.mark.parametrize("n", [12, 60, 400])
@pytest.mark.parametrize("world", ["gt", "est", "both"])
def test_duplicate_positions(cloud, n, world):
    """Published: their NaN log-ratios pass the prescreen. Here half of the cameras coincide."""
    gt = cloud("cube", n, 0)
    est = 2 * gt
    for array in {"gt": [gt], "est": [est], "both": [gt, est]}[world]:
        array[n // 2 :] = array[0]
    result = tas(gt, est, n_hypotheses=500)
    assert result.alignment is not None
    assert result.alignment.scale == pytest.approx(2, rel=1e-6)
    assert result.score == pytest.approx(1.0 if world == "both" else 0.5, abs=0.03)


@both_registrations
@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, -1], [3, 0, 4], [1, 2, 3]])
@pytest.mark.parametrize("n", [4, 10, 50, 300])
def test_exactly_collinear_ground_truth(registration, axis, n):
    """Published: NaN for every hypothesis. Scored like any other, noise and outliers included."""
    rng = np.random.default_rng(n)
    gt = np.outer(np.arange(n), np.array(axis) / np.linalg.norm(axis))
    est = Rotation.random(rng=rng).apply(5 * (gt + rng.normal(0, 0.01, (n, 3)))) + 7
    n_inliers = n - n // 5
    est[n_inliers:] += rng.normal(0, 50, (n - n_inliers, 3))
    assert tas(gt, 3 * gt + 1, registration=registration).score == 1.0
    result = tas(gt, est, registration=registration)
    assert np.isfinite(result.errors).all()
    assert np.median(result.errors[:n_inliers]) < 0.1
    assert result.score > 0.6


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 19, 100, 255, 1000])
def test_exact_rotations_score_one(noisy_rotations, n):
    """Published: 0/0 in the rotation average, so that a perfect estimate can score 0.

    So can one whose rotations are all far apart; ours takes one of them as the average.
    """
    for seed in range(3):
        gt, est = noisy_rotations(n, 0, 0, seed)
        for a, b in ((gt, est), (gt, gt), (est, est)):
            result = ras(a, b)
            assert result.score == 1.0
            assert np.all(result.errors < 1e-10)
    angles = [[0, 0, 0], [0, 0, 60], [0, 0, 120], [0, 0, 180], [90, 0, 0]]
    far_apart = ras(np.tile(np.eye(3), (5, 1, 1)), Rotation.from_rotvec(angles, degrees=True))
    assert far_apart.score == 0.2
