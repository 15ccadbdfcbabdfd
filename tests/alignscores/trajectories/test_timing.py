"""Offsets of clocks that must be found, and estimates that have none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.trajectories import timing
from alignscores.trajectories.files import Trajectory
from alignscores.trajectories.timing import find_offset


def scene(seed, *, rate=100.0, n=4000):
    """A reference that moves smoothly and never the same way twice."""
    rng = np.random.default_rng(seed)
    times = 1.7e9 + np.arange(n) / rate
    frequencies, phases = rng.uniform(0.1, 0.7, (5, 3)), rng.uniform(0, 6, (5, 3))
    poses = np.tile(np.eye(4), (n, 1, 1))
    waves = np.sin((times - 1.7e9)[:, None, None] * frequencies + phases)
    poses[:, :3, 3] = waves.sum(axis=1)
    return Trajectory(times, poses)


def estimate(reference, seed, *, offset=0.0, sigma=0.02, lost=0.0, rows=slice(300, 3700, 5)):
    rng = np.random.default_rng(seed)
    keys, poses = reference.keys[rows] - offset, reference.poses[rows].copy()
    poses[:, :3, 3] = 3 * poses[:, :3, 3] + rng.normal(0, 3 * sigma, (len(poses), 3)) + 7
    bad = rng.random(len(poses)) < lost
    poses[bad, :3, 3] = rng.uniform(-20, 20, (bad.sum(), 3))
    return Trajectory(keys, poses)


@pytest.mark.parametrize("offset", [-0.8, -0.1, 0.3, 40.0, 1.7e9 + 3])
@pytest.mark.parametrize("lost", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(2))
def test_an_offset_is_found(offset, lost, seed):
    """Near, or anywhere where the stamps count from a start."""
    reference = scene(seed)
    found = find_offset(reference, estimate(reference, seed, offset=offset, lost=lost))
    assert found.seconds == pytest.approx(offset, abs=0.02)
    assert found.significant


def test_an_offset_is_found_by_the_poses_that_have_a_position():
    reference = scene(0)
    some = estimate(reference, 0, offset=0.3)
    some.poses[:, :3, :3] = np.nan
    some.poses[::3, :3, 3] = np.nan
    assert find_offset(reference, some).seconds == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("inaccuracy", [{}, {"sigma": 0.3}, {"lost": 0.4}, {"lost": 1.0}])
@pytest.mark.parametrize("rows", [slice(None, None, 5), slice(0, 1000, 10), slice(0, 500, 100)])
def test_inaccuracy_is_no_offset(inaccuracy, rows):
    for seed in range(2):
        reference = scene(seed)
        found = find_offset(reference, estimate(reference, seed, rows=rows, **inaccuracy))
        assert found is None or not found.significant


@pytest.mark.parametrize("seed", range(3))
def test_where_the_reference_hardly_moves_nothing_fits_better(seed):
    reference = scene(seed)
    reference.poses[:1900, :3, 3] *= 0.001
    inaccurate = estimate(reference, seed, sigma=0.5, rows=slice(None, None, 5))
    found = find_offset(reference, inaccurate)
    assert found is None or not found.significant


def test_a_perfect_estimate_has_no_offset():
    """Not even where all that is left is the error of interpolation, and another fits as well."""
    times = np.arange(600) / 30
    poses = np.tile(np.eye(4), (600, 1, 1))
    poses[:, :3, 3] = np.transpose([np.cos(times), np.sin(times), times])  # fits itself anywhere
    assert not find_offset(Trajectory(times, poses), Trajectory(times[::3], poses[::3])).significant
    between = Trajectory((times[1:] + times[:-1]) / 2, (poses[1:] + poses[:-1]) / 2)
    assert not find_offset(Trajectory(times, poses), between).significant
    poses[:, :3, 3] = (1.7e9 + times)[:, None] - 1.7e9  # straight on, up to the rounding of stamps
    line = Trajectory(times, poses)
    assert not find_offset(line, Trajectory(times[::3] - 0.002, poses[::3])).significant
    poses[:, :3, 3] = 1.0
    assert find_offset(line, line) is None


def test_what_interpolation_misses_is_no_misfit():
    """Of a parabola it is the same everywhere: the most that a chord is away from it."""
    times = np.arange(0.0, 40.0, 2.0)
    curve = np.column_stack([times, times**2, np.zeros_like(times)])
    chords = np.interp(times[:-1] + 1, times, times**2)
    error = np.max(chords - (times[:-1] + 1) ** 2)
    fit = timing._ShiftedPositions(times, times, curve, curve)
    assert fit.interpolation_error() == pytest.approx(error)
    # A perfect fit counts as one with that error.
    moved = curve + np.where(np.arange(20) % 2, 3 * error, -3 * error)[:, None] * [0.0, 0.0, 1.0]
    fit = timing._ShiftedPositions(times, times, curve, moved)
    assert fit.gain(0.0, 0.0) == pytest.approx(1 + fit.misfit(0.0) / error, rel=0.05)


@pytest.mark.parametrize("offset", [-0.777, 0.3131, 40.0237])
def test_without_noise_an_offset_is_found_to_a_millisecond(offset):
    reference = scene(0)
    found = find_offset(reference, estimate(reference, 0, offset=offset, sigma=0))
    assert found.seconds == pytest.approx(offset, abs=1e-3)


@pytest.mark.parametrize(
    ("seconds", "gain", "significant"),
    [(0.3, 1.5, True), (0.3, 1.49, False), (-1.0, 1.5, True), (1.01, 4.99, False), (-9, 5, True)],
)
def test_a_far_offset_must_explain_more_than_a_near_one(seconds, gain, significant):
    assert timing.TimeOffset(seconds, gain).significant is significant


def test_too_few_poses_tell_nothing():
    reference = scene(0)
    assert find_offset(reference, estimate(reference, 0, rows=slice(0, 19))) is None
    assert find_offset(reference, estimate(reference, 0, rows=slice(0, 1000, 50))) is not None


def test_of_poses_at_both_ends_the_reference_knows_the_positions():
    keys, positions = np.arange(3.0), np.arange(9.0).reshape(3, 3)
    fit = timing._ShiftedPositions(keys, np.array([-1.0, 0.0, 0.5, 2.0, 3.0]), positions, positions)
    inside, known = fit._reference_at(0.0)
    assert inside.tolist() == [False, True, True, True, False]
    np.testing.assert_allclose(known, [[0, 1, 2], [1.5, 2.5, 3.5], [6, 7, 8]])


def rosette(n=600):
    """A path on which the mirror image is where the camera was a quarter of a turn earlier."""
    times = np.arange(n) / 30
    poses = np.tile(np.eye(4), (n, 1, 1))
    path = np.cos(times), np.sin(times), 0.5 * np.sin(2 * times)
    poses[:, :3, 3] = np.transpose(path)
    turns = np.transpose([0.3 * np.sin(times), 0.2 * np.cos(times / 3), times / 2])
    poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return Trajectory(times, poses)


CONVENTIONS = "mirrored", "inverted", "translations"


def in_convention(truth, convention):
    poses = truth.copy()
    poses[:, :3, 3] += np.random.default_rng(0).normal(scale=0.01, size=(len(poses), 3))
    inverse = np.linalg.inv(poses)
    if convention == "mirrored":
        poses[:, 1, 3] *= -1
    elif convention == "inverted":
        poses = inverse
    else:
        poses[:, :3, 3] = inverse[:, :3, 3]
    return poses


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_another_convention_is_no_offset(convention):
    reference = rosette()
    poses = in_convention(reference.poses, convention)
    found = find_offset(reference, Trajectory(reference.keys, poses))
    assert found.seconds == 0
    assert not found.significant


@pytest.mark.parametrize("offset", [0.3, 1.7e9])
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_an_offset_is_found_in_another_convention(convention, offset):
    """So that what is said of the convention is true, however far apart the clocks are."""
    reference = scene(0)
    turns = np.sin(np.outer(reference.keys - reference.keys[0], [0.3, 0.2, 0.1]))
    reference.poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    poses = in_convention(reference.poses, convention)[::5]
    found = find_offset(reference, Trajectory(reference.keys[::5] - offset, poses))
    assert found.seconds == pytest.approx(offset, abs=0.02)


def test_an_offset_leaves_half_of_the_estimate_within_the_reference():
    reference = scene(0)
    late = estimate(reference, 0, offset=28.0, rows=slice(1000, None, 5))
    start = Trajectory(reference.keys[:2000], reference.poses[:2000])  # has a third of it
    assert find_offset(start, late) is None
