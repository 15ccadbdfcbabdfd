"""The table and the JSON."""

import gzip
import json
import re
import sys
from io import BytesIO, TextIOWrapper

import numpy as np
import pytest

import alignscores
from alignscores import tas
from alignscores.trajectories.association import match
from alignscores.trajectories.files import read_kitti, read_tum

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"
PAPER = "--registration", "pcr99"
# Each camera of the reference has the pose of its own stamp, or none.
AT_STAMPS = "--sync", "nearest", "--max_gap", 0


def test_the_table_and_what_is_said_below_it(run):
    code, out, err = run(*TUM, *PAPER, *AT_STAMPS, "--missing", "ignore")
    assert (code, err) == (0, "")
    header, row, settings, half, n, scale, hint = out.splitlines()
    expected = "estimate TAS sd half m RAS half deg PAS sd ATE m d m < d n lost"
    assert header.split() == expected.split()
    assert row.split()[0] == "estimate.txt"
    assert settings.startswith("registration pcr99, means and sd over the seeds 0 to 9; ")
    assert half.startswith("half: smallest threshold where TAS (refined registration) or RAS ")
    assert n.startswith("n: covered frames; lost: ")
    assert re.match(r"scale: estimate.txt 0\.\d+ times the reference's", scale)
    assert "--registration refined" in hint


def test_the_table_by_default(run):
    """By the registration that hardly depends on the seed, with all cameras of the reference."""
    code, out, err = run(*TUM)
    assert (code, err) == (0, "")
    header, row, settings, *_ = out.splitlines()
    expected = "estimate TAS half m RAS half deg PAS ATE m d m < d < 10 deg n"
    assert header.split() == expected.split()
    assert row.split()[-1] == "40"
    assert settings == "registration refined, seed 0; missing cameras: fail"


def test_what_is_not_finite_fails_where_it_is_not(run, score, lines, write):
    fields = [line.split() for line in lines]
    for row in (2, 3):
        fields[row][1:4] = ["nan"] * 3
    fields[4][4:] = ["nan"] * 4
    ignore = "--missing", "ignore", *AT_STAMPS
    (whole,) = score(*TUM, *ignore)
    files = *TUM[:2], write([" ".join(line) for line in fields])
    (result,) = score(*files, *ignore)
    assert (result["no_position"], result["no_rotation"]) == (
        2,
        1,
    )  # one pose that has neither is none
    assert (whole["no_position"], whole["no_rotation"]) == (0, 0)
    assert whole["RAS"] - 1 / 37 <= result["RAS"] < whole["RAS"]
    _, out, _ = run("colmap", "colmap/reference", "colmap/estimate")
    header, row, _, _, failures, *_ = out.splitlines()
    assert header.split()[-1] == "nan"
    assert row.split()[-1] == "3/3"
    assert failures.startswith("nan: cameras without a position fail in the TAS, ")


def test_the_refined_registration_is_not_repeated(run):
    _, out, _ = run(*TUM, "--registration", "refined")
    assert "registration refined, seed 0; " in out
    assert "steadier" not in out
    _, out, _ = run(*TUM, "--registration", "refined", "--json", "--repeat", 10)
    printed = json.loads(out)
    (result,) = printed["results"]
    assert printed["repeat"] == len(result["TAS_seeds"]) == 1
    assert result["TAS_sd"] is result["PAS_sd"] is None


def test_best_first_and_short_names(run, score, examples, kitti, tmp_path):
    gt = read_kitti(examples / "kitti/reference.txt").poses
    worse = gt.copy()
    worse[::2, :3, 3] = 0
    (tmp_path / "x").mkdir()
    files = [kitti(worse, "worse.txt"), "kitti/estimate.txt", kitti(gt, "x/estimate.txt")]
    results = score("kitti", "kitti/reference.txt", *files)
    assert results[0]["PAS"] == 1.0
    scores = [result["PAS"] for result in results]
    assert scores == sorted(scores, reverse=True)
    names = [result["name"] for result in results]
    assert names[0] == "x/estimate.txt"
    assert set(names[1:]) == {"kitti/estimate.txt", "worse.txt"}
    _, out, _ = run("kitti", "kitti/reference.txt", *files)
    assert [line.split()[0] for line in out.splitlines()[1:4]] == names


def test_json_names_its_settings(run):
    _, out, _ = run(*TUM, "--json", *PAPER, "--seed", 4, "--repeat", 2, "--missing", "fail")
    printed = json.loads(out, parse_constant=pytest.fail)  # neither NaN nor Infinity
    assert out == json.dumps(printed, indent=2) + "\n"
    given = {"format": "tum", "registration": "pcr99", "seed": 4, "repeat": 2}
    given |= {"missing_cameras": "fail", "version": alignscores.__version__, "ranked_by": "PAS"}
    assert given.items() <= printed.items()
    assert (len(printed["results"]), printed["notes"], printed["failed"]) == (1, [], [])
    _, out, _ = run("kitti", "kitti/reference.txt", "kitti/estimate.txt", "--json", "--unit", 2)
    printed = json.loads(out)
    assert (printed["unit"], printed["t_max_diff"], printed["t_offset"]) == (2.0, None, None)


def test_a_bad_estimate_does_not_stop_the_others(run, tmp_path, write):
    """It is named, so that it is not taken for one that was never asked for."""
    bad, none = write("1 2", "bad.txt"), tmp_path / "none.txt"
    code, out, err = run(*TUM[:2], bad, TUM[2], none, "--json")
    assert code == 1
    printed = json.loads(out)
    assert [result["name"] for result in printed["results"]] == ["estimate.txt"]
    assert [entry["file"] for entry in printed["failed"]] == [str(bad), str(none)]
    errors = [entry["error"] for entry in printed["failed"]]
    assert "line 1: has 2 columns" in errors[0]
    assert "No such file" in errors[1]
    assert err.splitlines() == [f"alignscores: error: {error}" for error in errors]
    code, out, _ = run(*TUM[:2], bad, "--json")
    assert code == 1
    printed = json.loads(out)
    assert printed["results"] == []
    assert len(printed["failed"]) == 1


def test_json_names_a_reference_that_cannot_be_read(run):
    for files in ("none.txt", TUM[2]), (TUM[1], TUM[2], "--frames", "none.txt"):
        code, out, err = run("tum", *files, "--json")
        printed = json.loads(out)
        (failed,) = printed["failed"]
        assert (code, printed["results"], failed["file"]) == (1, [], "none.txt")
        assert err == f"alignscores: error: {failed['error']}\n"


def test_json_has_no_numbers_that_json_has_not(score, tmp_path):
    times = np.arange(20.0)
    poses = np.column_stack([times, np.random.default_rng(0).normal(size=(20, 3))])
    poses = np.column_stack([poses, np.zeros((20, 3)), np.ones(20)])
    np.savetxt(tmp_path / "est.txt", poses)
    poses[:, 1:4] *= 1e200
    poses[3:, 1:4] += 1e199 * np.random.default_rng(1).normal(size=(17, 3))
    np.savetxt(tmp_path / "ref.txt", poses)
    (result,) = score("tum", tmp_path / "ref.txt", tmp_path / "est.txt")
    assert result["ATE"] is None
    assert 0 < result["TAS"] < 1


def test_what_comes_compressed_or_by_a_pipe_scores_alike(score, examples, tmp_path, monkeypatch):
    plain = (examples / TUM[2]).read_bytes()
    compressed = tmp_path / "estimate.txt.gz"
    compressed.write_bytes(gzip.compress(plain))
    monkeypatch.setattr("sys.stdin", TextIOWrapper(BytesIO(plain)))
    scored = [score(*TUM[:2], estimate)[0] for estimate in (TUM[2], compressed, "-")]
    for result in scored:
        result.pop("name"), result.pop("file")
    assert scored[0] == scored[1] == scored[2]


def shifted(lines, seconds):
    """Lines of a TUM file with another clock."""
    stamped = [line.split(maxsplit=1) for line in lines]
    return [f"{float(stamp) + seconds:.3f} {pose}" for stamp, pose in stamped]


def test_what_had_to_be_guessed_is_noted(run, lines, write):
    files = ("nerf/reference.json", "colmap/estimate", "--est_format", "colmap")
    code, _, notes = run("nerf", *files)
    assert code == 0
    assert "images are matched by the end of their path: 'images/0000.png' and '0000.png'" in notes
    code, _, notes = run(*TUM[:2], write(shifted(lines, 0.35)), "--t_offset", "auto")
    assert code == 0
    assert re.search(r"note: est.txt: time offset of -0\.35\d\d s added to its stamps", notes)


def test_the_alignment_takes_the_estimate_to_the_reference(score, examples):
    (result,) = score(*TUM, *PAPER, "--unit", 0.6, "--missing", "ignore", *AT_STAMPS)
    both = (read_tum(examples / path) for path in TUM[1:])
    matches = match(*both, sync="nearest", max_gap=0.0)
    expected = tas(matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3], unit=0.6)
    scale, rotation, translation = (np.array(part) for part in result["alignment"].values())
    aligned = scale * matches.est_poses[:, :3, 3] @ rotation.T + translation
    errors = np.linalg.norm(aligned - matches.gt_poses[:, :3, 3], axis=1)
    finite = np.isfinite(expected.errors)
    np.testing.assert_allclose(errors[finite], expected.errors[finite], atol=1e-9)
    assert list(result["alignment"]) == ["scale", "rotation", "translation"]


def test_a_narrow_terminal(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    lines = run(*TUM)[1].splitlines()
    assert max(map(len, lines[:2])) <= 40
    assert lines[-1].startswith("no room for: < 10 deg, < d, ATE m, d m, n")


def test_notes_that_are_alike_are_one(run, lines, write):
    """As of estimates of one system with its clock off."""
    files = [write(shifted(lines, 0.35), f"est{number}.txt") for number in range(3)]
    clock, unmatched = run(*TUM[:2], *files)[2].splitlines()
    assert "est0.txt: its clock seems to be off: with --t_offset -0.35" in clock
    assert "est0.txt: 4 of 38 poses have no reference pose near them in time" in unmatched
    assert all(note.endswith(" (and alike for 2 more)") for note in (clock, unmatched))


def test_progress_is_for_a_terminal_and_leaves_nothing_there(run, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    err = run(*TUM, "tum/none.txt")[2]
    assert "\r\x1b[K1/2 estimate.txt " in err
    assert "\r\x1b[K2/2 none.txt " in err
    last = run(TUM[0], TUM[1], "tum/none.txt", TUM[2])[2]
    assert last.endswith("\r\x1b[K2/2 estimate.txt \r\x1b[K")
    left = [line.rpartition("\r\x1b[K")[2] for line in err.split("\n")]
    assert left == [
        "alignscores: error: tum/none.txt: cannot be read (No such file or directory)",
        "",
    ]


@pytest.mark.parametrize(("columns", "told"), [("99", True), ("100", False)])
def test_columns_without_room_are_told_where_the_terminal_is_the_reason(
    run, tmp_path, examples, monkeypatch, columns, told
):
    path = tmp_path / f"{60 * 'x'}.txt"
    path.write_bytes((examples / TUM[2]).read_bytes())
    monkeypatch.setenv("COLUMNS", columns)
    _, out, _ = run(*TUM[:2], path)
    assert "< 10 deg" not in out.splitlines()[0]
    assert ("\nno room for: < 10 deg" in out) == told
