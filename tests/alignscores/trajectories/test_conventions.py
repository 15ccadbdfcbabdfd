"""Mix-ups that must be told, and inaccuracies that must not be taken for one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Convention, check_conventions, ras
from alignscores.similarity import Similarity
from alignscores.trajectories import conventions
from alignscores.trajectories.conventions import (
    _axis_rotations,
    _smallest_equivalent,
    describe_rotation,
    find_convention,
    median_error,
    rotate_cameras,
    seem_swapped,
)
from alignscores.trajectories.files import Trajectory, inverse_poses

OPENGL = np.diag([1.0, -1.0, -1.0])
BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
IMU = Rotation.from_rotvec([30, -50, 80], degrees=True).as_matrix()
FRAMES = {"OpenGL": OPENGL, "body": BODY, "camera": BODY.T, "IMU": IMU}


def make_poses(rotations, positions):
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations, positions
    return poses


def reference(kind, n, rng):
    """Poses that look anywhere, about one axis as of a vehicle, wander slowly, or never turn."""
    steps = rng.normal(size=(n, 3))
    if kind == "anywhere":
        return make_poses(Rotation.random(n, rng=rng).as_matrix(), steps)
    if kind == "vehicle":
        heading = np.cumsum(rng.normal(0, 0.3, n))
        path = np.cumsum(np.column_stack([np.cos(heading), np.sin(heading), np.zeros(n)]), axis=0)
        return make_poses(Rotation.from_euler("z", heading[:, None]).as_matrix(), path)
    if kind == "wandering":
        turns = Rotation.from_rotvec(np.cumsum(0.15 * rng.normal(size=(n, 3)), axis=0))
        return make_poses(turns.as_matrix(), np.cumsum(steps, axis=0))
    return make_poses(np.eye(3), np.cumsum(np.abs(steps), axis=0))


def estimate(gt, rng, *, sigma_t=0.02, sigma_deg=1.0, lost=0.0, drift_deg=0.0):
    """The reference in another world with noise, lost cameras and a slow turn of the world."""
    n = len(gt)
    world = Rotation.random(rng=rng)
    noise = Rotation.from_rotvec(rng.normal(0, sigma_deg, (n, 3)), degrees=True)
    drift = Rotation.from_rotvec(
        np.linspace(0, drift_deg, n)[:, None] * [0.0, 0.0, 1.0], degrees=True
    )
    rotations = (drift * world * noise * Rotation.from_matrix(gt[:, :3, :3])).as_matrix()
    positions = (drift * world).apply(gt[:, :3, 3] + rng.normal(0, sigma_t, (n, 3)))
    est = make_poses(rotations, 2.0 * positions + [5.0, 0.0, 1.0])
    bad = rng.permutation(n)[: round(lost * n)]
    est[bad, :3, :3] = Rotation.random(len(bad), rng=rng).as_matrix() if len(bad) else 0
    est[bad, :3, 3] = rng.uniform(-20, 20, (len(bad), 3))
    return est


def in_frame(est, body):
    turned = est.copy()
    turned[:, :3, :3] = est[:, :3, :3] @ body
    return turned


def random_turns(rng, sigma_deg):
    return Rotation.from_rotvec(rng.normal(0, sigma_deg, (60, 3)), degrees=True).as_matrix()


def told(found):
    """What is told besides the camera's frame."""
    kinds = "inverted", "rotations_inverted", "positions_inverted", "mirrored"
    return [what for what in kinds if getattr(found, what)]


@pytest.fixture(params=["anywhere", "vehicle", "wandering"])
def kind(request):
    return request.param


@pytest.mark.parametrize("lost", [0.0, 0.4])
@pytest.mark.parametrize("frame", FRAMES)
def test_another_camera_frame(kind, frame, lost):
    rng = np.random.default_rng([len(kind), len(frame)])
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng, lost=lost)
    mixed_up = in_frame(est, FRAMES[frame])
    found = find_convention(gt, mixed_up)
    assert found.body_rotation is not None
    assert told(found) == []
    mended = rotate_cameras(mixed_up, found.body_rotation)
    honest = ras(gt[:, :3, :3], est[:, :3, :3]).score
    assert ras(gt[:, :3, :3], mended[:, :3, :3]).score > honest - 0.03
    assert ras(gt[:, :3, :3], mixed_up[:, :3, :3]).score < honest / 3
    if kind != "vehicle":  # about one axis, other frames explain it as well
        off = Rotation.from_matrix(found.body_rotation.T @ FRAMES[frame]).magnitude()
        assert np.degrees(off) < (2.0 if frame == "IMU" else 1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_the_camera_frame_is_that_of_most_cameras_not_of_the_first(seed):
    rng = np.random.default_rng(seed)
    gt = reference("anywhere", 120, rng)
    found = find_convention(gt, in_frame(estimate(gt, rng, lost=0.5), IMU))
    assert found.body_rotation == pytest.approx(IMU, abs=0.02)


@pytest.mark.parametrize("lost", [0.0, 0.4])
@pytest.mark.parametrize("frame", [None, "OpenGL", "IMU"])
def test_world_to_camera(kind, frame, lost):
    rng = np.random.default_rng([len(kind), 7])
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng, lost=lost)
    if frame is not None:
        est = in_frame(est, FRAMES[frame])
    found = find_convention(gt, inverse_poses(est))
    assert told(found) == ["inverted"]
    assert (found.body_rotation is None) == (frame is None)
    assert found.corrected_ras > 3 * found.ras


@pytest.mark.parametrize("kind", ["anywhere", "wandering"])
def test_transposed_rotations_alone(kind):
    rng = np.random.default_rng(3)
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng)
    est[:, :3, :3] = est[:, :3, :3].transpose(0, 2, 1)
    found = find_convention(gt, est)
    assert told(found) == ["rotations_inverted"]
    assert found.body_rotation is None


@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_world_to_camera_translations_alone(kind, lost):
    rng = np.random.default_rng(5)
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng, lost=lost)
    est[:, :3, 3] = inverse_poses(est)[:, :3, 3]
    assert told(find_convention(gt, est)) == ["positions_inverted"]


def test_quaternions_of_a_vehicle_fit_in_part_with_w_at_the_wrong_end():
    """It turns about one axis and tilts a little, so that a RAS stays that seems one of drift."""
    rng = np.random.default_rng(2)
    gt = reference("vehicle", 300, rng)
    to_camera = Rotation.from_matrix(BODY)  # y down is the axis
    tilts = Rotation.from_rotvec(rng.normal(0, [3, 0.2, 3], (300, 3)), degrees=True)
    rotations = Rotation.from_matrix(gt[:, :3, :3]) * to_camera.inv() * tilts
    gt[:, :3, :3] = (to_camera * rotations).as_matrix()
    est = estimate(gt, rng, sigma_deg=0.5)
    world = Rotation.from_matrix(est[0, :3, :3]).inv()
    quaternions = (world * Rotation.from_matrix(est[:, :3, :3])).as_quat()
    est[:, :3, :3] = Rotation.from_quat(quaternions[:, [3, 0, 1, 2]]).as_matrix()
    found = find_convention(gt, est)
    assert found.quaternions_shifted
    assert found.ras > found.corrected_ras / 3
    assert found.corrected_ras > 0.85


@pytest.mark.parametrize("kind", ["anywhere", "wandering"])
@pytest.mark.parametrize("order", [[3, 0, 1, 2], [1, 2, 3, 0]], ids=["w first", "w last"])
def test_quaternions_with_w_at_the_wrong_end(kind, order):
    rng = np.random.default_rng(8)
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng)
    quaternions = Rotation.from_matrix(est[:, :3, :3]).as_quat()
    est[:, :3, :3] = Rotation.from_quat(quaternions[:, order]).as_matrix()
    assert find_convention(gt, est).quaternions_shifted
    assert not find_convention(gt, est, quaternions=False).quaternions_shifted
    transposed = estimate(gt, rng)
    transposed[:, :3, :3] = transposed[:, :3, :3].transpose(0, 2, 1)
    assert not find_convention(gt, transposed).quaternions_shifted


@pytest.mark.parametrize("kind", ["anywhere", "wandering"])
@pytest.mark.parametrize("mirror", [[1, 1, -1], [-1, 1, 1], [-1, -1, -1]])
@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_mirrored(kind, mirror, lost):
    rng = np.random.default_rng(4)
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng, lost=lost)
    positions_only = est.copy()
    positions_only[:, :3, 3] *= mirror
    assert find_convention(gt, positions_only).mirrored
    both = positions_only.copy()
    both[:, :3, :3] = np.diag(mirror) @ est[:, :3, :3] @ np.diag(mirror)
    found = find_convention(gt, both)
    assert found.mirrored
    # The rotations of a mirrored world are the true ones in another camera frame.
    if mirror != [-1, -1, -1]:  # there they are the true ones
        half_turn = -np.diag(mirror)
        np.testing.assert_allclose(found.body_rotation, half_turn, atol=1e-9)


def test_mirrored_positions_fit_relative_to_the_reference():
    """Not to the estimate, which lost cameras make wide: they are not close enough to tell."""
    rng = np.random.default_rng(4)
    gt = reference("anywhere", 80, rng)
    est = estimate(gt, rng, sigma_t=0.12, lost=0.48)
    est[:, :3, 3] *= [1, 1, -1]
    assert not find_convention(gt, est).mirrored


INACCURACIES = {
    "exact": {"sigma_t": 0.0, "sigma_deg": 0.0},
    "noise": {"sigma_t": 0.1, "sigma_deg": 4.0},
    "much noise": {"sigma_t": 1.0, "sigma_deg": 20.0},
    "half of it lost": {"lost": 0.5},
    "most of it lost": {"lost": 0.8},
    "all of it lost": {"lost": 1.0},
    "drift": {"drift_deg": 60.0},
}


@pytest.mark.parametrize("n", [4, 7, 12, 30, 100])
@pytest.mark.parametrize("kind", ["anywhere", "vehicle", "wandering", "never turning"])
@pytest.mark.parametrize("what", INACCURACIES)
def test_inaccuracy_is_no_convention(kind, what, n):
    for seed in range(3):
        rng = np.random.default_rng([n, seed])
        gt = reference(kind, n, rng)
        found = find_convention(gt, estimate(gt, rng, **INACCURACIES[what]))
        assert told(found) == []
        assert found.body_rotation is None


def test_what_fits_as_it_is_has_the_same_score_under_its_convention(kind):
    gt = reference(kind, 120, np.random.default_rng(5))
    found = find_convention(gt, gt)
    assert found.ras == found.corrected_ras == pytest.approx(1)


@pytest.mark.parametrize("angle", [1.0, 2.0, 5.0, 9.0])
def test_a_small_misalignment_is_no_convention(kind, angle):
    rng = np.random.default_rng(5)
    gt = reference(kind, 120, rng)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis), degrees=True).as_matrix()
    found = find_convention(gt, in_frame(estimate(gt, rng), turn))
    assert found.body_rotation is None
    assert told(found) == []
    assert found.corrected_ras == found.ras


def test_of_cameras_that_hardly_turn_a_swap_of_axes_is_told_that_has_a_use():
    """Of the others one or another fits by chance."""
    rng = np.random.default_rng(0)
    gt = make_poses(random_turns(rng, 2.0), rng.normal(size=(60, 3)))
    noisy = gt[:, :3, :3] @ random_turns(rng, 0.2)
    swaps = Rotation.create_group("O").as_matrix().round()
    found = [find_convention(gt, make_poses(noisy @ axes, gt[:, :3, 3])) for axes in swaps]
    told = {tuple(one.body_rotation.ravel()) for one in found if one.body_rotation is not None}
    assert told == {tuple(axes.ravel()) for axes in (OPENGL, BODY, BODY.T)}


def test_a_swap_of_axes_is_likelier_than_quaternions_with_w_at_the_wrong_end():
    """Of a camera that pans a little the one fits as well as the other."""
    rng = np.random.default_rng(1)
    pans = Rotation.from_rotvec(rng.normal(0, [0, 3, 0], (60, 3)), degrees=True)
    gt = make_poses(pans.as_matrix(), rng.normal(size=(60, 3)))
    est = in_frame(gt, random_turns(rng, 0.2) @ OPENGL)
    found = find_convention(gt, est)
    np.testing.assert_array_equal(found.body_rotation, OPENGL)
    assert not found.quaternions_shifted


def test_identity_quaternions_are_no_convention():
    """As of a system that knows positions alone."""
    rng = np.random.default_rng(6)
    gt = reference("wandering", 120, rng)
    est = estimate(gt, rng)
    est[:, :3, :3] = np.eye(3)
    assert find_convention(gt, est).body_rotation is None
    assert find_convention(est, gt).body_rotation is None


def test_cameras_that_were_not_estimated_are_left_out():
    rng = np.random.default_rng(7)
    gt = reference("anywhere", 60, rng)
    est = in_frame(estimate(gt, rng), OPENGL)
    est[::2] = np.nan
    np.testing.assert_array_equal(find_convention(gt, est).body_rotation, OPENGL)
    est[:] = np.nan
    assert find_convention(gt, est).body_rotation is None


def test_ten_cameras_are_enough():
    rng = np.random.default_rng(9)
    gt = reference("anywhere", 10, rng)
    est = in_frame(estimate(gt, rng), OPENGL)
    np.testing.assert_array_equal(find_convention(gt, est).body_rotation, OPENGL)
    of_nine = find_convention(gt[1:], est[1:])
    assert of_nine.body_rotation is None
    assert of_nine.ras == of_nine.corrected_ras == 0


@pytest.mark.parametrize("seed", range(3))
def test_of_motion_about_one_axis_the_frame_is_the_smallest_that_explains_it(seed):
    rng = np.random.default_rng(seed)
    axis, start, body = rng.normal(size=3), Rotation.random(rng=rng), Rotation.random(rng=rng)
    turns = rng.uniform(-1, 1, (50, 1)) * axis
    rotations = (start * Rotation.from_rotvec(turns)).as_matrix()
    found = Rotation.from_matrix(_smallest_equivalent(rotations, body.as_matrix()))
    others = Rotation.from_rotvec(
        np.linspace(0, 2 * np.pi, 721)[:, None] * axis / np.linalg.norm(axis)
    )
    assert found.magnitude() == pytest.approx((others * body).magnitude().min(), abs=1e-2)
    assert found.magnitude() < body.magnitude()


def test_of_any_motion_the_axis_is_that_of_most_of_the_turns_since_the_start():
    """And the frame the smallest one about it, as by trying all."""
    start, *others = Rotation.random(20, rng=3)
    vectors = np.array([(start.inv() * other).as_rotvec() for other in others])
    axis = np.linalg.svd(vectors)[2][0]
    spins = Rotation.from_rotvec(np.linspace(0, 2 * np.pi, 3601)[:, None] * axis)
    body = Rotation.from_matrix(IMU)
    expected = (spins * body)[int(np.argmin((spins * body).magnitude()))]
    rotations = Rotation.concatenate([start, *others]).as_matrix()
    found = _smallest_equivalent(rotations, IMU)
    np.testing.assert_allclose(found, expected.as_matrix(), atol=2e-3)


def test_cameras_are_turned_about_themselves():
    turned = rotate_cameras(make_poses(IMU[None], [[1, 2, 3]]), BODY)
    np.testing.assert_allclose(turned, make_poses([IMU @ BODY.T], [[1, 2, 3]]))
    poses = make_poses(IMU[None], [[1, 2, 3]])
    assert rotate_cameras(poses, None) is poses


def test_descriptions():
    assert describe_rotation(OPENGL) == "180 deg about x, as OpenGL's camera axes to OpenCV's"
    body, camera = (
        "a frame with x forward, y left, z up",
        "a camera with x right, y down, z forward",
    )
    assert describe_rotation(BODY) == f"as {body} to {camera}"
    assert describe_rotation(BODY.T) == f"as {camera} to {body}"
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    assert describe_rotation(turn) == "its x, y, z are the reference's +y, -x, +z"
    turn = Rotation.from_rotvec([0, 25, 0], degrees=True).as_matrix()
    assert describe_rotation(turn) == "25.0 deg about (0.00, 1.00, 0.00)"


def test_every_frame_along_the_axes_is_known_once_and_described():
    axes, names = _axis_rotations()
    assert len(axes) == 24
    for k, (rotation, name) in enumerate(zip(axes, names, strict=True)):
        np.testing.assert_array_equal(rotation @ rotation.T, np.eye(3))
        assert np.linalg.det(rotation) == 1
        assert [np.array_equal(rotation, other) for other in axes].index(True) == k
        if k >= 4:
            columns = name.removeprefix("its x, y, z are the reference's ").split(", ")
            signed = [{"+": 1, "-": -1}[c[0]] * np.eye(3)["xyz".index(c[1])] for c in columns]
            np.testing.assert_array_equal(rotation.T, signed)
    # The camera's axes stand in the columns, as the frame sees them.
    named = [np.eye(3), OPENGL, BODY, BODY.T]
    np.testing.assert_array_equal(axes[:4], named)
    assert names[0] == "none"
    assert [describe_rotation(rotation) for rotation in axes[1:]] == names[1:]


def test_the_frame_is_that_of_poses_the_right_way_round():
    found = str(Convention(inverted=True, mirrored=True, body_rotation=OPENGL))
    order = "are world-to-camera", "frame is turned", "positions are mirrored"
    assert [part in said for part, said in zip(order, found.split("; "), strict=True)] == [True] * 3


def trajectory(n, *, at_origin):
    poses = reference("wandering", n, np.random.default_rng(n))
    if at_origin:
        poses = np.linalg.inv(poses[0]) @ poses
    return Trajectory(np.linspace(0.0, 10.0, n), poses)


def test_swapped():
    slam, mocap = trajectory(100, at_origin=True), trajectory(1000, at_origin=False)
    assert seem_swapped(slam, mocap)
    assert not seem_swapped(mocap, slam)
    assert seem_swapped(slam, trajectory(200, at_origin=False))  # twice as many are many
    assert not seem_swapped(slam, trajectory(199, at_origin=False))
    long = Trajectory(np.linspace(-90, 10, 1000), mocap.poses)  # as many while both run
    assert not seem_swapped(slam, long)
    standing = Trajectory(slam.keys, np.tile(np.eye(4), (100, 1, 1)))
    assert seem_swapped(standing, mocap)
    # One sign alone is none.
    assert not seem_swapped(trajectory(1000, at_origin=True), trajectory(1100, at_origin=False))
    assert not seem_swapped(trajectory(100, at_origin=False), mocap)
    assert not seem_swapped(slam, trajectory(1000, at_origin=True))
    rows = [Trajectory(np.arange(len(t.poses)), t.poses) for t in (slam, mocap)]
    assert not seem_swapped(*rows)


def _scaled(poses, factor):
    poses[:, :3, 3] *= factor
    return poses


def _with_translations(poses):
    poses = _scaled(poses, 2.5)
    poses[:, :3, 3] = inverse_poses(poses)[:, :3, 3]
    return poses


@pytest.mark.parametrize(
    ("change", "words", "scale"),
    [
        (lambda p: p, "no mix-up is found", 1.0),
        (np.linalg.inv, "the estimated poses are world-to-camera", 1.0),
        (
            lambda p: p @ np.diag([1.0, -1.0, -1.0, 1.0]),
            "the camera's frame is turned: 180 deg",
            1.0,
        ),
        (
            lambda p: np.diag([1.0, 1.0, -1.0, 1.0]) @ p @ np.diag([1.0, 1.0, -1.0, 1.0]),
            "mirrored",
            1.0,
        ),
        (lambda p: _scaled(p, 2.5), "no mix-up is found", 2.5),
        (_with_translations, "the estimated positions are world-to-camera translations", 2.5),
    ],
)
def test_conventions_of_arrays(change, words, scale):
    """As of files; 3 x 4 matrices and lost cameras, too."""
    rng = np.random.default_rng(0)
    gt = np.tile(np.eye(4), (40, 1, 1))
    gt[:, :3, :3] = Rotation.random(40, rng=rng).as_matrix()
    gt[:, :3, 3] = rng.random((40, 3))
    est = change(gt.copy())
    est[:3] = np.nan
    for rows in (3, 4):
        found = check_conventions(gt[:, :rows], est[:, :rows])
        assert words in str(found)
        assert found.scale == pytest.approx(scale)
    with pytest.raises(ValueError, match=r"^gt_poses has 40 .* est_poses has 39; row i of both"):
        check_conventions(gt, est[1:])
    with pytest.raises(ValueError, match=r"^gt_poses\[0\] is not finite"):
        check_conventions(est, gt)


@pytest.mark.parametrize("what", ["mirrored", "positions_inverted"])
def test_the_scale_is_that_of_the_positions_as_they_were_meant(what):
    rng = np.random.default_rng(0)
    gt = reference("anywhere", 40, rng)
    meant = estimate(gt, rng, sigma_t=0.1)
    est = meant.copy()
    if what == "mirrored":
        est[:, 2, 3] *= -1
    else:
        est[:, :3, 3] = inverse_poses(meant)[:, :3, 3]
    found = check_conventions(gt, est)
    assert told(found) == [what]
    scale = conventions._scale(gt[:, :3, 3], meant[:, :3, 3])
    assert found.scale == pytest.approx(scale, rel=1e-9)
    assert check_conventions(gt, meant).scale == scale


def test_half_of_the_positions_and_one_fit_exactly():
    rng = np.random.default_rng(0)
    gt = rng.normal(size=(20, 3))
    est = 2 * gt + 1
    est[:9] = rng.uniform(-50, 50, (9, 3))
    assert median_error(gt, est, n_hypotheses=300) == pytest.approx(0, abs=1e-9)


def test_the_most_fit_though_fewer_fit_exactly():
    rng = np.random.default_rng(0)
    gt = rng.normal(size=(20, 3))
    est = 2 * gt + rng.normal(0, 0.02, (20, 3))
    est[:9] = 2 * gt[:9] + 30
    assert median_error(gt, est, n_hypotheses=300) < 0.1


def test_without_a_mix_up_nothing_is_said_to_be_one():
    told = vars(Convention())
    assert np.isnan(told.pop("scale"))
    flags = "inverted", "rotations_inverted", "positions_inverted", "quaternions_shifted"
    assert told == {
        **dict.fromkeys((*flags, "mirrored"), False),
        "body_rotation": None,
        "ras": 0.0,
        "corrected_ras": 0.0,
    }
    assert Convention() != Convention()  # it may hold an array


TURNED = "the camera's frame is turned: 180 deg about x, as OpenGL's camera axes to OpenCV's"


@pytest.mark.parametrize(
    ("found", "words"),
    [
        ({}, "no mix-up is found"),
        (
            {"inverted": True, "body_rotation": OPENGL, "mirrored": True},
            f"the estimated poses are world-to-camera; {TURNED}; "
            "the estimated positions are mirrored",
        ),
        (
            {"rotations_inverted": True, "body_rotation": OPENGL},
            f"{TURNED}; the estimated rotations are world-to-camera",
        ),
        (
            {"rotations_inverted": True, "quaternions_shifted": True, "body_rotation": OPENGL},
            "the quaternions have w at the wrong end",
        ),
        ({"rotations_inverted": True}, "the estimated rotations are world-to-camera"),
        (
            {"positions_inverted": True, "body_rotation": OPENGL},
            f"{TURNED}; the estimated positions are world-to-camera translations",
        ),
    ],
)
def test_a_convention_in_words(found, words):
    assert str(Convention(**found)) == words


def test_a_turn_within_rounding_of_the_axes_has_its_name():
    for angle, name in (
        (1e-9, TURNED.split(": ")[1]),
        (1e-7, "180.0 deg about (1.00, 0.00, 0.00)"),
    ):
        turn = Rotation.from_rotvec([np.pi - angle, 0, 0]).as_matrix()
        assert describe_rotation(turn) == name


@pytest.mark.parametrize("inverted", [True, False])
@pytest.mark.parametrize("rotations_inverted", [True, False])
@pytest.mark.parametrize("mirrored", [True, False])
@pytest.mark.parametrize("translations", [True, False])
def test_positions_are_looked_at_once_the_rotations_are_known(
    monkeypatch, inverted, rotations_inverted, mirrored, translations
):
    """Of 500 estimated poses, evenly spread."""
    rng = np.random.default_rng(0)
    gt, est = make_poses(np.eye(3), rng.normal(size=(700, 3))), reference("anywhere", 700, rng)
    est[100:120] = np.nan
    known = np.delete(np.arange(700), np.s_[100:120])
    rows = known[np.linspace(0, 679, 500).astype(int)]
    one = Convention(inverted=inverted, rotations_inverted=rotations_inverted, ras=0.25)

    def rotation(some_gt, some_est, quaternions):
        np.testing.assert_array_equal(some_gt, gt[rows])
        np.testing.assert_array_equal(some_est, est[rows])
        assert quaternions is False
        return one

    def is_mirrored(some_gt, some_est):
        np.testing.assert_array_equal(some_gt, gt[rows, :3, 3])
        poses = inverse_poses(est) if inverted else est
        np.testing.assert_array_equal(some_est, poses[rows, :3, 3])
        return mirrored

    monkeypatch.setattr(conventions, "_find_rotation", rotation)
    monkeypatch.setattr(conventions, "_is_mirrored", is_mirrored)
    monkeypatch.setattr(conventions, "_positions_inverted", lambda _gt, _est: translations)
    found = vars(find_convention(gt, est, quaternions=False))
    alone = translations and not (inverted or rotations_inverted or mirrored)
    expected = vars(one) | {"mirrored": mirrored, "positions_inverted": alone}
    assert {**found, "scale": 0} == {**expected, "scale": 0}


@pytest.mark.parametrize(
    ("turn", "start", "extent", "starts"),
    [
        *[(0, 0, 1, True), (9.9e-4, 0, 1, True), (1e-3, 0, 1, False), (-1.4e-3, 0, 1, False)],
        *[(0, 1e-3, 1, True), (0, -1.4e-3, 1, False), (0, 2e-5, 0.02, True)],
        *[(0, 5e-4, 0.02, False), (1, 1, 1, False), (0, 0, 0, True)],
    ],
)
def test_a_trajectory_starts_at_the_origin_up_to_a_thousandth(turn, start, extent, starts):
    """Of its extent, in an entry of the rotation; whichever row is the first in time."""
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[1, 0, 1], poses[1, 2, 3] = turn, start
    poses[0, 1, 3], poses[2, 0, 3] = -extent, np.nan
    assert conventions._starts_at_origin(Trajectory(np.array([5.0, 3.0, 4.0]), poses)) is starts


def test_a_trajectory_without_a_position_starts_nowhere():
    poses = np.full((2, 4, 4), np.nan)
    assert not conventions._starts_at_origin(Trajectory(np.arange(2.0), poses))


FRAME = Rotation.from_rotvec([0, 40, 0], degrees=True).as_matrix()
NEAR = Rotation.from_rotvec([0, 9, 0], degrees=True).as_matrix()
SHIFTED = conventions.SHIFTED_QUATERNIONS[1]
KNOWN = Convention(ras=0.5)


@pytest.fixture
def found_rotation(monkeypatch):
    """Return a function that finds the convention of rotations by fits and misfits as told."""

    def find(ras, frames, misfits, *, quaternions=True):
        gt, est = np.random.default_rng(0).normal(size=(2, 4, 4, 4))

        def inverted(poses):
            inverse = inverse_poses(est)[:, : poses.shape[1], : poses.shape[2]]
            given = est[:, : poses.shape[1], : poses.shape[2]]
            assert np.array_equal(poses, inverse) != np.array_equal(poses, given)
            return int(np.array_equal(poses, inverse))

        def known(some_gt, some_est, some_ras, some_quaternions):
            np.testing.assert_array_equal(some_gt, gt[:, :3, :3])
            np.testing.assert_array_equal(some_est, est[:, :3, :3])
            assert (some_ras, some_quaternions) == (ras, quaternions)
            return KNOWN

        monkeypatch.setattr(conventions, "_residuals", lambda *_: None)
        monkeypatch.setattr(conventions, "_approximate_ras", lambda _: ras)
        monkeypatch.setattr(conventions, "_known_mix_up", known)
        monkeypatch.setattr(conventions, "_best_frame", lambda _, some: frames[inverted(some)])
        monkeypatch.setattr(conventions, "_misfit", lambda _, some: misfits[inverted(some)])
        return conventions._find_rotation(gt, est, quaternions)

    return find


EYE, EVEN = np.eye(3), (0.2, 0.2)


@pytest.mark.parametrize(
    ("ras", "fits", "found"),
    [
        *[(0.1, (0.35, 0.3), True), (0.1, (0.349, 0.3), False), (0.1, (0.1, 0.35), True)],
        *[(0.25, (0.75, 0.3), True), (0.25, (0.74, 0.3), False), (1 / 3, (1.0, 0.3), True)],
    ],
)
def test_rotations_fit_three_times_as_well_under_a_convention(found_rotation, ras, fits, found):
    one = found_rotation(ras, [(FRAME, fit) for fit in fits], EVEN)
    assert (one is not KNOWN) == found
    if found:
        assert (one.ras, one.corrected_ras) == (ras, max(fits))


def test_rotations_that_fit_well_are_under_no_other_convention(found_rotation):
    """Where three times as well is impossible none is tried."""
    assert found_rotation(0.34, [], EVEN) is KNOWN


@pytest.mark.parametrize(
    ("fits", "misfits", "what"),
    [
        # Both fit about as well: the positions decide.
        *[((0.8, 0.8), (0.1, 0.2), ""), ((0.8, 0.8), (0.2, 0.1), "inverted")],
        *[((0.8, 0.82), EVEN, ""), ((0.8, 0.82), (0.1, 0.2), ""), ((0.82, 0.8), EVEN, "")],
        ((0.82, 0.8), (0.2, 0.1), "inverted"),
        # One fits better: if it is the inverse, the positions tell what is inverted.
        *[((0.84, 0.8), (0.2, 0.1), ""), ((0.9, 0.5), (0.2, 0.1), "")],
        *[((0.8, 0.84), (0.1, 0.2), "rotations_inverted"), ((0.8, 0.9), EVEN, "inverted")],
        *[((0.2, 0.8), EVEN, "inverted"), ((0.2, 0.8), (0.1, 0.2), "rotations_inverted")],
        ((0.8, 0.2), (0.2, 0.1), ""),
    ],
)
@pytest.mark.parametrize("frame", [FRAME, NEAR, SHIFTED], ids=["frame", "near", "shifted"])
@pytest.mark.parametrize("quaternions", [True, False])
def test_rotations_or_poses_are_inverted(found_rotation, fits, misfits, what, frame, quaternions):
    frames = [(frame, fit) for fit in fits]
    one = found_rotation(0.1, frames, misfits, quaternions=quaternions)
    fit = fits[0] if what == "" else fits[1]
    unchanged = what == "" and frame is NEAR
    assert told(one) == ([what] if what else [])
    assert one.body_rotation is (None if frame is NEAR else frame)
    assert (one.ras, one.corrected_ras) == (0.1, 0.1 if unchanged else fit)
    shifted = quaternions and frame is SHIFTED and what == "rotations_inverted"
    assert one.quaternions_shifted is shifted


def test_a_turn_of_as_much_as_the_largest_threshold_is_inaccuracy(found_rotation, monkeypatch):
    angle = float(conventions.rotation_angles(FRAME[None])[0])
    for limit, frame in ((angle, None), (angle - 1e-9, FRAME)):
        monkeypatch.setattr(conventions, "NEAR_DEG", limit)
        assert found_rotation(0.1, [(FRAME, 0.8), (FRAME, 0.2)], EVEN).body_rotation is frame


@pytest.mark.parametrize(
    ("ras", "fits", "best"),
    [
        *[(0.5, [0.75, 0, 0, 0, 0], 0), (0.5, [0.74, 0, 0, 0, 0], None), (0, [0, 0.5, 0, 0, 0], 1)],
        *[(0.0, [0, 0.49, 0, 0, 0], None), (0.875, [0, 0, 0.975, 0, 0], 2)],
        *[(0.875, [0, 0, 0.974, 0, 0], None), (0.85, [0.951, 0, 0, 0, 0], 0)],
        *[(0.85, [0.949, 0, 0, 0, 0], None), (0.5, [0.8, 0.9, 0.85, 0.91, 0.1], 1)],
        *[(0.5, [0.8, 0.9, 0.85, 0.925, 0.1], 3), (0.5, [0, 0, 0, 0.8, 0.9], 4), (0.91, [], None)],
        (0.9, [1.0, 0, 0, 0, 0], 0),
    ],
)
@pytest.mark.parametrize("quaternions", [True, False])
def test_a_known_mix_up_explains_half_of_what_is_missing(monkeypatch, ras, fits, best, quaternions):
    """Three swaps of axes, then two shifts of quaternions, which must be clearly better."""
    gt, est = Rotation.random(8, rng=0).as_matrix().reshape(2, 4, 3, 3)
    swaps = [est @ axes.T for axes in (OPENGL, BODY, BODY.T)]
    shifts = [est.swapaxes(1, 2) @ frame.T for frame in conventions.SHIFTED_QUATERNIONS]
    asked = iter(zip(swaps + shifts, fits, strict=False))

    def residuals(some_gt, some_est):
        assert some_gt is gt
        expected, fit = next(asked)
        np.testing.assert_array_equal(some_est, expected)
        return fit

    monkeypatch.setattr(conventions, "_residuals", residuals)
    monkeypatch.setattr(conventions, "_approximate_ras", lambda fit: fit)
    found = conventions._known_mix_up(gt, est, ras, quaternions)
    assert len(list(asked)) == (0 if quaternions or not fits else 2)
    if not quaternions and best is not None and best > 2:
        best = 1 if fits[1] else None
    shifted = best is not None and best > 2
    assert (found.rotations_inverted, found.quaternions_shifted) == (shifted, shifted)
    assert (found.inverted, found.positions_inverted, found.mirrored) == (False, False, False)
    assert (found.ras, found.corrected_ras) == (ras, ras if best is None else fits[best])
    frames = [OPENGL, BODY, BODY.T, *conventions.SHIFTED_QUATERNIONS]
    if best is None:
        assert found.body_rotation is None
    else:
        np.testing.assert_array_equal(found.body_rotation, frames[best])


@pytest.mark.parametrize("shift", range(2))
def test_quaternions_that_are_shifted_look_inverted_in_another_frame(shift):
    """Exactly: of q and of its cyclic shift, up to a constant rotation Q of the world."""
    true = Rotation.random(20, rng=0)
    order = [[3, 0, 1, 2], [1, 2, 3, 0]]
    wrong = Rotation.from_quat(true.as_quat()[:, order[shift]]).as_matrix()
    fits = [
        float(np.ptp(wrong.swapaxes(1, 2) @ frame.T @ true.inv().as_matrix(), axis=0).max())
        for frame in conventions.SHIFTED_QUATERNIONS
    ]
    assert min(fits) < 1e-12 < max(fits)
    for frame in conventions.SHIFTED_QUATERNIONS:
        np.testing.assert_array_equal(frame @ frame.T, np.eye(3))
        assert np.linalg.det(frame) == pytest.approx(1)


FREE = Rotation.from_rotvec([0, 20, 40], degrees=True).as_matrix()
LESS = Rotation.from_rotvec([0, 20, 0], degrees=True).as_matrix()


@pytest.mark.parametrize(
    ("axes", "free", "less", "frame", "fit"),
    [
        # A later one of the axes must be clearly better.
        *[({}, 0, 0, EYE, 0.0), ({0: 0.5}, 0, 0, EYE, 0.5), ({0: 0.5, 1: 0.519}, 0, 0, EYE, 0.5)],
        ({0: 0.5, 3: 0.521}, 0, 0, BODY.T, 0.521),
        ({0: 0.5, 1: 0.5 + 0.02}, 0, 0, EYE, 0.5),
        ({0: 0.5, 1: 0.525, 2: 0.54, 3: 0.55}, 0, 0, BODY.T, 0.55),
        # And so must one that is free; of these it is the smallest that fits about as well.
        ({1: 0.5}, 0.5 + 0.05, 0, OPENGL, 0.5),
        *[({1: 0.5}, 0.56, 0, FREE, 0.56), ({1: 0.5}, 0.56, 0.52, LESS, 0.56)],
        *[({1: 0.5}, 0.8, 0.8 - 0.05, FREE, 0.8), ({1: 0.5}, 0.8, 0.74, FREE, 0.8)],
        *[({1: 0.5}, 0.8, 0.755, LESS, 0.8), ({1: 0.5}, 0.8, 0.9, LESS, 0.8)],
    ],
)
def test_the_best_frame_takes_axes_to_axes_if_that_fits(monkeypatch, axes, free, less, frame, fit):
    gt, est = Rotation.random(8, rng=0).as_matrix().reshape(2, 4, 3, 3)
    scores = {tuple(conventions._AXES[k].ravel()): score for k, score in axes.items()}
    scores |= {tuple(FREE.ravel()): free, tuple(LESS.ravel()): less}

    def residuals(some_gt, some_est):
        assert some_gt is gt
        body = np.linalg.solve(est[0], some_est[0]).T
        near = [score for key, score in scores.items() if np.allclose(body.ravel(), key)]
        return near[0] if near else 0.0

    monkeypatch.setattr(conventions, "_residuals", residuals)
    monkeypatch.setattr(conventions, "_approximate_ras", lambda score: score)
    monkeypatch.setattr(conventions, "_frame_hypothesis", lambda *given: (*given, "first"))
    monkeypatch.setattr(
        conventions,
        "_refined_frame",
        lambda some_gt, some_est, body: FREE if body == (some_gt, some_est, "first") else None,
    )
    monkeypatch.setattr(
        conventions, "_smallest_equivalent", lambda _, body: LESS if body is FREE else 0
    )
    found, ras_of_it = conventions._best_frame(gt, est)
    np.testing.assert_array_equal(found, frame)
    assert ras_of_it == fit


def two_orientations(degrees, est_degrees):
    """Cameras of two orientations, of which each has the same angle to each of the other kind."""
    kinds = np.arange(40) % 2
    gt, est = (
        Rotation.from_rotvec(kinds[:, None] * [0, 0, 1.0] * angle, degrees=True).as_matrix()
        for angle in (degrees, est_degrees)
    )
    return gt, est @ FRAME


@pytest.mark.parametrize(
    ("degrees", "est_degrees", "usable"),
    [
        *[(4.9, 4.9, False), (5.1, 5.1, True), (168, 168, True), (171, 171, False)],
        *[(60, 69.9, True), (60, 70.1, False), (60, 50.1, True), (60, 49.9, False)],
    ],
)
def test_a_frame_is_proposed_by_turns_of_a_defined_axis(degrees, est_degrees, usable):
    """Whose angles are about the same in both."""
    frame = conventions._frame_hypothesis(*two_orientations(degrees, est_degrees))
    assert np.array_equal(frame, np.eye(3)) != usable


def test_turns_that_are_just_too_far_apart_propose_none(monkeypatch):
    gt, est = two_orientations(60, 68)

    def angle(world, i, j):
        turn = world[i].T @ world[j]
        return np.degrees(np.linalg.norm(conventions._log(turn[None])[0]))

    pairs = [(0, 1), (1, 0)]
    apart = [abs(angle(gt, *pair) - angle(est, *pair)) for pair in pairs]
    monkeypatch.setattr(conventions, "NEAR_DEG", min(apart))
    assert np.array_equal(conventions._frame_hypothesis(gt, est), np.eye(3))
    monkeypatch.setattr(conventions, "NEAR_DEG", max(apart) + 1e-9)
    assert not np.array_equal(conventions._frame_hypothesis(gt, est), np.eye(3))


def test_turns_by_just_the_least_or_the_largest_angle_propose_none(monkeypatch):
    gt, est = two_orientations(60, 61)
    turns = np.array([gt[0].T @ gt[1], gt[1].T @ gt[0]])
    angles = np.degrees(np.linalg.norm(conventions._log(turns), axis=1))
    for limits in ((angles.max(), 170.0), (5.0, angles.min())):
        monkeypatch.setattr(conventions, "DEFINED_AXIS_DEG", limits)
        assert np.array_equal(conventions._frame_hypothesis(gt, est), np.eye(3))


def kabsch(products):
    """Return the rotation with the largest sum of products of its entries with these."""
    left, _, right = np.linalg.svd(products)
    return left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right


def test_of_300_triplets_that_are_usable_the_frame_is_that_with_which_most_cameras_agree():
    """As by Kabsch's method, triplet by triplet, of 3000 that are drawn."""
    rng = np.random.default_rng(3)
    gt = reference("wandering", 50, rng)[:, :3, :3]
    est = gt @ random_turns(rng, 5.0)[:50] @ IMU
    est[rng.permutation(50)[:20]] = Rotation.random(20, rng=rng).as_matrix()
    worlds = Rotation.from_matrix(gt), Rotation.from_matrix(est)
    bodies, agreeing = [], []
    for i, j, k in np.random.default_rng(0).integers(50, size=(3, 3000)).T:
        turns = [
            [(world[int(i)].inv() * world[int(other)]).as_rotvec(degrees=True) for other in (j, k)]
            for world in worlds
        ]
        angles, est_angles = np.linalg.norm(turns, axis=2)
        near = np.abs(angles - est_angles) < 10
        if not (near & (angles > 5) & (angles < 170)).all():
            continue
        body = Rotation.from_matrix(kabsch(np.transpose(turns[0]) @ turns[1]))
        world = worlds[1][int(i)] * body.inv() * worlds[0][int(i)].inv()
        left = (world * worlds[0]).inv() * worlds[1] * body.inv()
        bodies.append(body.as_matrix())
        agreeing.append(int(np.sum(np.degrees(left.magnitude()) < 10)))
        if len(bodies) == 300:
            break
    found = conventions._frame_hypothesis(gt, est)
    np.testing.assert_allclose(found, bodies[int(np.argmax(agreeing))], atol=1e-9)


def test_a_frame_is_refined_ten_times_by_the_cameras_that_agree(monkeypatch):
    rng = np.random.default_rng(0)
    gt = reference("anywhere", 60, rng)[:, :3, :3]
    est = gt @ random_turns(rng, 1.0) @ IMU
    est[40:] = Rotation.random(20, rng=rng).as_matrix()
    asked, mean = [], conventions.chordal_mean

    def chordal_mean(frames):
        asked.append(frames)
        return mean(frames)

    monkeypatch.setattr(conventions, "chordal_mean", chordal_mean)
    start = IMU @ Rotation.from_rotvec([0, 0, 8], degrees=True).as_matrix()
    found = conventions._refined_frame(gt, est, start)
    assert np.degrees(Rotation.from_matrix(found @ IMU.T).magnitude()) < 0.5
    assert len(asked) == 10
    assert len(asked[-1]) == 40
    asked.clear()
    far = IMU @ Rotation.from_rotvec([0, 0, 150], degrees=True).as_matrix()
    monkeypatch.setattr(conventions, "rotation_angles", lambda frames: np.full(len(frames), 10.0))
    assert conventions._refined_frame(gt, est, far) is far
    assert asked == []


def test_residuals_are_the_errors_of_the_ras():
    rng = np.random.default_rng(0)
    gt = reference("anywhere", 60, rng)
    est = estimate(gt, rng, lost=0.3)
    errors = ras(gt[:, :3, :3], est[:, :3, :3]).errors
    np.testing.assert_allclose(conventions._residuals(gt[:, :3, :3], est[:, :3, :3]), errors)


def test_the_ras_of_residuals():
    """By hand; of fewer than ten cameras below 10 degrees it is 0."""
    near = np.array([0.0, 1, 2, 3, 4, 5, 6, 7, 8, 9])
    assert conventions._approximate_ras(near) == pytest.approx(0.55)
    assert conventions._approximate_ras(np.append(near, [10.0, 90.0])) == pytest.approx(5.5 / 12)
    assert conventions._approximate_ras(np.append(near[1:], [10.0, 10.0, 90.0])) == 0


@pytest.mark.parametrize(
    ("plain", "other", "told"),
    [
        *[(0.9, 0.14, True), (0.9, 0.15, False), (0.9, 0.2, False), (0.3, 0.09, True)],
        *[(0.3, 0.3 / 3, False), (0.3, 0.12, False), (np.inf, 0.14, True), (0.3, np.inf, False)],
    ],
)
def test_other_positions_fit_three_times_as_well_and_within_the_extent(
    monkeypatch, plain, other, told
):
    gt, est = (
        reference("anywhere", 12, np.random.default_rng(0)),
        reference("wandering", 12, np.random.default_rng(1)),
    )
    turned = Rotation.from_matrix(est[:, :3, :3]).apply(est[:, :3, 3])

    def misfit(some_gt, some_est):
        np.testing.assert_array_equal(some_gt, gt[:, :3, 3])
        if np.array_equal(some_est, est[:, :3, 3]):
            return plain
        np.testing.assert_allclose(some_est, expected)
        return other

    monkeypatch.setattr(conventions, "_position_misfit", misfit)
    expected = est[:, :3, 3] @ np.diag([1, 1, -1])
    assert conventions._is_mirrored(gt[:, :3, 3], est[:, :3, 3]) is told
    expected = -turned
    assert conventions._positions_inverted(gt, est) is told


def test_a_misfit_is_relative_to_the_extent_of_the_reference(monkeypatch):
    """Of the middle camera 3 from the middle of all, in units of the larger or smaller spread."""
    gt = np.array([[0.0, 0, 0], [3, 0, 0], [-3, 0, 0], [0, 4, 0], [0, -4, 0]]) + 7
    est = np.arange(15.0).reshape(5, 3)

    def error(some_gt, some_est, *, n_hypotheses):
        assert n_hypotheses == 300
        unit = np.linalg.norm(some_gt[1]) / 3
        np.testing.assert_allclose(some_gt, (gt - 7) * unit)
        np.testing.assert_array_equal(some_est, conventions.normalise(est)[0])
        return 0.6 * unit

    monkeypatch.setattr(conventions, "median_error", error)
    assert conventions._position_misfit(gt, est) == pytest.approx(0.2)
    assert conventions._position_misfit(np.ones((5, 3)), est) == np.inf


def test_the_scale_is_that_of_ten_cameras():
    gt = np.random.default_rng(0).normal(size=(10, 3))
    assert conventions._scale(gt, 50 * gt + 3) == pytest.approx(50)
    assert conventions._scale(100 * gt, 50 * gt + 3) == pytest.approx(0.5)
    for nothing in (conventions._scale(gt[1:], gt[1:]), conventions._scale(gt, 0 * gt)):
        assert type(nothing) is float
        assert np.isnan(nothing)


def test_a_registration_is_for_half_of_the_positions_and_one(monkeypatch):
    asked = []
    double = Similarity(2.0, np.eye(3), np.ones(3))

    def pcr99(gt, est, *, rank, n_hypotheses, rng):
        asked.append((len(gt), len(est), rank, n_hypotheses, rng.random()))
        return (None if rank == 2 else double), "more"

    monkeypatch.setattr(conventions, "pcr99", pcr99)
    gt = np.arange(12.0).reshape(4, 3)
    est = 2 * gt + 1 + 2 * np.array([[0, 0, 0], [1, 0, 0], [0, 3, 0], [9, 0, 0]])
    assert median_error(gt, est, n_hypotheses=7) == pytest.approx(2)  # of 0, 1, 3, 9
    assert median_error(gt[:3], est[:3], n_hypotheses=8) == np.inf
    first = np.random.default_rng(0).random()
    assert asked == [(4, 4, 3, 7, first), (3, 3, 2, 8, first)]
