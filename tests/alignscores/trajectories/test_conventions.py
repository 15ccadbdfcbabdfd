"""Mix-ups that must be told, and inaccuracies that must not be taken for one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Convention, check_conventions, evaluate, ras
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


def rotation(axis, degrees):
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def random_turns(rng, sigma_deg):
    return Rotation.from_rotvec(rng.normal(0, sigma_deg, (60, 3)), degrees=True).as_matrix()


def told(found):
    """What is told besides the camera's frame."""
    kinds = "inverted", "quaternions_shifted", "mirrored"
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
    found = check_conventions(gt, mixed_up)
    assert found.body_rotation is not None
    assert told(found) == []
    mended = in_frame(mixed_up, found.body_rotation.T)
    honest = ras(gt[:, :3, :3], est[:, :3, :3]).score
    assert ras(gt[:, :3, :3], mended[:, :3, :3]).score > honest - 0.03
    assert ras(gt[:, :3, :3], mixed_up[:, :3, :3]).score < honest / 3
    angle, true_angle, off = (
        np.degrees(Rotation.from_matrix(one).magnitude())
        for one in (found.body_rotation, FRAMES[frame], found.body_rotation.T @ FRAMES[frame])
    )
    if kind == "vehicle":  # about one axis, other frames explain it as well: a small one is told
        assert angle < true_angle + 2.0
    else:
        assert off < (2.0 if frame == "IMU" else 1e-9)


@pytest.mark.parametrize("lost", [0.0, 0.4])
@pytest.mark.parametrize("frame", [None, "OpenGL", "IMU"])
def test_world_to_camera(kind, frame, lost):
    rng = np.random.default_rng([len(kind), 7])
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng, lost=lost)
    if frame is not None:
        est = in_frame(est, FRAMES[frame])
    found = check_conventions(gt, inverse_poses(est))
    assert told(found) == ["inverted"]
    assert (found.body_rotation is None) == (frame is None)
    assert found.corrected_ras > 3 * found.ras


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
    found = check_conventions(gt, est)
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
    assert check_conventions(gt, est).quaternions_shifted
    transposed = estimate(gt, rng)
    transposed[:, :3, :3] = transposed[:, :3, :3].transpose(0, 2, 1)
    assert not check_conventions(gt, transposed).quaternions_shifted


@pytest.mark.parametrize("kind", ["anywhere", "wandering"])
@pytest.mark.parametrize("mirror", [[1, 1, -1], [-1, 1, 1], [-1, -1, -1]])
@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_mirrored(kind, mirror, lost):
    rng = np.random.default_rng(4)
    gt = reference(kind, 120, rng)
    est = estimate(gt, rng, lost=lost)
    positions_only = est.copy()
    positions_only[:, :3, 3] *= mirror
    assert check_conventions(gt, positions_only).mirrored
    both = positions_only.copy()
    both[:, :3, :3] = np.diag(mirror) @ est[:, :3, :3] @ np.diag(mirror)
    found = check_conventions(gt, both)
    assert found.mirrored
    # The rotations of a mirrored world are the true ones in another camera frame.
    if mirror != [-1, -1, -1]:  # there they are the true ones
        half_turn = -np.diag(mirror)
        np.testing.assert_allclose(found.body_rotation, half_turn, atol=1e-9)


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
        found = check_conventions(gt, estimate(gt, rng, **INACCURACIES[what]))
        assert told(found) == []
        assert found.body_rotation is None


@pytest.mark.parametrize("angle", [1.0, 2.0, 5.0, 9.0])
def test_a_small_misalignment_is_no_convention(kind, angle):
    rng = np.random.default_rng(5)
    gt = reference(kind, 120, rng)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis), degrees=True).as_matrix()
    found = check_conventions(gt, in_frame(estimate(gt, rng), turn))
    assert found.body_rotation is None
    assert told(found) == []
    assert found.corrected_ras == found.ras


def test_of_cameras_that_hardly_turn_a_swap_of_axes_is_told_that_has_a_use():
    """Of the others one or another fits by chance."""
    rng = np.random.default_rng(0)
    gt = make_poses(random_turns(rng, 2.0), rng.normal(size=(60, 3)))
    noisy = gt[:, :3, :3] @ random_turns(rng, 0.2)
    swaps = Rotation.create_group("O").as_matrix().round()
    found = [check_conventions(gt, make_poses(noisy @ axes, gt[:, :3, 3])) for axes in swaps]
    for axes, one in zip(swaps, found, strict=True):
        common = any(np.array_equal(axes, known) for known in (OPENGL, BODY, BODY.T))
        assert one.body_rotation is not None or not common
        if one.body_rotation is not None:  # of the others some are not told, and none is wrong
            np.testing.assert_allclose(one.body_rotation, axes, atol=0.05)


def test_identity_quaternions_are_no_convention():
    """As of a system that knows positions alone."""
    rng = np.random.default_rng(6)
    gt = reference("wandering", 120, rng)
    est = estimate(gt, rng)
    est[:, :3, :3] = np.eye(3)
    assert check_conventions(gt, est).body_rotation is None
    assert check_conventions(est, gt).body_rotation is None


def test_cameras_that_were_not_estimated_are_left_out():
    rng = np.random.default_rng(7)
    gt = reference("anywhere", 60, rng)
    est = in_frame(estimate(gt, rng), OPENGL)
    est[::2] = np.nan
    np.testing.assert_array_equal(check_conventions(gt, est).body_rotation, OPENGL)
    est[:] = np.nan
    assert check_conventions(gt, est).body_rotation is None


def test_ten_cameras_are_enough():
    rng = np.random.default_rng(9)
    gt = reference("anywhere", 10, rng)
    est = in_frame(estimate(gt, rng), OPENGL)
    np.testing.assert_array_equal(check_conventions(gt, est).body_rotation, OPENGL)


def trajectory(n, *, at_origin):
    poses = reference("wandering", n, np.random.default_rng(n))
    if at_origin:
        poses = np.linalg.inv(poses[0]) @ poses
    return Trajectory(np.linspace(0.0, 10.0, n), poses)


def test_swapped():
    """Where the one is denser and the other starts at the origin."""

    def seem_swapped(gt, est):
        return any(note.kind == "swapped" for note in evaluate(gt, est).notes)

    slam, mocap = trajectory(100, at_origin=True), trajectory(1000, at_origin=False)
    assert seem_swapped(slam, mocap)
    assert not seem_swapped(mocap, slam)
    long = Trajectory(np.linspace(-90, 10, 1000), mocap.poses)  # as many while both run
    # One sign alone is none.
    assert not seem_swapped(slam, long)
    assert not seem_swapped(trajectory(100, at_origin=False), mocap)
    assert not seem_swapped(slam, trajectory(1000, at_origin=True))


def _scaled(poses, factor):
    poses[:, :3, 3] *= factor
    return poses


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p, "no mistake is found"),
        (np.linalg.inv, "the estimated poses are world-to-camera"),
        (
            lambda p: p @ np.diag([1.0, -1.0, -1.0, 1.0]),
            "the camera frame is rotated: 180 deg",
        ),
        (
            lambda p: np.diag([1.0, 1.0, -1.0, 1.0]) @ p @ np.diag([1.0, 1.0, -1.0, 1.0]),
            "mirrored",
        ),
        (lambda p: _scaled(p, 2.5), "no mistake is found"),
    ],
)
def test_conventions_of_arrays(change, words):
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
    with pytest.raises(ValueError, match=r"^gt_poses has 40 .* est_poses has 39; row i of both"):
        check_conventions(gt, est[1:])
    with pytest.raises(ValueError, match=r"^gt_poses\[0\] is not finite"):
        check_conventions(est, gt)


BODY_WORDS = "a frame with x forward, y left, z up"
CAMERA_WORDS = "a camera with x right, y down, z forward"


@pytest.mark.parametrize(
    ("rotation", "words"),
    [
        (OPENGL, "180 deg about x, as OpenGL's camera axes to OpenCV's"),
        (BODY, f"as {BODY_WORDS} to {CAMERA_WORDS}"),
        (BODY.T, f"as {CAMERA_WORDS} to {BODY_WORDS}"),
        (rotation("z", 90), "its x, y, z are the reference's +y, -x, +z"),
        (rotation("x", 180 - 1e-7), "180 deg about x, as OpenGL's camera axes to OpenCV's"),
        (rotation("y", 25), "25.0 deg about (0.00, 1.00, 0.00)"),
    ],
)
def test_a_frame_in_words(rotation, words):
    told = str(Convention(body_rotation=rotation))
    assert told == f"the camera frame is rotated: {words}"
