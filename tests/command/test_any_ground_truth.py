"""Each kind of ground truth and estimate that people have gets its numbers, through every door.

A case is the scene of the examples in another form. Positions without rotations have
the TAS, the distance and the ATE of the same file with rotations.
"""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import compare, evaluate
from alignscores.io import read_tum

NO_RAS = "the reference has no rotations: RAS and PAS have no value"
NO_EST_RAS = "it has no rotations: RAS and PAS have no value"


def text(*columns, by=" ", header="", end=""):
    """A table; numbers are written with all their digits."""
    rows = np.column_stack(columns)
    lines = [by.join(f"{x:.12g}" if abs(x) < 1e6 else f"{x:.6f}" for x in row) for row in rows]
    return "\n".join([*([header] if header else []), *(line + end for line in lines), ""])


@pytest.fixture(scope="module")
def scene(examples):
    """Stamps, positions, quaternions (w last) and poses of reference and estimate."""
    cases = {}
    for name in ("reference", "estimate"):
        stamps, poses = read_tum(examples / f"tum/{name}.txt")
        finite = np.isfinite(poses).all(axis=(1, 2))
        quaternions = Rotation.from_matrix(poses[finite, :3, :3]).as_quat()
        cases[name] = stamps[finite], poses[finite, :3, 3], quaternions, poses[finite]
    return cases


def zero(q):
    return np.zeros_like(q)


def same(q):
    return np.tile([0.0, 0, 0, 1], (len(q), 1))


def more(q, n):
    return np.full((len(q), n), 0.25)


def reference(content, *notes, rotations=True, **options):
    return "reference", content, options, notes, rotations


def estimate(content, *notes, rotations=True, **options):
    return "estimate", content, options, notes, rotations


COVARIANCES = {"header": "# timestamp(s) tx ty tz qx qy qz qw P"}
ZEROS, NANS = "0 0 0 0 0 0 0\n", "nan nan nan nan nan nan nan\n"
CASES = {  # the notes, and whether it has rotations
    "t x y z": reference(lambda t, p, q: text(t, p), NO_RAS, rotations=False),
    "t x y z, an estimate": estimate(lambda t, p, q: text(t, p), NO_EST_RAS, rotations=False),
    "quaternions of zeros": reference(
        lambda t, p, q: text(t, p, zero(q)), "all quaternions are zero", NO_RAS, rotations=False
    ),
    "one quaternion throughout": reference(
        lambda t, p, q: text(t, p, same(q)),
        "all rotations of the reference are the same",
        NO_RAS,
        rotations=False,
    ),
    "covariances": estimate(
        lambda t, p, q: text(t, p, q, more(q, 12), **COVARIANCES),
        "read t_s x y z qx qy qz qw (in the header: timestamp(s) tx ty tz qx qy qz qw), 12 of 20 "
        "columns ignored",
    ),
    "nanoseconds": estimate(
        lambda t, p, q: text(t * 1e9, p, q), "time stamps in ns, as their size shows"
    ),
    "a lost frame of zeros": estimate(
        lambda t, p, q: text(t, p, q) + f"{t[-1] + 0.05:.6f} {ZEROS}",
        "1 pose has a quaternion of zeros: not estimated",
    ),
    "NaN in the reference": reference(lambda t, p, q: text(t, p, q) + f"{t[-1] + 9} {NANS}"),
}


@pytest.mark.parametrize("case", CASES)
def test_it_has_a_number_through_every_door(scene, examples, tmp_path, monkeypatch, run, case):
    whose, content, options, problem, has_rotations = CASES[case]
    files = {name: examples / f"tum/{name}.txt" for name in ("reference", "estimate")}
    expected = evaluate(*files.values()).to_dict()
    (tmp_path / "orb").mkdir()
    files["estimate"] = tmp_path / "orb/0.txt"
    files["estimate"].write_text((examples / "tum/estimate.txt").read_text())
    files[whose] = files[whose] if whose == "estimate" else tmp_path / "reference.txt"
    files[whose].write_text(content(*scene[whose][:3]))

    evaluation = evaluate(*files.values(), **options)
    values = evaluation.to_dict()
    for name in ("TAS", "half_distance", "ate", "median_distance", "unit", "n"):
        assert values[name] == pytest.approx(expected[name], rel=1e-4), name
    for name in ("RAS", "PAS", "half_angle", "median_angle"):
        if has_rotations:
            assert values[name] == pytest.approx(expected[name], abs=1e-4)
        else:
            assert values[name] is None
    notes = [str(note) for note in evaluation.notes]
    usual = "clock is off", "never moves"
    notes = [note for note in notes if not any(words in note for words in usual)]
    assert len(notes) == len(problem)
    assert all(any(words in note for note in notes) for words in problem)

    words = [f"--{name}={value}" for name, value in options.items()]
    _, out, err = run(*files.values(), "--json", *words)
    printed = json.loads(out)["results"][0]
    assert [printed[name] for name in ("TAS", "RAS", "PAS")] == [
        values[name] for name in ("TAS", "RAS", "PAS")
    ]
    assert all(words in err for words in problem)
    _, out, _ = run(*files.values(), *words)
    assert ("  -  " in out.splitlines()[1]) != has_rotations

    compared = compare(str(files["reference"]), str(tmp_path / "{system}/{run}.txt"), **options)
    (result,) = compared.to_dict()["runs"]
    assert result["TAS"] == values["TAS"]
    assert result["RAS"] == values["RAS"]


def by_other_doors(run, reference, estimate):
    """The PAS of the command and of `compare`."""
    printed = json.loads(run(reference, estimate, "--json")[1])["results"]
    compared = compare(str(reference), [estimate]).to_dict()["runs"]
    return [result["PAS"] for result in (*printed, *compared)]


def test_poses_without_stamps_are_matched_by_row(scene, write, run, examples):
    """TartanAir's seven columns, against KITTI's matrices and against themselves."""
    _, positions, quaternions, _ = scene["reference"]
    files = [write(text(positions, quaternions), name) for name in ("gt.txt", "est.txt")]
    assert evaluate(*files).pas == 1
    assert by_other_doors(run, *files) == [1, 1]
    assert evaluate(files[0], examples / "kitti/estimate.txt").pas == pytest.approx(0.80, abs=0.01)


def test_folders_of_matrices_are_matched_by_their_numbers(scene, tmp_path, run, examples):
    """As of ScanNet, with -inf where there is no pose; against each other and against rows."""
    poses = scene["reference"][3]
    for number, pose in enumerate(poses):
        for name in ("pose", "mine"):
            (tmp_path / name).mkdir(exist_ok=True)
            pose = np.full((4, 4), -np.inf) if (number, name) == (7, "pose") else pose
            np.savetxt(tmp_path / name / f"{number}.txt", pose)
    evaluation = evaluate(tmp_path / "pose", tmp_path / "mine")
    assert (evaluation.pas, len(evaluation.matches.keys)) == (1, 39)
    assert by_other_doors(run, tmp_path / "pose", tmp_path / "mine") == [1, 1]
    assert "the reference has no pose for 2.5% of the cameras" in str(evaluation.notes[0])
    evaluation = evaluate(tmp_path / "pose", examples / "kitti/estimate.txt")
    assert evaluation.pas == pytest.approx(0.80, abs=0.01)


def test_metrics_of_rotations_have_no_value_without(scene, write, run, examples):
    reference = write(text(*scene["reference"][:2]), "gt.txt")
    metrics = "auc@30:vggt,half_angle,ate,TAS"
    evaluation = evaluate(reference, examples / "tum/estimate.txt", metrics=metrics)
    values = evaluation.to_dict()["metrics"]
    assert [name for name, value in values.items() if value is None] == [
        "auc@30:vggt",
        "half_angle",
    ]
    with pytest.raises(ValueError, match="--invert needs rotations"):
        evaluate(examples / "tum/reference.txt", reference, invert=True)


def test_all_outputs_of_positions_alone_are_written(scene, write, run, examples, tmp_path):
    reference = write(text(*scene["reference"][:2]), "gt.txt")
    code, _, err = run(reference, "tum/estimate.txt", "-o", tmp_path / "out")
    assert (code, "error" in err) == (0, False)
    assert len(list((tmp_path / "out").iterdir())) >= 5
