"""`reference_sigma`: what a perfect estimate would score under an uncertain reference."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import maxwell

from alignscores import Trajectory, evaluate

N = 400


@pytest.fixture
def reference():
    """Poses of a random walk, (n, 4, 4)."""
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (N, 1, 1))
    poses[:, :3, :3] = Rotation.random(N, rng=rng).as_matrix()
    poses[:, :3, 3] = np.cumsum(rng.normal(size=(N, 3)), axis=0)
    return poses


def with_errors(poses, sigma, sigma_deg):
    rng = np.random.default_rng(1)
    estimate = poses.copy()
    estimate[:, :3, 3] += sigma * rng.normal(size=(N, 3))
    turns = Rotation.from_rotvec(sigma_deg * rng.normal(size=(N, 3)), degrees=True)
    estimate[:, :3, :3] @= turns.as_matrix()
    return estimate


def note_kinds(evaluation):
    return [note.kind for note in evaluation.notes]


@pytest.mark.parametrize("sigma_deg", [0.5, 3.0])
def test_scores_have_their_closed_form_where_nothing_is_aligned(reference, sigma_deg):
    """Distances and small angles of normal errors follow a Maxwell distribution."""
    sigma, levels = 0.2, np.arange(1, 101) / 100
    options = {"unit": 1.0, "alignment": "none"}
    evaluation = evaluate(
        reference, reference, reference_sigma=(sigma, sigma_deg), **options
    ).perfect
    assert evaluation["TAS"][0] == pytest.approx(maxwell.cdf(levels, scale=sigma).mean(), abs=0.01)
    expected = maxwell.cdf(10 * levels, scale=sigma_deg).mean()
    assert evaluation["RAS"][0] == pytest.approx(expected, abs=0.01)
    assert evaluation["PAS"][0] == pytest.approx((evaluation["TAS"][0] + evaluation["RAS"][0]) / 2)


def test_errors_as_large_as_those_of_the_reference_are_noted(reference):
    sigma = 0.1, 1.0
    as_good = evaluate(reference, with_errors(reference, *sigma), reference_sigma=sigma)
    assert "perfect" in note_kinds(as_good)
    assert as_good.pas == pytest.approx(as_good.perfect["PAS"][0], abs=0.02)
    assert as_good.to_dict()["perfect"] == as_good.perfect
    worse = evaluate(reference, with_errors(reference, 0.2, 2.0), reference_sigma=sigma)
    assert "perfect" not in note_kinds(worse)
    unasked = evaluate(reference, reference)
    assert unasked.perfect is None
    assert "perfect" not in note_kinds(unasked)


def test_the_command_says_that_it_may_be_perfect(run):
    code, _, err = run("tum", "tum/reference.txt", "tum/estimate.txt", "--reference_sigma", "1,9")
    assert code == 0
    assert "not distinguishable from a perfect estimate by TAS, RAS, PAS" in err


def test_positions_alone_have_a_tas_alone(reference):
    reference[:, :3, :3] = np.nan
    walked = Trajectory(np.arange(N) / 10, reference)
    evaluation = evaluate(walked, walked, reference_sigma=(0.1, 1))
    assert set(evaluation.perfect) == {"TAS"}
