"""Offsets of clocks that must be found, and estimates that have none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.aligner import normalise
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


class Scripted(timing._ShiftedPositions):
    """Fits as told, and notes what is asked."""

    at_zero: float
    fits: list
    gains: list
    asked: list

    def misfit(self, offset):
        self.asked.append(("misfit", offset))
        return self.at_zero

    def fitted(self, least, most):
        self.asked.append((least, most, self.est_positions))
        return self.fits.pop(0)

    def gain(self, offset, misfit):
        self.asked.append(("gain", offset, misfit))
        return self.gains.pop(0)


@pytest.fixture
def scripted(monkeypatch):
    """Return a function that finds an offset by misfits and gains as told, with all it asked."""
    made = []

    def find(fits, gains, *, apart=False, reference=None, est=None):
        reference = rosette(40) if reference is None else reference
        script = {"at_zero": np.inf if apart else 0.5, "fits": [*fits], "gains": [*gains]}
        one = type("One", (Scripted,), {**script, "asked": []})

        def make(*args):
            made.append(one(*args))
            return made[-1]

        monkeypatch.setattr(timing, "_ShiftedPositions", make)
        found = find_offset(reference, reference if est is None else est)
        assert not one.fits
        assert not one.gains
        return found, one.asked, made[-1]

    return find


NO_FIT = (0.7, np.inf)


@pytest.mark.parametrize(
    ("fits", "gains", "seconds", "gain"),
    [
        # It fits nearby: as it is, little better or worse than at 0, or as much as is needed.
        ([(0.25, 0.1)], [1.19], 0.25, 1.19),
        ([(0.25, 0.1)], [0.9], 0.25, 0.9),
        ([(0.25, 0.1)] + 4 * [NO_FIT], [1.2], 0.25, 1.2),
        ([(0.25, 0.1), (0.5, 0.1), (0.5, 0.2), NO_FIT, NO_FIT], [3.0], 0.25, 3.0),
        # Another convention fits better, at an offset or where it is; the best of them counts.
        ([(0.25, 0.1), (0.5, 0.09), NO_FIT, NO_FIT, NO_FIT], [3.0, 1.2], 0.5, 1.2),
        ([(0.25, 0.1), (0.5, 0.09), NO_FIT, NO_FIT, NO_FIT], [3.0, 1.19], 0.0, 1.0),
        ([(0.25, 0.1), (0.5, 0.09), (0.6, 0.09), (0.75, 0.05), (0.8, 0.07)], [3, 2, 4], 0.75, 4),
        ([(0.25, 0.1), (0.5, 0.09), NO_FIT, (0.75, 0.05), NO_FIT], [3, 2, 1.1], 0.0, 1.0),
        ([NO_FIT, NO_FIT, NO_FIT, NO_FIT, (0.5, 0.2)], [2.5], 0.5, 2.5),
        # Nowhere nearby, but anywhere, as it is.
        (5 * [NO_FIT] + [(9.0, 0.1)], [6.0], 9.0, 6.0),
        (5 * [NO_FIT] + [(9.0, 0.1)], [1.1], 9.0, 1.1),
    ],
)
def test_the_offset_is_that_of_what_fits_best_nearby_then_anywhere(
    scripted, fits, gains, seconds, gain
):
    assert scripted(fits, gains)[0] == timing.TimeOffset(seconds, gain)


def test_where_nothing_fits_there_is_no_offset(scripted):
    assert scripted(6 * [NO_FIT], [])[0] is None
    assert scripted(10 * [NO_FIT], [], apart=True)[0] is None


def test_other_conventions_are_looked_for_anywhere_only_where_the_clocks_are_apart(scripted):
    fits = [*(5 * [NO_FIT]), NO_FIT, NO_FIT, NO_FIT, (9.0, 0.3), (8.0, 0.2)]
    found, asked, _ = scripted(fits, [np.inf, np.inf], apart=True)
    assert found == timing.TimeOffset(8.0, np.inf)
    assert [one for one in asked if one[0] == "gain"] == [("gain", 9.0, 0.3), ("gain", 8.0, 0.2)]
    assert asked[0] == ("misfit", 0.0)


def test_what_is_compared(scripted):
    """300 poses that have a position, evenly spread in the order of time, as they are and in four
    other conventions, within a second and over all that both clocks may have in common."""
    reference, est = rosette(40), rosette(700)
    est.keys[400:430] = est.keys[400]
    backwards = np.r_[400:700, :400]  # the last ones first
    est = Trajectory(est.keys[backwards] - 3.0, est.poses[backwards])
    est.poses[::2, 3] = np.nan  # says nothing
    est.poses[0, :3, :3] = np.nan
    est.poses[100:150, 1, 3] = np.inf
    known = np.delete(np.arange(700), np.s_[100:150])
    in_order = known[np.lexsort((known, est.keys[known]))]
    rows = in_order[np.linspace(0, 649, 300).astype(int)]
    assert rows[[0, -1]].tolist() == [300, 299]
    _, asked, fit = scripted(10 * [NO_FIT], [], apart=True, reference=reference, est=est)
    np.testing.assert_array_equal(fit.ref_stamps, reference.keys)
    np.testing.assert_array_equal(fit.est_stamps, est.keys[rows])
    np.testing.assert_array_equal(fit.ref_positions, normalise(reference.poses[:, :3, 3])[0])
    spans = [one for one in asked if one[0] != "misfit"]
    ends = reference.keys[0] - est.keys[299], reference.keys[-1] - est.keys[300]
    assert [one[:2] for one in spans] == 5 * [(-1.0, 1.0)] + 5 * [ends]
    poses = est.poses[rows]
    expected = [poses[:, :3, 3], *timing._in_other_conventions(poses)]
    for one, positions in zip(spans, 2 * expected, strict=True):
        np.testing.assert_array_equal(one[2], normalise(positions)[0])


def test_both_have_twenty_poses(scripted):
    fit = [(0.25, 0.1)], [1.0]
    assert scripted(*fit, reference=rosette(20), est=rosette(20))[0] is not None
    assert find_offset(rosette(19), rosette(20)) is None
    assert find_offset(rosette(20), rosette(19)) is None


def test_positions_in_other_conventions():
    """A quarter of a turn about z, then no rotation at all."""
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[0, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    poses[:, :3, 3] = [[1, 2, 3], [4, 5, 6]]
    poses[1, :3, :3] = np.nan
    mirrored, inverse, mirrored_inverse, centres = timing._in_other_conventions(poses)
    assert mirrored.tolist() == [[1, 2, -3], [4, 5, -6]]
    assert inverse.tolist() == [[-2, 1, -3], [0, 0, 0]]
    assert mirrored_inverse.tolist() == [[-2, 1, 3], [0, 0, 0]]
    assert centres.tolist() == [[2, -1, -3], [0, 0, 0]]


@pytest.mark.parametrize(
    ("n_est", "n_inside", "fits"),
    [(20, 20, True), (20, 19, False), (60, 30, True), (60, 29, False), (41, 20, False)],
)
def test_a_misfit_is_that_of_twenty_poses_and_half_of_them(monkeypatch, n_est, n_inside, fits):
    asked = []

    def error(gt, est, *, n_hypotheses):
        asked.append((gt[:, 0].tolist(), est[:, 0].tolist(), n_hypotheses))
        return 0.25

    monkeypatch.setattr(timing, "median_error", error)
    positions = np.arange(float(n_est))[:, None] * [1.0, 2.0, 3.0]
    known = np.arange(float(n_inside))
    fit = timing._ShiftedPositions(
        known, np.arange(n_est) - 5.0, 10 * known[:, None] * [1.0, 2.0, 3.0], positions
    )
    assert fit.misfit(5.0) == (0.25 if fits else np.inf)
    assert asked == ([((10 * known).tolist(), known.tolist(), 100)] if fits else [])


class Fixed(timing._ShiftedPositions):
    """Has misfits by offset, and the same extent and error of interpolation everywhere."""

    misfits: dict
    wide = 8.0

    def misfit(self, offset):
        return self.misfits[offset]

    def extent(self, offset):
        assert self.misfits[offset] < np.inf
        return self.wide

    def interpolation_error(self):
        return 0.0092

    def best_offset(self, least, most):
        assert (least, most) == (-4.0, 7.0)
        return 2.0


@pytest.mark.parametrize(
    ("misfit", "wide", "fits"),
    [
        *[(0.79, 8.0, True), (0.81, 8.0, False), (0.0, 8.0, True), (np.inf, 8.0, False)],
        *[(0.0, 0.0, False), (0.01, 0.5, True)],
    ],
)
def test_a_fit_is_within_a_tenth_of_the_extent(misfit, wide, fits):
    kind = type("Kind", (Fixed,), {"misfits": {2.0: misfit}, "wide": wide})
    assert kind(*4 * [np.zeros(0)]).fitted(-4.0, 7.0) == (2.0, misfit if fits else np.inf)


@pytest.mark.parametrize(("at_zero", "gain"), [(0.59, 6.0), (0.0, 0.1), (np.inf, np.inf)])
def test_the_gain_counts_no_misfit_below_interpolation_and_rounding(at_zero, gain):
    """Which are 0.0092 and 0.0001 of the extent: in all 0.01."""
    kind = type("Kind", (Fixed,), {"misfits": {0.0: at_zero, 2.0: 0.09}})
    assert kind(*4 * [np.zeros(0)]).gain(2.0, 0.09) == pytest.approx(gain)


def trials(least, most, best):
    """Return the offsets at which one looks for the best, round by round, and what is found."""
    asked = []

    class Asked(timing._ShiftedPositions):
        def misfit(self, offset):
            asked.append(offset)
            return abs(offset - best)

    found = Asked(*4 * [np.zeros(0)]).best_offset(least, most)
    assert type(found) is float
    rounds = np.split(np.array(asked), [len(asked) - 36 + 9 * k for k in range(4)])
    return found, rounds


@pytest.mark.parametrize(
    ("least", "most", "step", "best"),
    [
        *[(-1.0, 1.0, 0.05, 0.3333), (-1.0, 1.0, 0.05, -1.0), (-1.0, 0.98, 0.05, 1.0)],
        *[(-1.01, 1.0, 0.2, 0.3333), (-1.0, 1.01, 0.2, 0.3333), (-50.0, 50.0, 0.2, -12.34)],
        *[(-300.0, 500.0, 0.2, 499.0), (-1000.0, 7000.0, 2.0, 6543.2)],
    ],
)
def test_the_best_offset_is_sought_in_steps_that_become_smaller(least, most, step, best):
    found, (first, *refined) = trials(least, most, best)
    np.testing.assert_allclose(first, least + step * np.arange(len(first)), atol=1e-9)
    assert most - step / 2 - 1e-9 < first[-1] <= most + step / 2
    middle = first[np.argmin(np.abs(first - best))]
    for tried in refined:
        step /= 4
        np.testing.assert_allclose(tried, middle + step * np.arange(-4, 5), atol=1e-9)
        middle = tried[np.argmin(np.abs(tried - best))]
    assert found == middle
    assert abs(found - best) <= step / 2 + 1e-9


def test_interpolation_error_and_extent_are_medians():
    """Of second differences as long as 8, 16 and 80; of distances from the middle as below."""
    stamps = np.arange(5.0)
    bends = np.array([[0, 8, 0], [0, 0, 80], [16, 0, 0]])
    slopes = np.vstack([np.zeros(3), np.cumsum(bends, axis=0)])
    path = np.vstack([np.zeros(3), np.cumsum(slopes, axis=0)])
    fit = timing._ShiftedPositions(stamps, stamps, path, path)
    assert fit.interpolation_error() == 2.0
    path = np.array([[0.0, 0, 0], [1, 0, 0], [5, 0, 0], [5, 12, 0], [5, 0, 40]])
    fit = timing._ShiftedPositions(stamps, stamps - 1, path, path)
    assert fit.extent(1.0) == 5.0  # of 5, 4, 0, 12, 40 from (5, 0, 0)
    assert fit.extent(0.0) == 2.5  # without the last one; from (3, 0, 0)
