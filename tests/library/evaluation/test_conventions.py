"""Mistakes of convention are found, and inaccuracy is not mistaken for one."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Trajectory, evaluate, ras
from alignscores.io import inverse_poses, read_tum

OPENGL = np.diag([1.0, -1.0, -1.0])
BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
IMU = Rotation.from_rotvec([30, -50, 80], degrees=True).as_matrix()
FRAMES = {"OpenGL": OPENGL, "body": BODY, "camera": BODY.T, "IMU": IMU}


def make_poses(rotations, positions):
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations, positions
    return poses


def reference(motion, n, rng):
    """Poses that look anywhere, about one axis as of a vehicle, wander slowly, or never turn."""
    steps = rng.normal(size=(n, 3))
    if motion == "anywhere":
        return make_poses(Rotation.random(n, rng=rng).as_matrix(), steps)
    if motion == "vehicle":
        heading = np.cumsum(rng.normal(0, 0.3, n))
        path = np.cumsum(np.column_stack([np.cos(heading), np.sin(heading), np.zeros(n)]), axis=0)
        return make_poses(Rotation.from_euler("z", heading[:, None]).as_matrix(), path)
    if motion == "wandering":
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


def notes_on_conventions(gt, est):
    """Return the notes on mistakes of convention, by kind."""
    notes = evaluate(gt, est).notes
    kinds = "inverted", "inverted rotations", "quaternions", "mirrored", "frame"
    return {note.kind: note.text for note in notes if note.kind in kinds}


def found_frame(gt, est):
    """Return the rotation of the camera frame that ``body_rotation="auto"`` removes."""
    return evaluate(gt, est, body_rotation="auto").body_rotation


@pytest.fixture(params=["anywhere", "vehicle", "wandering"])
def motion(request):
    return request.param


@pytest.mark.parametrize("frame", FRAMES)
def test_a_rotated_camera_frame_is_found_and_corrected(motion, frame):
    rng = np.random.default_rng([len(motion), len(frame)])
    gt = reference(motion, 120, rng)
    est = estimate(gt, rng, lost=0.4)
    mixed_up = in_frame(est, FRAMES[frame])
    assert notes_on_conventions(gt, mixed_up).keys() == {"frame"}
    turn = found_frame(gt, mixed_up)
    mended = in_frame(mixed_up, turn.T)
    honest = ras(gt[:, :3, :3], est[:, :3, :3]).score
    assert ras(gt[:, :3, :3], mended[:, :3, :3]).score > honest - 0.03
    assert ras(gt[:, :3, :3], mixed_up[:, :3, :3]).score < honest / 3
    angle, true_angle, off = (
        np.degrees(Rotation.from_matrix(rotation).magnitude())
        for rotation in (turn, FRAMES[frame], turn.T @ FRAMES[frame])
    )
    if motion == "vehicle":  # other frames explain turns about one axis as well
        assert angle < true_angle + 2.0
    else:
        assert off < (2.0 if frame == "IMU" else 1e-9)


@pytest.mark.parametrize("frame", [None, "OpenGL", "IMU"])
def test_world_to_camera_poses_are_found(motion, frame):
    rng = np.random.default_rng([len(motion), 7])
    gt = reference(motion, 120, rng)
    est = estimate(gt, rng, lost=0.4)
    if frame is not None:
        est = in_frame(est, FRAMES[frame])
    ((mistake, text),) = notes_on_conventions(gt, inverse_poses(est)).items()
    assert mistake == "inverted"
    assert ("the camera frame of the estimate is rotated" in text) == (frame is not None)
    now, corrected = map(float, re.search(r"\(PAS (.*) as it is, (.*) corrected\)", text).groups())
    assert corrected > 3 * now or corrected > now + 0.3


@pytest.mark.parametrize("motion", ["anywhere", "wandering"])
@pytest.mark.parametrize("order", [[3, 0, 1, 2], [1, 2, 3, 0]], ids=["w first", "w last"])
def test_quaternions_with_w_at_the_wrong_end(motion, order):
    rng = np.random.default_rng(8)
    gt = reference(motion, 120, rng)
    est = estimate(gt, rng)
    quaternions = Rotation.from_matrix(est[:, :3, :3]).as_quat()
    est[:, :3, :3] = Rotation.from_quat(quaternions[:, order]).as_matrix()
    assert notes_on_conventions(gt, est).keys() == {"quaternions"}


@pytest.mark.parametrize("motion", ["anywhere", "wandering"])
def test_inverted_rotations_with_true_positions_are_found(motion):
    rng = np.random.default_rng(8)
    gt = reference(motion, 120, rng)
    est = estimate(gt, rng, lost=0.4)
    est[:, :3, :3] = est[:, :3, :3].transpose(0, 2, 1)
    ((mistake, text),) = notes_on_conventions(gt, est).items()
    assert mistake == "inverted rotations"
    assert "the camera frame" not in text


@pytest.mark.parametrize("motion", ["anywhere", "wandering"])
@pytest.mark.parametrize("mirror", [[1, 1, -1], [-1, -1, -1]])
def test_mirrored_positions_are_found(motion, mirror):
    rng = np.random.default_rng(4)
    gt = reference(motion, 120, rng)
    est = estimate(gt, rng, lost=0.4)
    positions_only = est.copy()
    positions_only[:, :3, 3] *= mirror
    assert notes_on_conventions(gt, positions_only).keys() == {"mirrored"}
    both = positions_only.copy()
    both[:, :3, :3] = np.diag(mirror) @ est[:, :3, :3] @ np.diag(mirror)
    assert notes_on_conventions(gt, both).keys() == {"mirrored"}
    # The rotations of a mirrored world are the true ones in another camera frame.
    if mirror != [-1, -1, -1]:  # there they are the true ones
        half_turn = -np.diag(mirror)
        np.testing.assert_allclose(found_frame(gt, both), half_turn, atol=0.02)


INACCURACIES = {
    "exact": {"sigma_t": 0.0, "sigma_deg": 0.0},
    "noise": {"sigma_t": 0.1, "sigma_deg": 4.0},
    "much noise": {"sigma_t": 1.0, "sigma_deg": 20.0},
    "half of it lost": {"lost": 0.5},
    "most of it lost": {"lost": 0.8},
    "all of it lost": {"lost": 1.0},
    "drift": {"drift_deg": 60.0},
}


@pytest.mark.parametrize("n", [4, 12, 100])
@pytest.mark.parametrize("motion", ["anywhere", "vehicle", "wandering", "never turning"])
@pytest.mark.parametrize("what", INACCURACIES)
def test_inaccuracy_is_no_convention(motion, what, n):
    rng = np.random.default_rng(n)
    gt = reference(motion, n, rng)
    assert notes_on_conventions(gt, estimate(gt, rng, **INACCURACIES[what])) == {}


@pytest.mark.parametrize("angle", [2.0, 9.0])
def test_a_small_misalignment_is_no_convention(motion, angle):
    rng = np.random.default_rng(5)
    gt = reference(motion, 120, rng)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis), degrees=True).as_matrix()
    assert notes_on_conventions(gt, in_frame(estimate(gt, rng), turn)) == {}


def test_identity_quaternions_are_no_convention():
    """As of a system that estimates only positions."""
    rng = np.random.default_rng(6)
    gt = reference("wandering", 120, rng)
    est = estimate(gt, rng)
    est[:, :3, :3] = np.eye(3)
    assert notes_on_conventions(gt, est) == {}


def test_cameras_that_were_not_estimated_are_left_out():
    rng = np.random.default_rng(7)
    gt = reference("anywhere", 60, rng)
    est = in_frame(estimate(gt, rng), OPENGL)
    est[::2] = np.nan
    np.testing.assert_array_equal(found_frame(gt, est), OPENGL)
    est[4:] = np.nan
    assert found_frame(gt, est) is None


def test_what_is_no_rotation_is_left_to_the_scores():
    """Between two frames no score has it, and no hint looks at it more closely."""
    rng = np.random.default_rng(9)
    gt = reference("wandering", 600, rng)
    est = estimate(gt, rng, sigma_deg=20.0)
    est[1:200:2, :3, :3] = 0
    stamps = np.arange(600) / 20
    assert evaluate(Trajectory(stamps, gt), Trajectory(stamps, est)).ras < 0.1


BODY_WORDS = "a frame with x forward, y left, z up"
CAMERA_WORDS = "a camera with x right, y down, z forward"


@pytest.mark.parametrize(
    ("rotation", "words"),
    [
        (OPENGL, "180 deg about x, as OpenGL's camera axes to OpenCV's"),
        (BODY, f"as {BODY_WORDS} to {CAMERA_WORDS}"),
        (BODY.T, f"as {CAMERA_WORDS} to {BODY_WORDS}"),
        (rotation("x", 180 - 1e-7), "180 deg about x, as OpenGL's camera axes to OpenCV's"),
        (rotation("y", 25), "25.0 deg about (0.00, 1.00, 0.00)"),
    ],
)
def test_a_frame_in_words(rotation, words):
    gt = reference("anywhere", 60, np.random.default_rng(8))
    text = notes_on_conventions(gt, in_frame(gt, rotation))["frame"]
    frames = "the camera frame of the estimate is rotated against that of the reference, "
    assert text.startswith(f"{frames}{words} (PAS")


def test_two_files_with_inverse_poses_are_named_where_a_camera_frame_explains_them_too():
    """As in vggt#229: coordinate frames that differ by a rotation, with the same origin."""
    rng = np.random.default_rng(11)
    gt = reference("wandering", 80, rng)
    est = gt.copy()
    est[:, :3] = Rotation.from_rotvec([0.2, 0.3, -0.6]).as_matrix() @ gt[:, :3]
    inverted = inverse_poses(gt), inverse_poses(est)
    (note,) = [str(note) for note in evaluate(*inverted).notes if note.kind == "frame"]
    assert "; or the poses of both the reference and the estimate seem to be world-to-cam" in note
    assert note.endswith("(PAS 1.000 corrected); --ref_invert --est_invert corrects it")
    assert evaluate(*inverted, ref_invert=True, est_invert=True).pas == 1
    imu = [str(note) for note in evaluate(gt, in_frame(est, IMU)).notes if note.kind == "frame"]
    assert imu[0].endswith("--body_rotation auto removes it")


def test_two_files_with_inverse_poses_are_found_by_their_positions():
    """Their coordinate frames differ by origin and scale; their rotations agree as well."""
    rng = np.random.default_rng(12)
    gt = reference("wandering", 120, rng)
    gt[:, :3, 3] = 0.1 * gt[:, :3, 3] + [3.0, 1.0, 0.0]
    est = gt.copy()
    est[:, :3, 3] = 0.5 * gt[:, :3, 3] + [2.0, -1.0, 3.0] + rng.normal(0, 0.01, (120, 3))
    est[:, :3, :3] = (
        Rotation.from_rotvec(rng.normal(0, 0.02, (120, 3))).as_matrix() @ est[:, :3, :3]
    )
    assert notes_on_conventions(gt, est) == {}
    notes = notes_on_conventions(inverse_poses(gt), inverse_poses(est))
    assert notes["inverted"].startswith("the poses of both the reference and the estimate seem")
    far = gt.copy(), est.copy()
    for poses in far:
        poses[:, :3, 3] += [500.0, 0.0, 0.0]
    far[1][:, :3, 3] += rng.normal(0, 0.5, (120, 3))  # wrong positions, far from the origin
    assert notes_on_conventions(*far) == {}


@pytest.mark.parametrize("far", [0.0, 50.0])
def test_of_two_files_in_the_same_frame_either_one_may_be_inverted(far):
    """Inverse poses of the other file fit as well, in other coordinates."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        gt = reference("wandering", 100, rng)
        gt[:, :3, 3] += far
        est = gt.copy()
        est[:, :3, 3] += rng.normal(0, 0.3, (100, 3))
        for pair in ((gt, inverse_poses(est)), (inverse_poses(gt), est)):
            (text,) = [str(note) for note in evaluate(*pair).notes if note.kind == "inverted"]
            for name in ("the reference", "the estimate"):
                assert f"the poses of {name} seem to be world-to-camera (PAS" in text


def test_drift_about_the_origin_is_no_inversion():
    """It moves no inverse pose."""
    rng = np.random.default_rng(14)
    gt = reference("vehicle", 120, rng)
    est = gt.copy()
    noise = Rotation.from_rotvec(rng.normal(0, 1, (120, 3)), degrees=True).as_matrix()
    est[:, :3, :3] = noise @ gt[:, :3, :3]
    drift = Rotation.from_rotvec(np.linspace(0, 0.5, 120)[:, None] * [0, 0, 1]).as_matrix()
    est[:, :3] = drift @ est[:, :3]
    assert notes_on_conventions(gt, est) == {}


def test_an_inverted_file_is_found_where_cameras_hardly_turn():
    """Rotations agree as they are; positions do not."""
    rng = np.random.default_rng(15)
    gt = reference("wandering", 200, rng)
    gt[:, :3, :3] = Rotation.from_rotvec(rng.normal(0, 0.3, (200, 3)), degrees=True).as_matrix()
    gt[:, :3, 3] += [100.0, 0.0, 0.0]
    est = estimate(gt, rng, sigma_t=0.02, sigma_deg=0.01)
    assert notes_on_conventions(gt, est) == {}
    assert notes_on_conventions(gt, inverse_poses(est)).keys() == {"inverted"}


def test_mirrored_poses_on_a_plane_differ_from_another_camera_frame():
    """Both raise the score; the mirrored reference more."""
    rng = np.random.default_rng(13)
    gt = reference("vehicle", 120, rng)
    gt[:, 2, 3] = 0.1 * rng.normal(size=120)
    gt[:, :3, :3] = gt[:, :3, :3] @ Rotation.from_rotvec(rng.normal(0, 0.15, (120, 3))).as_matrix()
    est = estimate(gt, rng)
    mirror = np.diag([1.0, 1.0, -1.0])
    est[:, :3, 3] = est[:, :3, 3] @ mirror
    est[:, :3, :3] = mirror @ est[:, :3, :3] @ mirror
    assert notes_on_conventions(gt, est).keys() == {"mirrored"}


@pytest.mark.parametrize("degrees", [3, 9])
def test_axes_that_are_a_few_degrees_off_are_inaccuracy(motion, degrees):
    """Not transposed rotations, nor the order of quaternions, of both files."""
    for seed in range(2):
        rng = np.random.default_rng([seed, degrees])
        gt = reference(motion, 200, rng)
        axis = rng.normal(size=3)
        turn = Rotation.from_rotvec(degrees * axis / np.linalg.norm(axis), degrees=True)
        noise = Rotation.from_rotvec(rng.normal(0, 1, (200, 3)), degrees=True)
        est = make_poses(noise.as_matrix() @ gt[:, :3, :3] @ turn.as_matrix(), gt[:, :3, 3])
        est[:, :3, 3] += rng.normal(0, 0.1, (200, 3))
        assert notes_on_conventions(gt, est) == {}


def test_mirrored_positions_of_a_poor_estimate_are_named():
    """What they cost is small, but beyond chance."""
    rng = np.random.default_rng(4)
    gt = reference("wandering", 400, rng)
    est = estimate(gt, rng, sigma_t=0.9)
    assert notes_on_conventions(gt, est) == {}
    est[:, 2, 3] *= -1
    assert set(notes_on_conventions(gt, est)) == {"mirrored"}


@pytest.mark.parametrize("sigma", [0.02, 0.3])
def test_a_camera_frame_is_likelier_than_the_same_mistake_in_both_files(sigma):
    """In one coordinate frame, transposed rotations of both may fit as well."""
    rng = np.random.default_rng(4)
    gt = reference("anywhere", 200, rng)
    est = in_frame(gt, Rotation.from_rotvec([1.0, 0.7, -1.2]).as_matrix())
    est[:, :3, 3] += rng.normal(0, sigma, (200, 3))
    notes = evaluate(Trajectory(np.arange(200) / 10, gt), Trajectory(np.arange(200) / 10, est))
    (hint,) = [note for note in notes.notes if note.kind == "frame"]
    assert hint.text.startswith("the camera frame of the estimate is rotated")


def test_a_mirror_that_fits_as_well_as_another_camera_frame_is_said():
    """On a plane both are the same."""
    rng = np.random.default_rng(2)
    gt = reference("vehicle", 200, rng)
    est = estimate(gt, rng, sigma_t=0.0)
    flipped = in_frame(est, OPENGL)
    notes = evaluate(Trajectory(np.arange(200) / 10, gt), Trajectory(np.arange(200) / 10, flipped))
    (hint,) = [note for note in notes.notes if note.kind == "frame"]
    assert "; or the reference and the estimate are mirror images" in hint.remedy


def test_mirrored_positions_that_cost_less_than_a_tenth_are_named_if_motions_show_them(real):
    """Most of the path of a drone is nearly a plane."""
    folder = real / "euroc/MH_03"
    gt, est = (read_tum(folder / name) for name in ("groundtruth.txt", "vio_stereo/0.txt"))
    assert notes_on_conventions(gt, est) == {}
    mirror = np.diag([1.0, 1.0, -1.0])
    mirrored = est.poses.copy()
    mirrored[:, :3, 3] = mirrored[:, :3, 3] @ mirror
    assert set(notes_on_conventions(gt, est._replace(poses=mirrored))) == {"mirrored"}


def test_a_camera_frame_that_needs_no_rotation_is_noted_where_one_was_asked_for():
    gt = reference("anywhere", 60, np.random.default_rng(8))
    (note,) = evaluate(gt, in_frame(gt, rotation("y", 5)), body_rotation="auto").notes
    assert str(note) == (
        "no rotation of the camera frame was removed: none of more than 10 degrees raises the RAS "
        "clearly"
    )
