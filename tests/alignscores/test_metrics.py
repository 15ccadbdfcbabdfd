"""One vocabulary: every metric by one name, whatever its case, or by an old one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import pas, ras, ras_angle, tas, tas_distance
from alignscores.metrics import FAMILIES, SCORES, metric
from baselines import ate


@pytest.fixture
def cameras():
    rng = np.random.default_rng(0)
    gt, rotations = rng.random((20, 3)), Rotation.random(20, rng=rng)
    est = 3 * gt + rng.normal(0, 0.2, (20, 3))
    turned = Rotation.from_rotvec(rng.normal(0, 3, (20, 3)), degrees=True) * rotations
    return gt, rotations.as_matrix(), est, turned.as_matrix()


def test_scores_are_those_of_the_library(cameras):
    gt, gt_rotations, est, est_rotations = cameras
    poses = [np.dstack([cameras[i + 1], cameras[i][:, :, None]]) for i in (0, 2)]
    expected = {
        "TAS": tas(gt, est, rng=3).score,
        "RAS": ras(gt_rotations, est_rotations).score,
        "PAS": pas(*poses, rng=3).score,
        "half_distance": tas_distance(gt, est, rng=3),
        "half_angle": ras_angle(gt_rotations, est_rotations),
    }
    found = {family.example: metric(family.example)(*cameras, rng=3) for family in SCORES}
    assert found.pop("ATE") == pytest.approx(ate(gt, est))
    assert found == expected
    assert 0 < expected["TAS"] < 1


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.example)
def test_every_name_is_found_in_any_case_and_is_of_one_family(family):
    name = family.example
    for asked in (name, name.lower(), f" {name.upper()} "):
        found = metric(asked)
        assert (found.name, found.family) == (name, family)
    others = [other for other in FAMILIES if other.arguments(name.lower()) is not None]
    assert others[0] is family
    assert [other.example for other in others[1:]] == (["ate:rmse"] if name == "ATE" else [])
    assert metric(name).worst == (0 if family.larger_is_better else np.inf)
