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


@pytest.mark.parametrize(("n_ref", "n_est", "enough"), [(5, 4, True), (5, 3, False), (3, 3, True)])
def test_it_takes_four_poses_or_all(n_ref, n_est, enough):
    both = trajectory(np.arange(float(n_ref))), trajectory(np.arange(float(n_est)))
    changes = {"missing": "ignore", "t_max_diff": 0.25, "max_gap": 0, "t_end": 9, "unit": 1}
    if enough:
        assert evaluate(*both, **changes).to_dict()["matched"] == n_est
        return
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        evaluate(*both, **changes)
    assert str(caught.value) == (
        "only 3 of 3 poses could be matched to the reference, and it takes 4 (--missing ignore, "
        "--t_max_diff 0.25, --t_offset 0.0, --max_gap 0.0, --t_end 9.0)"
    )


@pytest.mark.parametrize("form", ["tum", "arrays"])
def test_names_are_no_time_stamps(form):
    named = trajectory(["a", "b", "c", "d"])
    with pytest.raises(ValueError, match=f"^format={form} has time stamps, not names: leave it"):
        evaluate(named, named, format=form)
    assert evaluate(named, named).pas == 1
