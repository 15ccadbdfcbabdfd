"""Errors of generated videos.

The values are outputs of CamI2V (ZGCTroy/CamI2V at c5d7b2f, `metric` of
`relative_pose`) on the inputs of test_reference_values.py.
"""

import numpy as np
import pytest

from alignscores.metrics import metric, video_error

from .test_reference_values import SHARED, shared_cases, synthetic_cases

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
    if name in synthetic_cases():
        case = synthetic_cases()[name]
    elif (SHARED / "reference" / "protocols.npz").exists():
        case = shared_cases()[name]
    else:
        pytest.skip("no shared reference values")
    return case["gt"], case["est"]


@pytest.mark.parametrize("name", CAMI2V)
def test_errors_are_those_of_cami2v(name):
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
    assert metric("transerr:cameractrl")(gt, est) == pytest.approx(expected)
