"""Which files an evaluation reads, and what cannot be matched."""

import numpy as np
import pytest

from alignscores import evaluate
from alignscores.trajectories.files import Trajectory


def trajectory(keys):
    poses = np.tile(np.eye(4), (len(keys), 1, 1))
    poses[:, :3, 3] = np.random.default_rng(0).random((len(keys), 3))
    return Trajectory(np.asarray(keys), poses)


@pytest.mark.parametrize("form", ["tum", "arrays"])
def test_names_are_no_time_stamps(form):
    named = trajectory(["a", "b", "c", "d"])
    with pytest.raises(ValueError, match=f"^format={form} has time stamps, not names: leave it"):
        evaluate(named, named, format=form)
    assert evaluate(named, named).pas == 1
