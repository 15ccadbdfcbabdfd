"""Which files an evaluation reads, and what cannot be matched."""

import numpy as np
import pytest

from alignscores import evaluate
from alignscores.evaluation.matching import files_below
from alignscores.trajectories.files import Trajectory


def trajectory(keys):
    poses = np.tile(np.eye(4), (len(keys), 1, 1))
    poses[:, :3, 3] = np.random.default_rng(0).random((len(keys), 3))
    return Trajectory(np.asarray(keys), poses)


def test_files_of_a_model_or_of_models(tmp_path):
    for name in ("b.txt", "a.txt", "0/c.txt", "0/deeper/d.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    found = [path.relative_to(tmp_path).as_posix() for path in files_below(str(tmp_path))]
    assert found == ["0/c.txt", "a.txt", "b.txt"]
    assert list(files_below(tmp_path / "a.txt")) == [tmp_path / "a.txt"]
    assert list(files_below(tmp_path / "none")) == [tmp_path / "none"]


@pytest.mark.parametrize("form", ["tum", "arrays"])
def test_names_are_no_time_stamps(form):
    named = trajectory(["a", "b", "c", "d"])
    with pytest.raises(ValueError, match=f"^format={form} has time stamps, not names: leave it"):
        evaluate(named, named, format=form)
    assert evaluate(named, named).pas == 1
