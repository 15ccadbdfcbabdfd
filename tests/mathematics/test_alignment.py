"""Alignments without a scale: what each undoes, the best of each, and what is degenerate."""

import numpy as np
import pytest
from evo.core.geometry import umeyama_alignment
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, Similarity, pas, ras, ras_profile, tas, tas_profile
from alignscores.similarity import ALIGNMENTS, UP

TURN = Rotation.from_euler("z", 50, degrees=True)
TILT = Rotation.from_euler("x", 20, degrees=True)
CHANGES = {  # of a perfect estimate: rotation, scale, translation, and the alignments that undo it
    "none": (Rotation.identity(), 1, 0, ALIGNMENTS),
    "shifted": (Rotation.identity(), 1, [3, -2, 40], ("similarity", "rigid", "yaw")),
    "turned": (TURN, 1, [3, -2, 40], ("similarity", "rigid", "yaw")),
    "tilted": (TILT * TURN, 1, [3, -2, 40], ("similarity", "rigid")),
    "scaled": (TILT * TURN, 2, [3, -2, 40], ("similarity",)),
}


@pytest.mark.parametrize("registration", ["pcr99", "refined"])
@pytest.mark.parametrize("alignment", ALIGNMENTS)
@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_world_scores_1_where_the_alignment_undoes_it(change, alignment, registration):
    rng = np.random.default_rng(0)
    gt, gt_rotations = rng.random((30, 3)), Rotation.random(30, rng=rng)
    rotation, scale, translation, undone_by = CHANGES[change]
    gt_poses, est_poses = np.zeros((2, 30, 3, 4))
    gt_poses[:, :, :3], gt_poses[:, :, 3] = gt_rotations.as_matrix(), gt
    est_poses[:, :, :3] = (rotation * gt_rotations).as_matrix()
    est_poses[:, :, 3] = scale * rotation.apply(gt) + translation
    result = pas(gt_poses, est_poses, registration=registration, alignment=alignment)
    if alignment in undone_by:
        assert result.score == 1
        estimated = result.tas.alignment
        np.testing.assert_allclose(estimated.rotation, rotation.as_matrix(), atol=1e-9)
        np.testing.assert_allclose(
            estimated.translation, np.broadcast_to(translation, 3), atol=1e-8
        )
        np.testing.assert_allclose(result.ras.alignment, rotation.as_matrix(), atol=1e-9)
        assert estimated.scale == (pytest.approx(scale) if alignment == "similarity" else 1)
    else:
        assert result.tas.score < 0.7
    if change == "tilted" and alignment == "yaw":
        assert result.ras.score == 0
    if alignment != "none" and change == "scaled":
        assert result.ras.score == (0 if alignment == "yaw" else 1)


def test_least_squares_fits_are_those_of_other_programs():
    """SE(3) and Sim(3) of evo; yaw of rpg_trajectory_evaluation, by its definition."""
    rng = np.random.default_rng(3)
    gt = rng.normal(size=(60, 3)) * [10, 5, 1]
    est = 1.1 * (TILT * TURN).apply(gt + rng.normal(scale=0.3, size=gt.shape)) - 4
    rotation, translation, _ = umeyama_alignment(gt.T, est.T, with_scale=False)
    rigid = Similarity.fit(gt, est, alignment="rigid")
    np.testing.assert_allclose(rigid.rotation, rotation, atol=1e-12)
    np.testing.assert_allclose(rigid.translation, translation, atol=1e-12)

    rotation, translation, scale = umeyama_alignment(est.T, gt.T, with_scale=True)
    similarity = Similarity.fit(gt, est).inverse()
    assert similarity.scale == pytest.approx(scale, rel=1e-12)
    np.testing.assert_allclose(similarity.rotation, rotation, atol=1e-12)
    np.testing.assert_allclose(similarity.translation, translation, atol=1e-12)

    def squares(angle):
        turned = Rotation.from_euler("z", angle).apply(gt - gt.mean(axis=0))
        return np.sum((turned - (est - est.mean(axis=0))) ** 2)

    yaw = Similarity.fit(gt, est, alignment="yaw")
    assert yaw.rotation[2].tolist() == [0, 0, 1]
    cost = np.sum(yaw.position_errors(gt, est) ** 2)
    best = minimize_scalar(squares, bounds=(-np.pi, np.pi), method="bounded").fun
    assert cost == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("up", UP)
def test_any_axis_may_be_vertical(up):
    rng = np.random.default_rng(5)
    gt, gt_rotations = rng.random((40, 3)), Rotation.random(40, rng=rng)
    axis = np.eye(3)["xyz".index(up[-1])]
    turn = Rotation.from_rotvec(0.8 * axis)
    est = turn.apply(gt) + rng.normal(scale=0.01, size=gt.shape)
    noise = Rotation.from_rotvec(rng.normal(scale=0.01, size=(40, 3)))
    est_rotations = (noise * turn * gt_rotations).as_matrix()
    options = {"alignment": "yaw", "up": up}
    result = tas(gt, est, registration="refined", **options)
    assert result.score > 0.7
    np.testing.assert_allclose(result.alignment.rotation @ axis, axis, atol=1e-12)
    assert tas_profile(gt, est, **options).half == pytest.approx(0.03, abs=0.004)

    rotations = ras(gt_rotations, est_rotations, **options)
    np.testing.assert_allclose(rotations.alignment @ axis, axis, atol=1e-12)
    relative = (Rotation.from_matrix(est_rotations) * gt_rotations.inv()).as_rotvec()

    def angles(angle):
        return (Rotation.from_rotvec(-angle * axis) * Rotation.from_rotvec(relative)).magnitude()

    best = min(np.sum(angles(angle)) for angle in np.linspace(0.7, 0.9, 2001))
    assert np.radians(rotations.errors).sum() == pytest.approx(best, rel=1e-4)
    assert ras_profile(gt_rotations, est_rotations, **options).half < 2


def test_yaw_of_rotations_ignores_outliers():
    """It is the median yaw of the larger group, though two fifths have another one in common."""
    yaws = np.radians(np.r_[40 + np.linspace(-8, 8, 25), 40 + np.linspace(50, 60, 16)])
    gt = Rotation.random(41, rng=np.random.default_rng(8))
    result = ras(gt, Rotation.from_euler("z", yaws[:, None]) * gt, alignment="yaw")
    angles = Rotation.from_matrix(result.alignment).as_euler("zyx", degrees=True)
    np.testing.assert_allclose(angles, [40, 0, 0], atol=0.2)


def test_a_user_supplied_registration_keeps_to_the_alignment():
    gt = np.random.default_rng(13).random((30, 3))

    def least_squares(gt, est, /, **_):
        return Similarity.fit(gt, est), 1

    assert tas(gt, 2 * gt, registration=least_squares).score == 1
    for alignment in ("rigid", "yaw"):
        with pytest.raises(TypeError, match=f"must return a {alignment} alignment"):
            tas(gt, 2 * gt, registration=least_squares, alignment=alignment)
    with pytest.raises(TypeError, match="must return a yaw alignment"):
        tas(gt, TILT.apply(gt), registration=least_squares, alignment="yaw")


def test_errors_without_an_alignment_are_plain_differences():
    rng = np.random.default_rng(6)
    gt = 1e6 + rng.random((20, 3))
    est = gt + rng.normal(scale=0.1, size=gt.shape)
    est[3] = np.nan
    result = tas(gt, est, alignment="none")
    np.testing.assert_array_equal(result.errors[3], np.inf)
    expected = np.linalg.norm(np.delete(est - gt, 3, axis=0), axis=1)
    np.testing.assert_allclose(np.delete(result.errors, 3), expected, rtol=1e-9)
    assert result.alignment.rotation.tolist() == np.eye(3).tolist()
    profile = tas_profile(gt, est, alignment="none")
    assert profile.half == pytest.approx(2 * np.median(expected), rel=0.3)


@pytest.mark.parametrize("alignment", ["rigid", "yaw", "none"])
@pytest.mark.parametrize("n_estimated", [0, 1, 2])
def test_few_estimated_cameras(alignment, n_estimated):
    """A camera or two can be aligned without a scale; none cannot."""
    gt = np.random.default_rng(7).random((10, 3))
    est = gt + (0 if alignment == "none" else 4)
    est[n_estimated:] = np.nan
    if n_estimated:
        result = tas(gt, est, registration="refined", alignment=alignment)
        assert result.score == n_estimated / 10
    else:
        with pytest.warns(AlignmentWarning, match="cannot be aligned"):
            assert tas(gt, est, registration="refined", alignment=alignment).score == 0


@pytest.mark.parametrize("registration", ["pcr99", "refined"])
@pytest.mark.parametrize("alignment", ["rigid", "yaw"])
def test_cameras_above_each_other(alignment, registration):
    """Their turn is free, and changes nothing."""
    gt = np.column_stack([np.zeros(20), np.zeros(20), np.arange(20.0) ** 1.5])
    est = TURN.apply(gt) + 3.0
    assert tas(gt, est, registration=registration, alignment=alignment).score == 1
    est[:, 2] *= 1.5
    assert 0 < tas(gt, est, registration=registration, alignment=alignment).score < 0.3
