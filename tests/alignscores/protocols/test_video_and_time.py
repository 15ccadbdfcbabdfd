"""Errors of generated videos, and errors over seconds.

The values of the former are outputs of CamI2V (ZGCTroy/CamI2V at c5d7b2f, `metric` of
`relative_pose`) on the inputs of test_reference_values.py.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.protocols import NoValueError, evo_rpe, protocol, video_error

from .test_reference_values import SHARED, own_cases, shared_cases

# RotErr, TransErr, CamMC, and the latter two with the scale of the truth.
CAMI2V = {
    "noise_sim3_world": (0.5688556, 0.1417511, 0.8182153, 17.80627, 17.82793),
    "outliers50_sim3": (64.96526, 22.82598, 76.18375, 30.82603, 79.96276),
    "collinear": (0.1649683, 0.08811156, 0.2711284, 3.043351, 3.064781),
    "pure_rotation": (0.1466947, 0, 0.2074451, 0, 0.2074451),
    "drive_drift": (2.098924, 0.2252563, 2.977322, 0.2559928, 2.979783),
    "kitti00_orb": (6.081766, 2.912009, 9.205993, 3.112777, 9.286545),
}


def poses_of(name):
    if name in own_cases():
        case = own_cases()[name]
    elif (SHARED / "reference" / "protocols.npz").exists():
        case = shared_cases()[name]
    else:
        pytest.skip("no shared reference values")
    return case["gt"], case["est"]


@pytest.mark.parametrize("name", CAMI2V)
def test_cami2v(name):
    gt, est = poses_of(name)
    errors = ("rotation", "translation", "pose")
    values = [video_error(gt, est, error=error) for error in errors]
    values += [video_error(gt, est, error=error, scale="cami2v-abs") for error in errors[1:]]
    assert values == pytest.approx(CAMI2V[name], rel=1e-6, abs=2e-6)


def test_cameractrl_by_its_formula():
    gt, est = poses_of("noise_sim3_world")
    first = [np.linalg.inv(world[0]) @ world for world in (gt, est)]
    expected = np.linalg.norm(first[1][:, :3, 3] - first[0][:, :3, 3], axis=1).sum()
    assert video_error(gt, est, error="translation", scale="cameractrl") == pytest.approx(expected)
    assert protocol("transerr:cameractrl").arguments["scale"] == "cameractrl"


def driving(n=60, rate=10.0):
    rng = np.random.default_rng(0)
    gt = np.tile(np.eye(4), (n, 1, 1))
    gt[:, :3, :3] = Rotation.from_euler("z", np.arange(n)[:, None], degrees=True).as_matrix()
    gt[:, :3, 3] = np.cumsum(rng.random((n, 3)), axis=0)
    est = gt.copy()
    est[:, :3, 3] += rng.normal(0, 0.1, (n, 3))
    return gt, est, np.arange(n) / rate


@pytest.mark.parametrize("error", ["translation", "rotation", "distance"])
def test_over_seconds(error):
    """At a constant rate it is the error over frames; by plain loops at any."""
    gt, est, stamps = driving()
    over = {"error": error, "seconds": 1.0}
    frames = evo_rpe(gt, est, error=error, frames=10)
    assert evo_rpe(gt, est, stamps=stamps, **over) == pytest.approx(frames)
    # The pair of a frame near the end may be shorter by a tenth: that of 50 and 59.
    frames = evo_rpe(gt, est, error=error, frames=10, pairs="all", statistic="sse")
    last = evo_rpe(gt[[50, 59]], est[[50, 59]], error=error, statistic="sse")
    found = evo_rpe(gt, est, stamps=stamps, pairs="all", statistic="sse", **over)
    assert found == pytest.approx(frames + last)


def test_over_seconds_between_frames_that_are_lost():
    gt, est, stamps = driving()
    est[3:25] = np.nan
    kept = np.isfinite(est).all(axis=(1, 2))
    pairs, start = [], None
    for row in np.flatnonzero(kept):
        if start is None or stamps[row] - stamps[start] >= 1 - 1e-9:
            pairs += [] if start is None else [(start, row)]
            start = row
    errors = [
        np.linalg.norm(
            (np.linalg.inv(np.linalg.inv(gt[i]) @ gt[j]) @ np.linalg.inv(est[i]) @ est[j])[:3, 3]
        )
        for i, j in pairs
    ]
    found = evo_rpe(gt, est, seconds=1.0, stamps=stamps)
    assert found == pytest.approx(np.sqrt(np.mean(np.square(errors))))


def test_seconds_need_stamps():
    gt, est, stamps = driving()
    with pytest.raises(ValueError, match="stamps must have a time stamp of each pose"):
        evo_rpe(gt, est, seconds=1.0, stamps=stamps[1:])
    with pytest.raises(ValueError, match="stamps must have a time stamp of each pose"):
        evo_rpe(gt, est, seconds=1.0)
    with pytest.raises(NoValueError, match="no two poses with an estimate are 60 s apart"):
        evo_rpe(gt, est, seconds=60.0, stamps=stamps)
