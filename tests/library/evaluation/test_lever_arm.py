"""The lever arm from an estimate's body to the reference's prism: given, found, and refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Trajectory, evaluate
from alignscores.io import read_tum

ARM = np.array([0.2, -0.1, 0.2])


def run(n=400, *, turning=True, sigma=0.01, seed=0):
    """A reference of only positions at the prism, and an estimate of the body with some noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / 10
    angles = np.column_stack([0.3 * np.sin(t / 3), 0.2 * np.cos(t / 2), t / 4]) * turning
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(angles).as_matrix()
    poses[:, :3, 3] = np.column_stack([t, np.sin(t) * turning, np.zeros(n)])
    prism = poses.copy()
    prism[:, :3, 3] += poses[:, :3, :3] @ ARM
    prism[:, :3, :3] = np.nan
    poses[:, :3, 3] += rng.normal(0, sigma, (n, 3))
    return Trajectory(t, prism), Trajectory(t, poses)


def test_a_given_lever_arm_is_applied():
    reference, estimate = run()
    plain, moved = (evaluate(reference, estimate, lever_arm=arm) for arm in (None, tuple(ARM)))
    assert plain.ate > 0.1
    assert moved.ate == pytest.approx(0.0173, abs=0.002)
    assert evaluate(reference, estimate, lever_arm="0.2,-0.1,0.2").tas == moved.tas
    assert moved.to_dict()["lever_arm"] == ARM.tolist()


@pytest.mark.parametrize("scale", [1, 0.3])
def test_auto_finds_the_lever_arm(scale):
    """In the estimate's unit, with a standard error; outliers change little."""
    reference, estimate = run()
    poses = estimate.poses.copy()
    poses[:, :3, 3] *= scale
    poses[::20, :3, 3] += 3
    evaluation = evaluate(reference, Trajectory(estimate.keys, poses), lever_arm="auto").lever_arm
    np.testing.assert_allclose(evaluation.vector, scale * ARM, atol=0.005)
    assert (np.abs(evaluation.vector - scale * ARM) < 4 * evaluation.errors).all()
    assert (evaluation.errors < 0.005).all()


@pytest.mark.parametrize("far", [0, 5e6])
def test_it_is_found_without_noise(far):
    """Far from the origin, too, as in a national grid."""
    reference, estimate = run(sigma=0)
    reference.poses[:, :3, 3] += far
    lever_arm = evaluate(reference, estimate, lever_arm="auto").lever_arm
    np.testing.assert_allclose(lever_arm.vector, ARM, rtol=0, atol=1e-6)
    assert (lever_arm.errors < 1e-6).all()


def test_a_real_run_that_is_moved_by_hand(real):
    folder = real / "euroc/V2_02"
    truth, estimate = read_tum(folder / "groundtruth.txt"), read_tum(folder / "vislam_ba/0.txt")
    arm = 0.3 * ARM / np.linalg.norm(ARM)
    moved = truth.poses.copy()
    moved[:, :3, 3] += moved[:, :3, :3] @ arm
    before, after = (
        evaluate(Trajectory(truth.keys, poses), estimate, lever_arm="auto")
        for poses in (truth.poses, moved)
    )
    lever_arm = before.lever_arm
    assert np.linalg.norm(after.lever_arm.vector - lever_arm.vector - arm) < 0.005
    assert (np.abs(lever_arm.vector) < 3 * lever_arm.errors).all()
    assert any(
        "lever arm" in note.text and "found and applied" in note.text for note in after.notes
    )


def test_motion_that_does_not_determine_it_is_refused():
    reference, estimate = run(turning=False)
    with pytest.raises(
        ValueError, match="no lever arm is found: its rotations do not determine it"
    ):
        evaluate(reference, estimate, lever_arm="auto")
    poses = estimate.poses.copy()  # straight ahead, with a trembling camera
    shaking = np.random.default_rng(1).normal(0, 1e-3, (len(poses), 3))
    poses[:, :3, :3] = Rotation.from_rotvec(shaking).as_matrix()
    with pytest.raises(ValueError, match="no lever arm is found"):
        evaluate(reference, Trajectory(estimate.keys, poses), lever_arm="auto")


def test_poses_at_the_stamps_of_a_sparse_reference_do_not_miss_them():
    reference, estimate = run(100, sigma=0.05)
    sparse = Trajectory(reference.keys[::10], reference.poses[::10])
    with pytest.raises(ValueError, match=r"no lever arm is found: .* uncertain by [\d., ]*$"):
        evaluate(sparse, estimate, lever_arm="auto")


def test_a_run_that_has_failed_needs_no_lever_arm():
    reference, estimate = run()
    still = Trajectory(estimate.keys, np.tile(estimate.poses[0], (len(estimate.keys), 1, 1)))
    evaluation = evaluate(reference, still, lever_arm="auto")
    assert (evaluation.tas, evaluation.lost) == (0, 1)


def test_a_lever_arm_needs_rotations():
    reference, _ = run()
    with pytest.raises(ValueError, match="lever_arm needs rotations, which the estimate lacks"):
        evaluate(reference, reference, lever_arm="0,0,1")


def test_a_pose_without_a_rotation_has_no_prism():
    """Its neighbours cover its frame, as if it were not there."""
    reference, estimate = run()
    partly = estimate.poses.copy()
    partly[1::2, :3, :3] = np.nan
    evaluation = evaluate(reference, Trajectory(estimate.keys, partly), lever_arm=tuple(ARM))
    half = Trajectory(estimate.keys[::2], estimate.poses[::2])
    assert evaluation.tas == evaluate(reference, half, lever_arm=tuple(ARM)).tas
