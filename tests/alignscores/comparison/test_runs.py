"""What the comparison knows of a run."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Settings
from alignscores.comparison.runs import Outcome, Task, evaluate_run
from alignscores.evaluation.evaluation import STATUSES

N = 24  # poses of the reference, 0.1 s apart
POSITIONS = np.random.default_rng(0).integers(0, 9, (N, 3))
QUATERNIONS = Rotation.random(N, rng=np.random.default_rng(1)).as_quat()
POSES = np.column_stack([np.arange(N) / 10, POSITIONS, QUATERNIONS])  # as TUM has them


@pytest.fixture
def task(tmp_path):
    """(stamped poses of the estimate, settings) -> a run."""

    def task(estimate, **settings):
        for name, poses in (("gt.txt", POSES), ("est.txt", estimate)):
            np.savetxt(tmp_path / name, poses, fmt="%.17g")
        files = str(tmp_path / "gt.txt"), str(tmp_path / "est.txt")
        return Task(*files, Settings(format="tum", **settings))

    return task


def test_all_that_is_known_of_a_run(task):
    """Every second pose, half as large, without an error: but some have no rotation or position."""
    estimate = POSES[:18:2].copy()
    estimate[:, 1:4] = estimate[:, 1:4] / 2 + 1
    estimate[3, 4:] = np.nan
    estimate[5, 1:4] = np.nan
    settings = {"unit": 0.5, "max_gap": 0.15, "metrics": ("ate:rmse", "kitti")}
    found = evaluate_run(task(estimate, **settings))

    rows = np.arange(N)
    status = {0: "matched", 2: "matched", 6: "no rotation", 10: "no position"}
    status |= dict.fromkeys([4, 8, 12, 14, 16], "matched")
    assert found.error == ""
    assert found.scores == {
        **dict.fromkeys(("TAS", "RAS", "PAS"), pytest.approx(8 / N)),
        **{"half_distance": np.inf, "half_angle": np.inf},
        **{"ate:rmse": pytest.approx(0, abs=1e-9), "kitti": np.inf},
    }
    assert (found.n, found.failures, found.n_parts, found.n_rows) == (N, N - 7, 1, N)
    assert (found.unit, found.scale) == (0.5, pytest.approx(0.5))
    assert found.lost == pytest.approx(1 - 7 / N)
    assert found.rows.tolist() == rows.tolist()
    assert [STATUSES[code] for code in found.statuses] == [
        status.get(row, "lost") for row in rows.tolist()
    ]
    placed = np.isin(rows, [0, 2, 4, 6, 8, 12, 14, 16])
    np.testing.assert_allclose(found.positions[placed], POSITIONS[placed], atol=1e-9)
    assert np.isnan(found.positions[~placed]).all()
    np.testing.assert_allclose(found.position_errors, np.where(placed, 0, np.inf), atol=1e-9)
    turned = np.isin(rows, [0, 2, 4, 8, 10, 12, 14, 16])
    np.testing.assert_allclose(found.rotation_errors, np.where(turned, 0, np.inf), atol=1e-9)
    assert any(note.startswith("no value of kitti: ") for note in found.notes)
    assert found.notes[-1] == "without a value, counted as failures: kitti"


def test_of_few_cameras_there_is_no_distance_and_no_failure(task):
    found = evaluate_run(task(POSES[:4], t_end=0.3))
    values = {name: found.scores[name] for name in ("RAS", "half_distance")}
    assert values == {"RAS": 1.0, "half_distance": pytest.approx(np.nan, nan_ok=True)}
    assert found.notes[-1] == "too few cameras for half_distance: left out of its means"


def test_parts_of_a_model_are_counted(examples, tmp_path):
    for part in "01":
        (tmp_path / part).symlink_to(examples / "colmap/estimate")
    files = str(examples / "colmap/reference"), str(tmp_path)
    found = evaluate_run(Task(*files, Settings(format="colmap")))
    assert (found.error, found.n, found.n_parts) == ("", 40, 2)
    assert np.isnan(found.scale)  # each part has its own


def test_conventions_and_clock_are_looked_at_where_they_are_to_be(task):
    inverse = POSES.copy()
    inverse[:, 4:7] *= -1
    turned = task(inverse)
    for check in (False, True):
        notes = evaluate_run(replace(turned, check=check)).notes
        hints = [note for note in notes if "the rotations seem to be world-to-camera" in note]
        assert len(hints) == check


def test_a_run_without_a_file_has_nothing(task):
    wrong = replace(task(POSES), estimate="none.txt")
    found = evaluate_run(wrong)
    assert found.error == "none.txt: cannot be read (No such file or directory)"
    assert (found.scores, found.n, found.failures, found.n_rows) == ({}, 0, 0, 0)
    assert (found.lost, found.n_parts, found.notes) == (1.0, 1, [])
    assert found.positions.shape == (0, 3)


def test_places_are_those_of_the_middle_of_each_row():
    outcome = Outcome({}, n_rows=4, rows=np.array([0, 2, 3]))
    assert outcome.places.tolist() == [0.125, 0.625, 0.875]
