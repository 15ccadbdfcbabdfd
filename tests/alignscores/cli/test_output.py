"""The table and the JSON."""

import gzip
import json
import re
import sys
from argparse import Namespace
from io import BytesIO, TextIOWrapper
from types import SimpleNamespace

import numpy as np
import pytest

import alignscores
from alignscores import Settings, tas
from alignscores.cli.compare import _show
from alignscores.cli.output import footnotes, print_notes, show_json, table_width
from alignscores.trajectories.association import match
from alignscores.trajectories.files import read_kitti, read_tum

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"
PAPER = "--registration", "pcr99"
# Each camera of the reference has the pose of its own stamp, or none.
AT_STAMPS = "--sync", "nearest", "--max_gap", 0


def test_table(run):
    code, out, err = run(*TUM, *PAPER, *AT_STAMPS, "--missing", "ignore")
    assert (code, err) == (0, "")
    header, row, settings, half, n, scale, hint = out.splitlines()
    assert half.startswith("half: smallest threshold where TAS (refined registration) or RAS ")
    expected = "estimate TAS sd half m RAS half deg PAS sd ATE m d m < d n lost"
    assert header.split() == expected.split()
    assert row.split()[0] == "estimate.txt"
    assert row.split()[-2:] == ["37", "7.5%"]
    assert n.startswith("n: frames that were due, ")
    assert n.endswith(" lost: share of the time without a pose")
    assert settings == "registration pcr99, means and sd over the seeds 0 to 9; " + (
        "missing cameras: ignore"
    )
    assert scale == (
        "scale: estimate.txt 0.698 times the reference's, taken out; --alignment rigid counts it"
    )
    assert "--registration refined" in hint


def test_table_by_default(run):
    """By the registration that hardly depends on the seed, with all cameras of the reference."""
    code, out, err = run(*TUM)
    assert (code, err) == (0, "")
    header, row, settings, *_ = out.splitlines()
    expected = "estimate TAS half m RAS half deg PAS ATE m d m < d < 10 deg n"
    assert header.split() == expected.split()
    assert row.split()[-1] == "40"
    assert settings == "registration refined, seed 0; missing cameras: fail"
    assert "sd" not in header
    assert "steadier" not in out


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


def test_a_pose_of_nan_is_told_in_the_table(run):
    _, out, _ = run("tum", "tum/reference.txt", "tum/estimate.txt", "--frames", "tum/reference.txt")
    header, row, *_ = out.splitlines()
    assert header.split()[-2:] == ["lost", "nan"]
    assert row.split()[-2:] == ["7.5%", "3/3"]
    assert "\nnan: cameras without a position fail in the TAS" in out


def test_one_seed_has_no_spread(run):
    _, out, _ = run(*TUM, *PAPER, "--repeat", 1)
    assert "sd" not in out.splitlines()[0].split()
    assert "registration pcr99, seed 0; " in out
    assert "steadier" not in out


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
    assert len(printed.pop("results")) == 1
    assert printed == {
        "format": "tum",
        "est_format": "tum",
        "ref_topic": None,
        "est_topic": None,
        "reference": "tum/reference.txt",
        "missing_cameras": "fail",
        "registration": "pcr99",
        "alignment": "similarity",
        "up": None,
        "seed": 4,
        "repeat": 2,
        "inverted": False,
        "body_rotation": "none",
        "t_max_diff": 0.01,
        "t_offset": 0.0,
        "sync": "interpolate",
        "max_gap": None,
        "t_start": None,
        "t_end": None,
        "frames": None,
        "unit": None,
        "max_threshold": 1.0,
        "max_threshold_deg": 10.0,
        "weight": 0.5,
        "version": alignscores.__version__,
        "ranked_by": "PAS",
        "notes": [],
        "failed": [],
    }
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


def test_what_had_to_be_guessed_is_noted(run):
    files = ("nerf/reference.json", "colmap/estimate", "--est_format", "colmap")
    code, _, notes = run("nerf", *files)
    assert code == 0
    assert "images are matched by the end of their path: 'images/0000.png' and '0000.png'" in notes
    code, _, notes = run(*TUM, "--t_offset", "auto")
    assert code == 0
    assert re.search(r"note: estimate.txt: time offset of -?0\.00\d\d s found", notes)


def test_all_files_are_saved(run, tmp_path):
    names = ["errors.csv", "scores.png", "aligned.txt", "r.zip", "profiles.csv", "m.csv"]
    kinds = ["errors", "plot", "aligned", "results", "profile", "metrics"]
    options = [f"--{'' if kind == 'profile' else 'save_'}{kind}" for kind in kinds]
    saved = [part for pair in zip(options, names, strict=True) for part in pair]
    paths = [str(tmp_path / part) if part in names else part for part in saved]
    assert run(*TUM, *paths)[0] == 0
    assert {path.name for path in tmp_path.iterdir()} >= set(names)


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


def test_notes_that_are_alike_are_one(run, tmp_path, examples, lines, write):
    """As of twelve estimates of one system with its clock off."""
    names = [f"est{number}.txt" for number in range(12)]
    shifted = [f"{float(line.split()[0]) + 0.35:.3f} {line.split(maxsplit=1)[1]}" for line in lines]
    files = [write(shifted, name) for name in names]
    err = run(*TUM[:2], *files)[2]
    notes = err.splitlines()
    assert "est0.txt: its time stamps seem to be off" in notes[0]
    assert "est0.txt: 4 of 38 poses have no reference pose near them in time" in notes[1]
    assert all(note.endswith(" (and alike for 11 more)") for note in notes)
    assert len(notes) == 2


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


ROW = {"name": "a", "rank": [1, 1], "parts": [], "lost": 0.0, "scale": 1.0, "TAS_sd": None}
FAIL = "; missing cameras: fail"
REFINED, SEEDS = "registration refined, seed 0", "registration pcr99, means and sd over the seeds"
HALF = "half: smallest threshold where TAS (refined registration) or RAS reaches one half; -: never"
N = (
    "n: frames that were due, the same for all, and d is theirs; lost: share of the time without a "
    "pose"
)
STEADIER = "the TAS scatters with the seed; --registration refined makes it steadier"
LOST = "* without what the estimate lost; --missing fail counts it"
IGNORED = {"missing": "ignore"}


@pytest.mark.parametrize(
    ("settings", "rows", "header", "lines"),
    [
        ({}, [{}], "TAS", [REFINED + FAIL]),
        ({"seed": 3}, [{}], "TAS", ["registration refined, seed 3" + FAIL]),
        (
            {"registration": "pcr99", "repeat": 3, "seed": 2},
            [{}],
            "TAS",
            [f"{SEEDS} 2 to 4{FAIL}"],
        ),
        ({"format": "kitti"}, [{}], "TAS n", [REFINED]),
        ({"metrics": ("ATE",)}, [{}], "ATE", ["seed 0" + FAIL]),
        (
            {"metrics": ("ATE",), "alignment": "rigid"},
            [{}],
            "ATE",
            ["registration refined, aligned without scale, seed 0" + FAIL],
        ),
        ({"metrics": ("RAS", "TAS")}, [{}], "RAS TAS", [REFINED + FAIL]),
        ({"metrics": ("PAS",)}, [{}], "PAS", [REFINED + FAIL]),
        # ranks in common
        (
            {},
            [{}, {"rank": [2, 3]}, {"rank": [2, 3]}],
            "rank",
            [REFINED + FAIL, "ranks in common: tied, of equal PAS"],
        ),
        (
            {"registration": "pcr99", "repeat": 2},
            [{"rank": [1, 2]}],
            "rank",
            [
                f"{SEEDS} 0 to 1{FAIL}",
                "ranks in common: tied, PAS less than 2 standard errors apart over the seeds",
            ],
        ),
        ({}, [{"rank": None}], "rank", [REFINED + FAIL]),
        ({"metrics": ("PAS",)}, [{"rank": [1, 2]}], "PAS", [REFINED + FAIL]),
        # what columns mean
        ({}, [{}], "TAS half m", [REFINED + FAIL, HALF]),
        ({"metrics": ("half_distance",)}, [{}], "x", ["seed 0" + FAIL, HALF]),
        ({"metrics": ("half_angle",)}, [{}], "x", ["seed 0" + FAIL, HALF]),
        (
            {},
            [{}],
            "nan",
            [
                REFINED + FAIL,
                "nan: cameras without a position fail in the TAS, without a rotation in the RAS",
            ],
        ),
        (
            {},
            [{}, {"parts": [1, 2]}],
            "TAS",
            [
                REFINED + FAIL,
                "parts: worlds that are each aligned on their own, which makes scores higher",
            ],
        ),
        ({"metrics": ("TAS",)}, [{"parts": [1, 2]}], "TAS", [REFINED + FAIL]),
        ({}, [{}], "TAS n", [REFINED + FAIL, N]),
        # scales, and what was lost or scatters
        (
            {},
            [{}, {"name": "b", "scale": 2.0}],
            "TAS",
            [
                REFINED + FAIL,
                "scale: b 2 times the reference's, taken out; --alignment rigid counts it",
            ],
        ),
        ({"metrics": ("TAS",)}, [{"scale": 2.0}], "TAS", [REFINED + FAIL]),
        (IGNORED, [{}, {"lost": 0.1}], "TAS", [REFINED + "; missing cameras: ignore"]),
        (IGNORED, [{}, {"lost": 0.11}], "TAS", [REFINED + "; missing cameras: ignore", LOST]),
        ({}, [{"lost": 0.11}], "TAS", [REFINED + FAIL]),
        ({}, [{"TAS_sd": 0.005}, {}], "TAS", [REFINED + FAIL]),
        ({}, [{"TAS_sd": 0.0051}, {}], "TAS", [REFINED + FAIL, STEADIER]),
        ({"metrics": ("TAS",)}, [{"TAS_sd": 0.0051}], "TAS", [REFINED + FAIL, STEADIER]),
        ({"metrics": ("ATE",)}, [{"TAS_sd": 0.0051}], "ATE", ["seed 0" + FAIL]),
    ],
)
def test_what_is_said_below_the_table(settings, rows, header, lines):
    chosen = Settings(**{"format": "tum", **settings})
    assert footnotes([ROW | row for row in rows], chosen, f"estimate {header}") == lines


@pytest.mark.parametrize(
    ("columns", "width"), [("40", 40), ("99", 99), ("100", 100), ("101", 100), (None, 100)]
)
def test_the_table_is_as_wide_as_the_terminal_but_not_wider_than_a_page(
    monkeypatch, columns, width
):
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setattr(sys, "__stdout__", None)  # no terminal
    assert table_width() == width


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


def test_json_refuses_numbers_that_json_has_not(capsys):
    """Whatever comes of them: no program could read the rest, either."""
    settings = Settings(format="tum")
    with pytest.raises(ValueError, match="not JSON compliant"):
        show_json(settings, "gt.txt", [], [{"file": "a", "error": float("nan")}], [])
    comparison = SimpleNamespace(to_dict=lambda: {"systems": [float("inf")]})
    with pytest.raises(ValueError, match="not JSON compliant"):
        _show(comparison, Namespace(by="PAS", html=None, show="json"), None)
    assert capsys.readouterr().out == ""
    comparison = SimpleNamespace(to_dict=lambda: {"systems": [1.5]})
    _show(comparison, Namespace(by="PAS", html=None, show="json"), None)
    assert capsys.readouterr() == ('{\n  "systems": [\n    1.5\n  ]\n}\n', "")


@pytest.mark.parametrize("parts", [(0, 0), (0, 2)])
def test_json_has_ranks_where_scores_compare_and_all_notes(capsys, parts):
    """The notes stand on stderr, too."""
    scored = [
        SimpleNamespace(
            **{"name": name, "parts": [None] * n, "pas": pas, "pas_sd": None, "tas_seeds": [0.5]},
            notes=[f"{name} is slow"],
            to_dict=dict,
        )
        for name, n, pas in zip("ab", parts, (0.5, 0.25), strict=True)
    ]
    show_json(Settings(format="tum"), "gt\n.txt", scored, [{"file": "c"}], ["first"])
    out, err = capsys.readouterr()
    printed = json.loads(out)
    is_ranked = len(set(parts)) == 1
    assert printed["ranked_by"] == ("PAS" if is_ranked else None)
    assert printed["results"] == [
        {"rank": rank} for rank in ([[1, 1], [2, 2]] if is_ranked else [None, None])
    ]
    assert printed["reference"] == "gt\\n.txt"
    assert (printed["failed"], printed["notes"]) == ([{"file": "c"}], ["first"])
    notes = "first", "a is slow (and alike for 1 more)"
    assert err == "".join(f"alignscores: note: {note}\n" for note in notes)


def test_notes_that_differ_in_names_and_numbers_alone_are_one(capsys):
    """Those on all are told as they are."""
    notes = ["of 3", "of 4"]
    scored = [
        SimpleNamespace(name=name, notes=[f"{name}: {n} of 10.5 are off", f"{name} {more}"])
        for name, n, more in (("a.txt", 1, "slow"), ("b.txt", 22, "fast"), ("c.txt", 3, "slow"))
    ]
    print_notes(scored, notes)
    assert capsys.readouterr().err.splitlines() == [
        f"alignscores: note: {note}"
        for note in (
            "of 3",
            "of 4",
            "a.txt: 1 of 10.5 are off (and alike for 2 more)",
            "a.txt slow (and alike for 1 more)",
            "b.txt fast",
        )
    ]
