"""Deficits of a score: against brute force, and on estimates with known faults."""

from itertools import combinations, pairwise

import numpy as np
import pytest

from alignscores import Trajectory, evaluate
from alignscores.evaluation.deficits import deficits, order_of_frames

THRESHOLDS = np.arange(1, 11) / 10


def best_excess(missing, lost, n_ranges=3):
    """Return the largest excess of disjoint ranges, of one cause each, over as many mean frames."""
    n = len(missing)
    ranges = [
        (first, last)
        for first in range(n)
        for last in range(first + 1, n + 1)
        if len(set(lost[first:last])) == 1
    ]
    return max(
        sum(np.sum(missing[a:b] - missing.mean()) for a, b in chosen)
        for count in range(1, n_ranges + 1)
        for chosen in combinations(ranges, count)
        if all(first[1] <= second[0] for first, second in pairwise(chosen))
    )


@pytest.mark.parametrize("seed", range(60))
def test_no_other_stretches_cost_more_in_excess_of_average_frames(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 9))
    lost = rng.random(n) < 0.4
    errors = np.where(lost, np.inf, rng.choice([0.0, 0.25, 0.5, 2.0], n))
    missing = np.array([np.mean(error >= THRESHOLDS) for error in errors])
    entries = deficits("TAS", errors, THRESHOLDS, lost, np.arange(n))
    if not missing.any():
        assert entries == []
        return
    stretches = [stretch for stretch in entries if stretch.start is not None]
    assert len(stretches) in (1, 2, 3)
    excess = sum(stretch.cost * n - stretch.frames * missing.mean() for stretch in stretches)
    assert excess == pytest.approx(best_excess(missing, lost))
    for stretch in stretches:
        rows = slice(stretch.start, stretch.end + 1)
        assert stretch.frames == stretch.end + 1 - stretch.start
        assert stretch.cost == pytest.approx(missing[rows].sum() / n)
        assert set(lost[rows]) == {stretch.cause == "lost"}
    assert [stretch.cost for stretch in stretches] == sorted(
        (stretch.cost for stretch in stretches), reverse=True
    )
    assert sum(stretch.frames for stretch in entries) == n
    assert sum(stretch.cost for stretch in entries) == pytest.approx(missing.mean())
    assert sum(stretch.share for stretch in entries) == pytest.approx(1)


def test_even_losses_are_one_stretch():
    (rest,) = deficits("RAS", np.full(9, 5.0), THRESHOLDS, np.zeros(9, dtype=bool), np.arange(9))
    assert (rest.start, rest.end, rest.frames, rest.cost, rest.share) == (0, 8, 9, 1, 1)
    assert rest.cause == "rotation"


def test_images_are_in_the_order_of_their_names():
    keys = np.array(["b/2.png", "a/10.png", "a/9.png", "b/1.png"])
    assert keys[order_of_frames(keys)].tolist() == ["a/9.png", "a/10.png", "b/1.png", "b/2.png"]
    lost = np.array([True, False, False, True])
    (stretch,) = [
        entry
        for entry in deficits("TAS", np.where(lost, np.inf, 0), THRESHOLDS, lost, keys)
        if entry.start
    ]
    assert (stretch.start, stretch.end, stretch.cause) == ("b/1.png", "b/2.png", "lost")


@pytest.mark.parametrize("missing", ["fail", "ignore"])
@pytest.mark.parametrize("registration", ["refined", "pcr99"])
def test_stretches_are_where_the_estimate_has_its_faults(missing, registration):
    rng = np.random.default_rng(0)
    stamps = 1e9 + np.arange(200) / 10
    poses = np.tile(np.eye(4), (200, 1, 1))
    poses[:, :3, 3] = np.cumsum(rng.normal(size=(200, 3)), axis=0)
    estimate = poses.copy()
    estimate[50:60, :3, 3] += 1e3
    estimate[150:155, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    rows = np.r_[0:100, 130:200]
    options = {"missing": missing, "registration": registration, "max_gap": 0.0}
    evaluation = evaluate(
        Trajectory(stamps, poses), Trajectory(stamps[rows], estimate[rows]), format="tum", **options
    )
    for score in ("TAS", "RAS"):
        entries = [deficit for deficit in evaluation.deficits if deficit.score == score]
        assert sum(deficit.cost for deficit in entries) == pytest.approx(
            1 - getattr(evaluation.result, score.lower()).score
        )
    stretches = {
        (d.score, d.cause, d.start, d.end) for d in evaluation.deficits if d.start is not None
    }
    faults = {("TAS", "position", 5.0, 5.9), ("RAS", "rotation", 15.0, 15.4)}
    lost = {("TAS", "lost", 10.0, 12.9), ("RAS", "lost", 10.0, 12.9)}
    assert stretches == faults | (lost if missing == "fail" else set())
    assert evaluation.to_dict()["deficits"][0]["score"] == "TAS"
