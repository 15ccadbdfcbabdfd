"""AUC of lists of image pairs, against SuperGlue's definition, written out."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.metrics import NoValueError, pair_auc, pair_pose_errors

RNG = np.random.default_rng(0)


def trapezoids(errors, end):
    """The area under the recall as a polygon, flat from the last error below the end on."""
    below = np.sort(errors[errors < end])
    x = np.concatenate([[0], below, [end]])
    y = np.concatenate([np.arange(len(below) + 1), [len(below)]]) / len(errors)
    return 100 * np.trapezoid(y, x) / end


@pytest.mark.parametrize("n", [1, 7, 500])
@pytest.mark.parametrize("scale", [0.1, 5, 40])
def test_the_area_is_that_of_superglue(n, scale):
    errors = np.concatenate([scale * RNG.random(n), np.full(n // 4, np.inf)])
    expected = [trapezoids(errors, end) for end in (5, 10, 20)]
    np.testing.assert_allclose(pair_auc(errors), expected, rtol=1e-12)
    nan = np.where(np.isinf(errors), np.nan, errors)
    np.testing.assert_array_equal(pair_auc(nan), pair_auc(errors))


def test_an_error_equal_to_the_threshold_is_too_large():
    np.testing.assert_array_equal(pair_auc([5.0, 5.0]), [0, 62.5, 81.25])


def test_the_area_is_that_of_vggt():
    errors = 40 * RNG.random(300)
    shares = [100 * np.mean([np.mean(errors < m) for m in range(1, k + 1)]) for k in (5, 30)]
    np.testing.assert_allclose(pair_auc(errors, (5, 30), convention="vggt"), shares, rtol=1e-12)


def test_errors_of_relative_poses():
    """Folded directions; no pose, or none of the true directions, is infinitely far."""
    gt = np.tile(np.eye(4), (5, 1, 1))
    gt[:, :3, 3] = [[1, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]]
    est = gt.copy()
    est[0, :3, 3] = [-2, 0, 0.1]
    est[1, :3, :3] = Rotation.from_euler("y", 30, degrees=True).as_matrix()
    est[2] = np.nan
    errors = pair_pose_errors(gt, est)
    expected = [np.degrees(np.arctan(0.05)), 30, np.inf, np.inf, 0]
    np.testing.assert_allclose(errors, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (([[1.0]],), "errors must be a list of angles"),
        (([-1.0],), "at least 0"),
        (([1.0], (0,)), "thresholds must be"),
        (([1.0], (2.5,), "vggt"), "whole degrees, not 2.5"),
        (([1.0], (5,), "loftr"), "convention must be"),
    ],
)
def test_wrong_arguments(arguments, reason):
    with pytest.raises(ValueError, match=reason):
        pair_auc(*arguments[:2], **({"convention": arguments[2]} if arguments[2:] else {}))
    with pytest.raises(NoValueError):
        pair_auc([])
