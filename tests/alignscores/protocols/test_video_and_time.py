"""Errors of generated videos, and errors over seconds.

The values of the former are outputs of CamI2V (ZGCTroy/CamI2V at c5d7b2f, `metric` of
`relative_pose`) on the inputs of test_reference_values.py.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.cli import main
from alignscores.protocols import (
    NoValueError,
    evo_rpe,
    protocol,
    video_error,
)

from .test_reference_values import SHARED, own_cases, shared_cases

# RotErr, TransErr, CamMC, and the latter two with the scale of the truth.
CAMI2V = {
    "clean_same_world": (2.1073424255447017e-08, 0.0, 0.0, 0.0, 0.0),
    "noise_same_world": (
        0.052905271114304,
        0.035067661244482864,
        0.0834125998686694,
        0.035280316378008277,
        0.08365828027508412,
    ),
    "noise_sim3_world": (
        0.5688556408787727,
        0.14175112903745285,
        0.8182153488098063,
        17.80627309730196,
        17.82793376350816,
    ),
    "outliers10_sim3": (
        7.073670191726705,
        2.60899943247141,
        8.270975884892566,
        14.028036844977697,
        18.99772026133642,
    ),
    "outliers50_sim3": (
        64.96525858145438,
        22.825981574152777,
        76.18374981119673,
        30.826028969516642,
        79.96275745890516,
    ),
    "collinear": (
        0.1649682620401218,
        0.08811155869026041,
        0.2711284000110314,
        3.0433511354553637,
        3.0647805549753917,
    ),
    "equal_centres": (
        0.06451413411916043,
        0.032925745634739205,
        0.10118465186480882,
        0.03250982046375243,
        0.10120808213993797,
    ),
    "pure_rotation": (0.14669466599286632, 0.0, 0.2074450826228782, 0.0, 0.2074450826228782),
    "drive_drift": (
        2.0989241442799584,
        0.22525628706857523,
        2.977322229530295,
        0.2559928355942488,
        2.979782632861279,
    ),
    "planar_through_origin": (
        0.3486580182082759,
        0.173802408359105,
        0.5300820222482691,
        10.06025302611275,
        10.076817492420165,
    ),
    "kitti00_orb": (
        6.081766450112583,
        2.912008615784706,
        9.205992690031449,
        3.1127765865756194,
        9.286544917487205,
    ),
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
    values = [
        video_error(gt, est, error=error, scale=scale)
        for error, scale in (
            ("rotation", "cami2v"),
            ("translation", "cami2v"),
            ("pose", "cami2v"),
            ("translation", "cami2v-abs"),
            ("pose", "cami2v-abs"),
        )
    ]
    assert values == pytest.approx(CAMI2V[name], abs=2e-6)  # its arccos loses half of the digits


def test_cameractrl_by_its_formula():
    gt, est = poses_of("noise_sim3_world")
    first = [np.linalg.inv(world[0]) @ world for world in (gt, est)]
    expected = np.linalg.norm(first[1][:, :3, 3] - first[0][:, :3, 3], axis=1).sum()
    assert video_error(gt, est, error="translation", scale="cameractrl") == pytest.approx(expected)
    assert protocol("transerr:cameractrl").arguments["scale"] == "cameractrl"


def test_a_video_needs_all_frames():
    gt = np.tile(np.eye(4), (3, 1, 1))
    est = gt.copy()
    est[1] = np.nan
    with pytest.raises(NoValueError, match="it takes all frames, and frame 1 has no estimate"):
        video_error(gt, est)


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


def test_over_seconds_by_the_command(examples, capsys):
    """The example has 10 frames a second."""
    files = [str(examples / "tum" / name) for name in ("reference.txt", "estimate.txt")]
    names = "rpe@1s,rpe@1s:rotation,rpe@0.5s:all"
    assert main(["tum", *files, "--metrics", names]) == 0
    header, row, *_ = capsys.readouterr().out.splitlines()
    assert header.split()[1] == "rpe@1s"
    assert "-" not in row.split()
    files = [str(examples / "kitti" / name) for name in ("reference.txt", "estimate.txt")]
    with pytest.raises(SystemExit):
        main(["kitti", *files, "--metrics", "rpe@1s"])
    assert "rpe@1s needs time stamps, which the files lack" in capsys.readouterr().err
