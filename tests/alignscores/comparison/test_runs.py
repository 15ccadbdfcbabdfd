"""What becomes of a run, all that the comparison knows of it; and what its result depends on."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Settings
from alignscores.comparison import runs
from alignscores.comparison.runs import (
    ARRAYS,
    Outcome,
    Task,
    evaluate_run,
    forget_references,
    reference_of,
    step_of_run,
)
from alignscores.evaluation.evaluation import STATUSES
from alignscores.trajectories.files import FileError
from alignscores.trajectories.formats import FORMATS

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


@pytest.fixture
def cached(task, tmp_path):
    """A run without errors that is kept."""
    (tmp_path / "cache").mkdir()
    return replace(task(POSES[::2]), cache=tmp_path / "cache")


@pytest.fixture
def calls(monkeypatch):
    """Names of the functions that have scored something or looked for its step."""
    names = []

    def noting(name):
        function = getattr(runs, name)

        def noted(*arguments, **options):
            names.append(name)
            return function(*arguments, **options)

        monkeypatch.setattr(runs, name, noted)

    noting("score")
    noting("step_of_frames")
    return names


@pytest.mark.parametrize(
    ("step", "every", "half"), [(None, 2, pytest.approx(0, abs=1e-9)), (0.1, 1, np.inf)]
)
def test_all_that_is_known_of_a_run(task, step, every, half):
    """Every second pose, half as large, without an error: but some have no rotation or position."""
    estimate = POSES[:18:2].copy()
    estimate[:, 1:4] = estimate[:, 1:4] / 2 + 1
    estimate[3, 4:] = np.nan
    estimate[5, 1:4] = np.nan
    settings = {"unit": 0.5, "max_gap": 0.15, "metrics": ("ate:rmse", "kitti")}
    found = evaluate_run(replace(task(estimate, **settings), step=step))

    n = N // every
    rows = np.arange(0, N, every)
    status = {0: "matched", 2: "matched", 6: "no rotation", 10: "no position"}
    status |= dict.fromkeys([4, 8, 12, 14, 16], "matched")
    assert found.error == ""
    assert found.scores == {
        **dict.fromkeys(("TAS", "RAS", "PAS"), pytest.approx(8 / n)),
        **{"half_distance": half, "half_angle": half},
        **{"ate:rmse": pytest.approx(0, abs=1e-9), "kitti": np.inf},
    }
    assert (found.n, found.failures, found.n_parts, found.n_rows) == (n, n - 7, 1, N)
    assert (found.unit, found.scale) == (0.5, pytest.approx(0.5))
    assert found.lost == pytest.approx(1 - 7 / n)
    assert found.rows.tolist() == rows.tolist()
    assert [STATUSES[code] for code in found.statuses] == [
        status.get(row, "lost") for row in rows.tolist()
    ]
    placed = np.isin(rows, [0, 2, 4, 6, 8, 12, 14, 16])
    np.testing.assert_allclose(found.positions[placed], POSITIONS[rows[placed]], atol=1e-9)
    assert np.isnan(found.positions[~placed]).all()
    np.testing.assert_allclose(found.position_errors, np.where(placed, 0, np.inf), atol=1e-9)
    turned = np.isin(rows, [0, 2, 4, 8, 10, 12, 14, 16])
    np.testing.assert_allclose(found.rotation_errors, np.where(turned, 0, np.inf), atol=1e-9)
    why, counted = found.notes
    assert why.startswith("no value of kitti: ")
    assert counted == "without a value, counted as failures: kitti"


def test_of_few_cameras_there_is_no_distance_and_no_failure(task):
    found = evaluate_run(replace(task(POSES[:4], t_end=0.3), step=0.1))
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
    assert evaluate_run(turned).notes == []
    (note,) = evaluate_run(replace(turned, check=True)).notes
    assert note.startswith("the rotations seem to be world-to-camera")


def test_a_run_without_a_file_has_nothing(task):
    wrong = replace(task(POSES), estimate="none.txt")
    found = evaluate_run(wrong)
    assert found.error == "none.txt: cannot be read (No such file or directory)"
    assert (found.scores, found.n, found.failures, found.n_rows) == ({}, 0, 0, 0)
    assert (found.lost, found.n_parts, found.notes) == (1.0, 1, [])
    assert np.isnan([found.unit, found.scale]).all()
    shapes = {name: getattr(found, name).shape for name in ARRAYS}
    assert shapes == {**dict.fromkeys(ARRAYS, (0,)), "positions": (0, 3)}
    assert {found.rows.dtype, found.statuses.dtype} == {np.dtype(np.intp), np.dtype(np.uint8)}


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (FileError("est.txt", "is empty"), "est.txt: is empty"),
        (ValueError("of the estimate 1"), "est.txt: of the estimate 1"),
        (MemoryError(), "est.txt: there is not enough memory for it"),
    ],
)
def test_an_error_names_the_file_once(task, monkeypatch, error, message):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr(runs, "score", fail)
    found = evaluate_run(replace(task(POSES), estimate="est.txt"))
    assert (found.error, found.scores) == (message, {})


def test_places_are_those_of_the_middle_of_each_row():
    outcome = Outcome({}, n_rows=4, rows=np.array([0, 2, 3]))
    assert outcome.places.tolist() == [0.125, 0.625, 0.875]


def test_a_step_is_that_of_the_estimate_and_is_looked_for_once(cached, calls):
    assert step_of_run(cached) == pytest.approx(0.2)
    assert step_of_run(replace(cached, step=5.0, check=True)) == pytest.approx(0.2)
    assert calls == ["step_of_frames"]
    (file,) = cached.cache.iterdir()
    assert file.suffix == ".json"
    assert step_of_run(replace(cached, cache=None)) == pytest.approx(0.2)
    assert calls == ["step_of_frames"] * 2


def test_that_there_is_no_step_is_kept_too(task, calls, tmp_path):
    timed = task(POSES)
    listed = replace(timed, settings=replace(timed.settings, frames=timed.reference))
    listed = replace(listed, cache=tmp_path)
    assert [step_of_run(listed), step_of_run(listed)] == [None, None]
    assert calls == ["step_of_frames"]


@pytest.mark.parametrize(
    "change",
    [
        *({"step": 0.1}, {"check": True}),
        *({"settings": {"weight": 0.3}}, {"settings": {"seed": 1}}, {"settings": {"invert": True}}),
        *({"settings": {"frames": "gt.txt"}}, {"estimate": "gt.txt"}, {"reference": "est.txt"}),
    ],
)
def test_what_the_result_of_a_run_depends_on(cached, calls, tmp_path, monkeypatch, change):
    monkeypatch.chdir(tmp_path)
    first = evaluate_run(cached)
    settings = replace(cached.settings, **change.get("settings", {}))
    other = replace(cached, **{**change, "settings": settings})
    found = [evaluate_run(each) for each in (other, cached, other)]
    assert calls == ["score"] * 2
    assert [file.suffix for file in cached.cache.iterdir()] == [".npz"] * 2
    assert [outcome.scores for outcome in found] == [found[0].scores, first.scores, found[2].scores]


def test_a_result_that_is_kept_is_the_one_that_was_computed(cached, calls, tmp_path):
    """Of the same estimate under another name, but that its notes have that name."""
    long = POSES.copy()
    long[5, 4:] *= 1.25
    np.savetxt(tmp_path / "est.txt", long, fmt="%.17g")
    other = tmp_path / "other.txt"
    other.write_bytes((tmp_path / "est.txt").read_bytes())
    computed = evaluate_run(cached)
    kept = evaluate_run(replace(cached, estimate=str(other)))
    assert calls == ["score"]
    assert computed.notes[0].startswith(f"{cached.estimate}, line 6: ")
    assert kept.notes == [note.replace(cached.estimate, str(other)) for note in computed.notes]
    for name, value in vars(computed).items():
        if name != "notes":
            np.testing.assert_equal(getattr(kept, name), value)
            assert type(getattr(kept, name)) is type(value)


def test_a_result_without_any_success_is_kept_too(task, calls, tmp_path):
    poses = POSES.copy()
    poses[:, 1:] = poses[::-1, 1:] ** 2 + poses[:, 1:]
    hopeless = replace(task(poses, unit=1e-9), cache=tmp_path)
    first, second = evaluate_run(hopeless), evaluate_run(hopeless)
    assert first.scores["TAS"] == second.scores["TAS"] == 0
    assert calls == ["score"]


def test_the_last_two_references_are_kept_each_with_its_topic(tmp_path, monkeypatch):
    settings = []
    monkeypatch.setattr(runs, "read_reference", lambda path, of: settings.append(of))
    (tmp_path / "a.bag").write_text("")
    name = next(name for name, form in FORMATS.items() if form.topics)
    forget_references()
    for topic in "aabacab":
        reference_of(str(tmp_path / "a.bag"), name, topic)
    assert [(of.format, of.ref_topic) for of in settings] == [(name, topic) for topic in "abcb"]
    forget_references()


def hash_of(path, form="tum"):
    return runs._content_hash(str(path), FORMATS[form])


def test_of_a_file_the_content_and_the_ending_count(tmp_path):
    for name in ("a.txt", "b.txt", "c.csv"):
        (tmp_path / name).write_text("1")
    (tmp_path / "d.txt").write_text("2")
    a, b, c, d = (hash_of(file) for file in sorted(tmp_path.iterdir()))
    assert a == b
    assert len({a, c, d, hash_of(tmp_path / "none.txt")}) == 4


def test_of_a_folder_the_names_and_contents_of_its_files_count(tmp_path):
    first, second = tmp_path / "a.x", tmp_path / "b.y"
    for folder in (first, second):
        (folder / "0").mkdir(parents=True)
        (folder / "0/images.txt").write_text("1")
        (folder / "0/points3D.txt").write_text("1 2")
    found = hash_of(first, "colmap")
    assert hash_of(second, "colmap") == found
    (second / "0/points3D.txt").write_text("3 4")  # of the same size
    assert hash_of(second, "colmap") == found
    different = {found}
    for change in (
        lambda: (second / "0/points3D.txt").write_text("1 23"),
        lambda: (second / "0/images.txt").write_text("2"),
        lambda: (second / "0/images.txt").rename(second / "0/images.bin"),
        lambda: (second / "0").rename(second / "1"),
    ):
        change()
        different.add(hash_of(second, "colmap"))
    assert len(different) == 5


def test_a_bag_is_not_held_in_memory(tmp_path, monkeypatch):
    (tmp_path / "a.bag").write_text("1")
    in_memory = hash_of(tmp_path / "a.bag")

    def fail(path):
        raise FileError(path, "is too large")

    monkeypatch.setattr(runs, "read_bytes", fail)
    form = next(name for name, form in FORMATS.items() if form.topics)
    assert hash_of(tmp_path / "a.bag", form) == in_memory
    assert hash_of(tmp_path / "a.bag") != in_memory
