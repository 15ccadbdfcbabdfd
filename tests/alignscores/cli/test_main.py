"""The command line from end to end, on the example trajectories."""

import json
import os
import re
import shutil
import subprocess
import sys
import warnings

import matplotlib
import numpy as np
import pytest
from evo.core.geometry import umeyama_alignment
from evo.tools import file_interface
from matplotlib import pyplot

import alignscores
from alignscores import pas, tas
from alignscores.cli import main, scoring
from alignscores.cli.output import unique_names
from alignscores.registration import REGISTRATIONS
from alignscores.trajectories.association import match
from alignscores.trajectories.conventions import Convention
from alignscores.trajectories.files import inverse_poses, read_kitti, read_tum

FILES = {
    "tum": ("tum/reference.txt", "tum/estimate.txt"),
    "kitti": ("kitti/reference.txt", "kitti/estimate.txt"),
    "euroc": ("euroc/data.csv", "euroc/estimate.txt"),
    "colmap": ("colmap/reference", "colmap/estimate"),
    "nerf": ("nerf/reference.json", "nerf/estimate.json"),
}
KEYS = {
    *("name", "file", "TAS", "TAS_sd", "RAS", "PAS", "ATE", "n", "matched", "missing"),
    *("non_finite", "duplicate", "unmatched", "unit", "within_unit", "within_10_deg"),
    *("n_hypotheses", "body_rotation", "notes"),
}


@pytest.fixture
def run(examples, capsys, monkeypatch):
    """(arguments) -> exit code, stdout, stderr; in the folder of the examples."""
    monkeypatch.chdir(examples)

    def run(*arguments):
        try:
            code = main(list(map(str, arguments)))
        except SystemExit as stop:
            code = stop.code
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


@pytest.fixture
def score(run):
    """(arguments) -> the results of the JSON output."""

    def score(*arguments):
        code, out, _ = run(*arguments, "--json")
        assert code == 0
        return json.loads(out)["results"]

    return score


@pytest.fixture
def kitti(tmp_path):
    """(poses, name) -> path of a KITTI file with them."""

    def write(poses, name="estimate.txt"):
        path = tmp_path / name
        np.savetxt(path, poses[:, :3].reshape(-1, 12))
        return path

    return write


@pytest.fixture
def tum(tmp_path):
    """(n, rate, name, lost=) -> a TUM file of a helix; the reference is that of a rate of 10."""

    def write(n, rate, name, lost=(0, 0)):
        times = np.arange(n) / rate
        path = np.column_stack([np.cos(times), np.sin(times), times])
        noise = np.random.default_rng(n).normal(0, 0.01, (n, 3)) if "est" in name else 0.0
        poses = np.column_stack([times, path + noise, np.zeros((n, 3)), np.ones(n)])
        np.savetxt(tmp_path / name, np.delete(poses, slice(*lost), axis=0))
        return tmp_path / name

    return write


def process(*arguments, cwd, code="from alignscores.cli import main; sys.exit(main())", **env):
    command = [sys.executable, "-c", f"import sys; {code}", *map(str, arguments)]
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, env={**os.environ, **env}, timeout=100
    )


# Formats


@pytest.mark.parametrize("form", FILES)
def test_every_format_scores_the_same_scene_the_same(form, score, examples):
    (result,) = score(form, *FILES[form], "--missing", "fail")
    matches = match(
        read_kitti(examples / "kitti/reference.txt"), read_kitti(examples / "kitti/estimate.txt")
    )
    expected = pas(matches.gt_poses, matches.est_poses)
    assert set(result) == KEYS
    assert result["n"] == 40
    assert result["TAS"] == pytest.approx(expected.tas.score, abs=1e-12)
    assert result["RAS"] == pytest.approx(expected.ras.score, abs=1e-12)
    assert result["PAS"] == pytest.approx(expected.score, abs=1e-12)
    assert result["unit"] == pytest.approx(expected.tas.unit)
    assert result["within_unit"] == np.mean(expected.tas.errors < expected.tas.unit)
    assert result["within_10_deg"] == np.mean(expected.ras.errors < 10)
    # 37 of 40 were estimated; the format tells how the others show.
    assert result["matched"] - result["non_finite"] == 37
    assert result["matched"] + result["missing"] == 40


@pytest.mark.parametrize(
    ("form", "n"), [("tum", 38), ("euroc", 38), ("kitti", 40), ("colmap", 40), ("nerf", 40)]
)
def test_missing_cameras_by_default(form, n, score):
    """Identity by name: they fail. By time: a reference has poses that nobody could estimate."""
    (result,) = score(form, *FILES[form])
    assert result["n"] == n
    (ignoring,) = score(form, *FILES[form], "--missing", "ignore")
    assert ignoring["n"] == ignoring["matched"]
    assert ignoring["missing"] == result["missing"]


def test_ate_is_that_of_evo(score, examples):
    (result,) = score("nerf", *FILES["nerf"], "--missing", "ignore")
    gt, est = (read_kitti(examples / f"kitti/{x}.txt").poses for x in ("reference", "estimate"))
    finite = np.isfinite(est[:, 0, 0])
    gt, est = gt[finite, :3, 3].T, est[finite, :3, 3].T
    rotation, translation, scale = umeyama_alignment(est, gt, with_scale=True)
    residuals = scale * rotation @ est + translation[:, None] - gt
    assert result["ATE"] == pytest.approx(np.sqrt(np.mean(np.sum(residuals**2, axis=0))))


# Output


def test_table(run):
    code, out, err = run("tum", *FILES["tum"])
    assert code == 0
    assert err == ""
    header, row, settings, hint = out.splitlines()
    assert header.split("  ")[0] == "estimate"
    cells = row.split()
    assert cells[0] == "estimate.txt"
    assert cells[-5:] == ["38", "38", "2", "1", "0"]
    assert header.split()[-5:] == ["n", "matched", "missing", "non-finite", "duplicate"]
    assert "ATE [m]" in header
    assert "d [m]" in header
    assert "registration pcr99, seed 0" in settings
    assert "missing cameras: ignore" in settings
    assert "--registration refined" in hint


def test_best_first_and_short_names(run, score, examples, kitti, tmp_path):
    gt = read_kitti(examples / "kitti/reference.txt").poses
    worse = gt.copy()
    worse[::2, :3, 3] = 0
    files = [kitti(worse, "worse.txt"), "kitti/estimate.txt", kitti(gt, "estimate.txt")]
    results = score("kitti", "kitti/reference.txt", *files)
    assert results[0]["PAS"] == 1.0
    scores = [result["PAS"] for result in results]
    assert scores == sorted(scores, reverse=True)
    names = [result["name"] for result in results]
    assert names[0] == f"{tmp_path.name}/estimate.txt"
    assert set(names[1:]) == {"kitti/estimate.txt", "worse.txt"}
    _, out, _ = run("kitti", "kitti/reference.txt", *files)
    assert [line.split()[0] for line in out.splitlines()[1:4]] == names


def test_names():
    assert unique_names(["x/a.txt", "x/b.txt"]) == ["a.txt", "b.txt"]
    assert unique_names(["x/a", "y/a", "z/x/a"]) == ["x/a", "y/a", "z/x/a"]
    assert unique_names(["a", "a", "x/a"]) == ["a", "a (2)", "x/a"]
    assert unique_names(["/a", "a"]) == ["/a", "a"]


def test_json_names_its_settings(run):
    arguments = ("--seed", 4, "--repeat", 2, "--missing", "fail")
    _, out, _ = run("tum", *FILES["tum"], "--json", *arguments)
    printed = json.loads(out, parse_constant=pytest.fail)  # neither NaN nor Infinity
    settings = {
        "format": "tum",
        "reference": "tum/reference.txt",
        "missing_cameras": "fail",
        "registration": "pcr99",
        "seed": 4,
        "repeat": 2,
        "inverted": False,
        "body_rotation": "none",
        "t_max_diff": 0.01,
        "t_offset": 0.0,
        "unit": None,
        "version": alignscores.__version__,
        "notes": [],
        "failed": [],
    }
    results = printed.pop("results")
    assert printed == settings
    assert len(results) == 1
    _, out, _ = run("kitti", *FILES["kitti"], "--json", "--unit", 2)
    printed = json.loads(out)
    assert (printed["unit"], printed["t_max_diff"], printed["t_offset"]) == (2.0, None, None)


def test_json_names_what_could_not_be_scored(run, tmp_path):
    """So that a failed estimate is not taken for one that was never asked for."""
    bad = failing(tmp_path, "1 2")
    none = tmp_path / "none.txt"
    code, out, err = run("tum", FILES["tum"][0], bad, FILES["tum"][1], none, "--json")
    assert code == 1
    printed = json.loads(out)
    assert [result["name"] for result in printed["results"]] == ["estimate.txt"]
    assert [one["file"] for one in printed["failed"]] == [str(bad), str(none)]
    errors = [one["error"] for one in printed["failed"]]
    assert "line 1: has 2 columns" in errors[0]
    assert "No such file" in errors[1]
    assert err.splitlines() == [f"alignscores: error: {error}" for error in errors]
    code, out, _ = run("tum", FILES["tum"][0], bad, "--json")
    assert code == 1
    printed = json.loads(out)
    assert printed["results"] == []
    assert len(printed["failed"]) == 1


def test_what_is_wrong_with_the_reference_is_told_once(run, tmp_path, examples):
    lines = (examples / "tum/reference.txt").read_text().splitlines()
    (tmp_path / "gt.txt").write_text("\n".join([*lines, lines[5]]))
    files = ["tum/estimate.txt", "tum/estimate.txt"]
    _, out, err = run("tum", tmp_path / "gt.txt", *files, "--json")
    printed = json.loads(out)
    assert len(printed["notes"]) == 2
    assert "time stamps of the reference are not in order" in printed["notes"][0]
    assert printed["notes"][1] == "duplicates in the reference (of stamp or name), left out: 1"
    assert [result["notes"] for result in printed["results"]] == [[], []]
    assert err.splitlines() == [f"alignscores: note: {note}" for note in printed["notes"]]
    _, out, _ = run("tum", "tum/reference.txt", *files, "--json")
    assert json.loads(out)["results"] == printed["results"]


def test_json_of_what_cannot_be_aligned(score, examples, kitti):
    poses = read_kitti(examples / "kitti/reference.txt").poses
    poses[:, :3, 3] = 1
    (result,) = score("kitti", "kitti/reference.txt", kitti(poses))
    assert result["TAS"] == 0
    assert result["ATE"] is None
    assert len(result["notes"]) == 1  # once, not for every seed
    assert "TAS is 0" in result["notes"][0]


def test_save_results(run, score, tmp_path, examples):
    path = tmp_path / "one.zip"
    assert run("tum", *FILES["tum"], "--save_results", path)[0] == 0
    result = file_interface.load_res_file(path)
    (expected,) = score("tum", *FILES["tum"])
    for key in ("TAS", "RAS", "PAS", "ATE", "TAS_sd"):
        assert result.stats[key] == expected[key]
    assert result.stats["mean"] == pytest.approx(1 - expected["PAS"])
    assert result.info["est_name"] == "estimate.txt"
    assert result.info["registration"] == "pcr99"
    arrays = result.np_arrays
    assert {len(array) for array in arrays.values()} == {38}
    assert np.isinf(arrays["position_error_array"]).sum() == 1
    assert list(tmp_path.iterdir()) == [path]


def test_saved_names_do_not_depend_on_what_failed(run, tmp_path):
    path = tmp_path / "r.zip"
    code, _, _ = run("tum", *FILES["tum"], tmp_path / "none.txt", "--save_results", path)
    assert code == 1
    assert [path.name for path in tmp_path.iterdir()] == ["r_estimate.txt.zip"]


def test_saved_names_differ(run, tmp_path, examples):
    """Though a folder's slash becomes an underscore."""
    shutil.copytree(examples / "tum", tmp_path / "x")
    shutil.copytree(examples / "tum", tmp_path / "y")
    lines = (examples / "tum/estimate.txt").read_text().splitlines()
    (tmp_path / "x_estimate.txt").write_text("\n".join(lines[:30]))
    files = [tmp_path / f for f in ("x/estimate.txt", "y/estimate.txt", "x_estimate.txt")]
    assert run("tum", FILES["tum"][0], *files, "--save_results", tmp_path / "r.zip")[0] == 0
    assert {path.name for path in tmp_path.glob("*.zip")} == {
        "r_x_estimate.txt.zip",
        "r_y_estimate.txt.zip",
        "r_x_estimate.txt (2).zip",
    }
    second = tmp_path / "r_x_estimate.txt (2).zip"
    before = file_interface.load_res_file(second).stats
    files[0].unlink()  # names do not depend on what failed
    second.unlink()
    assert run("tum", FILES["tum"][0], *files, "--save_results", tmp_path / "r.zip")[0] == 1
    assert file_interface.load_res_file(second).stats == before


def test_evo_res_reads_the_results(run, tmp_path, examples):
    shutil.copytree(examples / "tum", tmp_path / "other")
    files = (FILES["tum"][1], tmp_path / "other/estimate.txt")
    assert run("tum", FILES["tum"][0], *files, "--save_results", tmp_path / "r.zip")[0] == 0
    archives = sorted(path.name for path in tmp_path.glob("*.zip"))
    assert archives == ["r_other_estimate.txt.zip", "r_tum_estimate.txt.zip"]
    code = "from evo.cli.entry_points import res; res()"  # what the command evo_res runs
    done = subprocess.run(
        [sys.executable, "-c", code, *archives, "--save_table", "table.csv", "--no_warnings"],
        cwd=tmp_path,
        env={**os.environ, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0, done.stderr
    assert "PAS: share of the thresholds missed (pcr99, seed 0)" in done.stdout
    for key in ("TAS", "RAS", "PAS", "ATE"):
        assert key in done.stdout
    assert "other_estimate.txt" in (tmp_path / "table.csv").read_text()


@pytest.mark.parametrize(
    ("suffix", "magic"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?x")]
)
def test_save_plot(run, tmp_path, suffix, magic):
    path = tmp_path / f"plot.{suffix}"
    assert run("colmap", *FILES["colmap"], "--save_plot", path)[0] == 0
    assert path.read_bytes().startswith(magic)
    assert list(tmp_path.iterdir()) == [path]


def test_plot(run, monkeypatch):
    code, out, err = run("tum", *FILES["tum"], "--plot")
    assert code == 1
    assert out == ""
    assert err.count("\n") == 1
    assert "no display" in err
    shown = []
    monkeypatch.setattr(pyplot, "get_backend", lambda: "tkagg")
    monkeypatch.setattr(pyplot, "show", lambda: shown.extend(pyplot.get_fignums()))
    assert matplotlib.get_backend().lower() == "agg"
    assert run("tum", *FILES["tum"], "--plot")[0] == 0
    assert len(shown) == 1
    titles = [axes.get_title(loc="left") for axes in pyplot.figure(shown[0]).axes]
    pyplot.close("all")
    assert titles[0] == "estimate.txt\nposition errors"


# Scoring


def test_repeat_and_seed(score, examples):
    matches = match(
        read_tum(examples / "tum/reference.txt"), read_tum(examples / "tum/estimate.txt")
    )
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    scores = [tas(gt, est, rng=seed).score for seed in range(20)]
    (default,) = score("tum", *FILES["tum"])
    assert default["TAS"] == scores[0]
    assert default["TAS_sd"] == pytest.approx(np.std(scores[:10], ddof=1))
    (other,) = score("tum", *FILES["tum"], "--seed", 7, "--repeat", 3)
    assert other["TAS"] == scores[7]
    assert other["TAS_sd"] == pytest.approx(np.std(scores[7:10], ddof=1))
    assert score("tum", *FILES["tum"], "--repeat", 1)[0]["TAS_sd"] is None


def test_one_seed_has_no_spread(run):
    _, out, _ = run("tum", *FILES["tum"], "--repeat", 1)
    assert out.splitlines()[1].split()[2] == "-"
    assert "sd over" not in out


def test_unit(score):
    (result,) = score("tum", *FILES["tum"], "--unit", 2.5)
    assert result["unit"] == 2.5
    assert result["TAS"] > score("tum", *FILES["tum"])[0]["TAS"]


def test_t_max_diff_and_t_offset(run, score):
    """The stamps of the estimate are 2 ms late."""
    assert score("tum", *FILES["tum"], "--t_max_diff", 0.0021)[0]["matched"] == 38
    code, _, err = run("tum", *FILES["tum"], "--t_max_diff", 0.0019)
    assert code == 1
    assert "tum/estimate.txt: no time stamps in common" in err
    options = ("--t_max_diff", 0.0001, "--t_offset", -0.002)
    assert score("tum", *FILES["tum"], *options)[0]["matched"] == 38
    assert run("tum", *FILES["tum"], "--t_offset", 1000)[0] == 1


def test_poses_without_a_reference_are_told(run, tmp_path, examples):
    lines = (examples / "tum/estimate.txt").read_text().splitlines()
    late = [line.replace("17000000", "17000009", 1) for line in lines[1:11]]
    (tmp_path / "est.txt").write_text("\n".join(lines + late))
    code, _, err = run("tum", FILES["tum"][0], tmp_path / "est.txt")
    assert code == 0
    assert "est.txt: 10 of 48 poses have no reference pose within --t_max_diff\n" in err
    assert "of the reference, the rest" not in err
    code, _, err = run("nerf", *FILES["nerf"][::-1])
    assert code == 0
    assert "3 of 40 images are not in the reference; left out (it has all of" in err


@pytest.mark.parametrize(
    ("kept", "share"), [(range(19), 52), ([*range(10), *range(30, 38)], 48), (range(20, 38), 45)]
)
def test_a_lost_track_is_told(run, tmp_path, examples, kept, share):
    """Else lost frames would silently improve the score, be they in the middle or at an end."""
    lines = (examples / "tum/estimate.txt").read_text().splitlines()[1:]
    est = tmp_path / "est.txt"
    est.write_text("\n".join(lines[row] for row in kept))
    _, _, err = run("tum", FILES["tum"][0], est)
    note = f"est.txt: the track covers only {share}% of the reference, the rest is not scored"
    assert err == f"alignscores: note: {note}; --missing fail counts it as failures\n"
    assert run("tum", FILES["tum"][0], est, "--missing", "fail")[2] == ""


def test_missing_cameras_are_no_failures_where_the_reference_is_denser(run, tum):
    """A motion capture system has poses that no camera could have."""
    reference, estimate = tum(400, 100, "gt.txt"), tum(40, 10, "est.txt", lost=(10, 30))
    _, _, err = run("tum", reference, estimate)
    assert "the track covers only 48%" in err
    assert "--missing fail counts it as failures once the reference is thinned out" in err
    _, _, err = run("tum", reference, estimate, "--missing", "fail")
    note = "380 of 400 reference poses count as failures, but the reference is denser than the"
    assert (
        err == f"alignscores: note: est.txt: {note} estimate: thin it out (evo_traj --downsample)\n"
    )
    reference, estimate = tum(400, 10, "gt.txt"), tum(40, 10, "est.txt", lost=(10, 30))
    assert run("tum", reference, estimate, "--missing", "fail")[2] == ""


def test_euroc_estimates_in_nanoseconds(score, examples, tmp_path):
    """As ORB-SLAM3 writes them; in the format tum they are refused with a hint."""
    reference, estimate = FILES["euroc"]
    lines = [line.split() for line in (examples / estimate).read_text().splitlines()[1:]]
    path = tmp_path / "f_orb.txt"
    path.write_text("\n".join(f"{float(t) * 1e9:.6f} {' '.join(pose)}" for t, *pose in lines))
    (seconds,), (nanoseconds,) = score("euroc", *FILES["euroc"]), score("euroc", reference, path)
    assert nanoseconds["TAS"] == pytest.approx(seconds["TAS"], abs=1e-9)
    assert nanoseconds["matched"] == seconds["matched"]


# Which scores compare


def test_estimates_of_different_d_are_not_ranked(run, tum):
    """Keyframes are farther apart, so that a larger error counts as none."""
    reference, all_frames = tum(400, 10, "gt.txt"), tum(400, 10, "est.txt")
    keyframes = tum(40, 1, "est_keyframes.txt")
    both = all_frames, keyframes
    code, out, err = run("tum", reference, *both, "--json", "--repeat", 1)
    assert code == 0
    printed = json.loads(out)
    scores = [result["PAS"] for result in printed["results"]]
    assert scores[0] < scores[1]
    assert [result["name"] for result in printed["results"]] == ["est.txt", "est_keyframes.txt"]
    units = [result["unit"] for result in printed["results"]]
    (note,) = printed["notes"]
    assert err == f"alignscores: note: {note}\n"
    assert f"do not compare and stand in the order given: d is from {units[0]:.4g} to" in note
    assert f"{units[1]:.4g} m" in note
    assert "--missing fail" not in note  # all frames of the reference are not the keyframes'
    # What the note says makes them compare.
    option = re.search(r"--unit \S+", note)[0].split()
    _, out, err = run("tum", reference, *both[::-1], "--json", "--repeat", 1, *option)
    assert err == ""
    results = json.loads(out)["results"]
    assert {result["unit"] for result in results} == {float(option[1])}
    assert results[0]["PAS"] >= results[1]["PAS"]


def test_missing_fail_makes_estimates_compare(run, score, examples, tmp_path):
    """Where the reference holds the cameras that were to be estimated: here images."""
    content = json.loads((examples / "nerf/estimate.json").read_text())
    content["frames"] = content["frames"][::4]
    (tmp_path / "few.json").write_text(json.dumps(content))
    files = ["nerf", "nerf/reference.json", "nerf/estimate.json", tmp_path / "few.json"]
    _, _, err = run(*files, "--missing", "ignore")
    assert "do not compare" in err
    assert "--missing fail also the same cameras" in err
    _, _, err = run(*files, "--missing", "fail")
    assert err == ""
    assert [result["name"] for result in score(*files)] == ["estimate.json", "few.json"]


def test_real_keyframes_are_not_ranked_above_all_frames(run, real):
    files = [real / f"fr2_desk_{name}.txt" for name in ("groundtruth", "ORB", "ORB_kf_mono")]
    _, out, err = run("tum", *files, "--repeat", 1)
    assert [line.split()[0] for line in out.splitlines()[1:3]] == [file.name for file in files[1:]]
    assert "d is from 0.008191 to 0.06742 m" in err
    assert "--unit 0.008191 gives all one d\n" in err
    assert err.count("duplicates in the reference") == 1
    assert "ORB.txt: the track covers" not in err  # the reference's own gaps are no loss


def test_the_registration_is_named_and_a_steadier_one_pointed_to(run, score):
    _, out, _ = run("tum", *FILES["tum"], "--registration", "pcr99")
    assert "--registration refined makes it steadier" in out
    _, out, _ = run("tum", *FILES["tum"], "--registration", "refined")
    assert "registration refined, seed 0" in out
    spread = {
        name: score("tum", *FILES["tum"], "--registration", name)[0]["TAS_sd"]
        for name in REGISTRATIONS
    }
    assert spread["refined"] < spread["pcr99"] / 10
    assert "steadier" not in out
    _, out, _ = run("tum", *FILES["tum"], "--repeat", 1)
    assert "steadier" not in out


# Conventions


def test_invert(score, run, kitti, examples):
    (honest,) = score("kitti", *FILES["kitti"])
    path = kitti(inverse_poses(read_kitti(examples / "kitti/estimate.txt").poses))
    code, _, err = run("kitti", "kitti/reference.txt", path)
    assert code == 0
    assert err.count("\n") == 1
    assert "the poses in the file seem to be world-to-camera" in err
    assert err.endswith("add --invert\n")
    (inverted,) = score("kitti", "kitti/reference.txt", path, "--invert")
    assert inverted["PAS"] == pytest.approx(honest["PAS"], abs=1e-9)
    assert inverted["notes"] == []
    (result,) = score("kitti", "kitti/reference.txt", path)  # never silently
    assert result["RAS"] < honest["RAS"] / 3
    _, _, err = run("kitti", *FILES["kitti"], "--invert")
    assert err.endswith("leave out --invert\n")


@pytest.mark.parametrize("inverted", [False, True])
def test_body_rotation(score, run, kitti, examples, inverted):
    (honest,) = score("kitti", *FILES["kitti"])
    poses = read_kitti(examples / "kitti/estimate.txt").poses @ np.diag([1.0, -1.0, -1.0, 1.0])
    path = kitti(inverse_poses(poses) if inverted else poses)
    options = ["--invert"] if inverted else []
    _, _, err = run("kitti", "kitti/reference.txt", path)
    assert err.count("\n") == 1
    assert "turned by a constant rotation" in err
    assert "180 deg about x, as OpenGL's camera axes to OpenCV's" in err
    assert ("; add --invert, with --body_rotation auto\n" in err) == inverted
    if not inverted:
        _, _, err = run("kitti", "kitti/reference.txt", path, "--invert")
        assert err.endswith("; leave out --invert, with --body_rotation auto\n")
    (plain,) = score("kitti", "kitti/reference.txt", path, *options)
    assert plain["body_rotation"] is None
    assert plain["RAS"] < honest["RAS"] / 3
    (mended,) = score("kitti", "kitti/reference.txt", path, *options, "--body_rotation", "auto")
    assert mended["RAS"] == pytest.approx(honest["RAS"], abs=1e-9)
    assert mended["TAS"] == pytest.approx(honest["TAS"], abs=1e-9)
    assert mended["body_rotation"] == np.diag([1.0, -1.0, -1.0]).tolist()
    assert "taken out" in mended["notes"][0]
    # Where nothing is found nothing is applied.
    (unchanged,) = score("kitti", *FILES["kitti"], "--body_rotation", "auto")
    assert unchanged == honest


def test_other_mix_ups_are_told(run, kitti, examples, tmp_path):
    poses = read_kitti(examples / "kitti/estimate.txt").poses
    mirrored = poses.copy()
    mirrored[:, 1, 3] *= -1
    _, _, err = run("kitti", "kitti/reference.txt", kitti(mirrored))
    assert "the positions fit the mirror image of the reference" in err
    transposed = poses.copy()
    transposed[:, :3, :3] = poses[:, :3, :3].transpose(0, 2, 1)
    _, _, err = run("kitti", "kitti/reference.txt", kitti(transposed))
    assert "the rotations seem to be world-to-camera, but the positions are camera centres" in err

    fields = [line.split() for line in (examples / "tum/estimate.txt").read_text().splitlines()]
    shifted = [" ".join([*line[:4], line[7], *line[4:7]]) for line in fields[1:]]
    (tmp_path / "wxyz.txt").write_text("\n".join(shifted))
    _, _, err = run("tum", FILES["tum"][0], tmp_path / "wxyz.txt")
    assert "the quaternions seem to have w at the wrong end" in err

    gt, est = (tmp_path / name for name in ("gt.txt", "est.txt"))
    times = np.arange(400) / 40
    path = np.column_stack([np.sin(times), np.cos(times), times, np.zeros((400, 3)), np.ones(400)])
    np.savetxt(gt, np.column_stack([times, path]))
    path[:, :3] -= path[0, :3]
    np.savetxt(est, np.column_stack([times, path])[::4])
    assert "swapped" not in run("tum", gt, est)[2]
    assert "reference and estimate seem swapped" in run("tum", est, gt)[2]


# What goes wrong


def failing(tmp_path, content):
    path = tmp_path / "bad.txt"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "bad.txt: has no poses"),
        ("1 2 3 4", "bad.txt, line 1: has 4 columns"),
        (b"\xff\x00\x01", "bad.txt, line 1: is not text"),
        ("0 0 0 0 0 0 0 1\n" * 10**6 + "1 2 3\n", "bad.txt, line 1000001: has 3 columns"),
        ("0 0 0 0 0 0 0 1\n1 2 3 x 0 0 0 1", "bad.txt, line 2: 'x' is not a number"),
        ("0 0 0 0 0 0 0 0", "bad.txt, line 1: the quaternion is zero"),
        ("1 0 0 0 0 0 0 1", "bad.txt: no time stamps in common"),
        ("1700000000 0 0 0 0 0 0 1", "bad.txt: only 1 of 1 poses could be matched .* takes 4"),
        ("1700000000000000000 0 0 0 0 0 0 1", "bad.txt: no .* the estimate seem to be in nanosec"),
    ],
)
def test_one_line_for_a_bad_estimate(run, tmp_path, content, message):
    code, out, err = run("tum", FILES["tum"][0], failing(tmp_path, content))
    assert code == 1
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith(f"alignscores: error: {tmp_path}")
    assert re.search(message, err)


def test_one_line_for_a_bad_reference(run, tmp_path):
    for content in ("", "0 nan 0 0 0 0 0 1", "1,2"):
        code, out, err = run("tum", failing(tmp_path, content), FILES["tum"][1])
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert "bad.txt" in err
    code, _, err = run("kitti", FILES["tum"][0], FILES["kitti"][1])
    assert code == 1
    assert "8 columns are the tum format" in err


def test_different_lengths(run, tmp_path, examples):
    lines = (examples / "kitti/estimate.txt").read_text().splitlines()
    code, _, err = run("kitti", FILES["kitti"][0], failing(tmp_path, "\n".join(lines[:-1])))
    assert code == 1
    assert "bad.txt: the reference has 40 poses, the estimate 39" in err


@pytest.mark.parametrize("name", ["no", "the", "d"])
def test_errors_and_notes_name_the_file_even_where_they_begin_like_it(
    run, tmp_path, examples, monkeypatch, name
):
    reference = examples / "tum/reference.txt"
    lines = (examples / "tum/estimate.txt").read_text().splitlines()[1:]
    monkeypatch.chdir(tmp_path)
    for content, message in (
        (["1 0 0 0 0 0 0 1"], f"error: {name}: no time stamps in common"),
        (lines[:19], f"note: {name}: the track covers"),
        (lines[::-1], f"note: {name}: the time stamps of the estimate are not in order"),
        (
            [*lines[:-1], lines[-1].rpartition(" ")[0] + " 2"],
            f"note: {name}, line 38: has a quaternion",
        ),
    ):
        (tmp_path / name).write_text("\n".join(content))
        _, _, err = run("tum", reference, name)
        assert err.startswith(f"alignscores: {message}")
        assert err.count("\n") == 1


def test_too_few_matches_are_an_error_of_matching(run, score, tmp_path, examples):
    """Not one of the unit: --unit would hide it."""
    lines = (examples / "tum/estimate.txt").read_text().splitlines()[1:]
    early = [line.replace("17000000", "17000009", 1) for line in lines[3:]]
    (tmp_path / "est.txt").write_text("\n".join([*lines[:3], *early]))
    files = FILES["tum"][0], tmp_path / "est.txt"
    for options in ([], ["--unit", 1]):
        code, out, err = run("tum", *files, *options, "--t_max_diff", 0.02)
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert "est.txt: only 3 of 38 poses could be matched" in err
        assert "--t_max_diff 0.02" in err
    (result,) = score("tum", *files, "--missing", "fail")  # 37 of 40 cameras lost is no error
    assert (result["n"], result["matched"]) == (40, 3)


def test_where_there_is_no_d_the_option_is_named(run, score, kitti, examples):
    poses = read_kitti(examples / "kitti/reference.txt").poses
    few = kitti(poses[:3], "few.txt")
    standing = poses.copy()
    standing[5:, :3, 3] = poses[5, :3, 3]
    for path, reason in (
        (few, "the reference has 3 of the 4 poses that it takes"),
        (kitti(standing, "standing.txt"), "three quarters of the reference poses coincide"),
    ):
        code, out, err = run("kitti", path, path)
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert f"{path}: d cannot be derived: " in err
        assert reason in err
        assert err.endswith("--unit sets it\n")
        (result,) = score("kitti", path, path, "--unit", 0.1)
        assert result["TAS"] == 1.0


def test_a_bad_estimate_does_not_stop_the_others(run, tmp_path):
    bad = failing(tmp_path, "1 2")
    code, out, err = run("tum", FILES["tum"][0], bad, FILES["tum"][1], "--json")
    assert code == 1
    assert err.count("\n") == 1
    assert [result["name"] for result in json.loads(out)["results"]] == ["estimate.txt"]


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["tum"],
        ["tum", "reference"],
        ["bag", "a", "b"],
        ["tum", "a", "b", "--unit", "0"],
        ["tum", "a", "b", "--unit", "inf"],
        ["tum", "a", "b", "--repeat", "0"],
        ["tum", "a", "b", "--repeat", "1.5"],
        ["tum", "a", "b", "--seed", "-1"],
        ["tum", "a", "b", "--t_max_diff", "-1"],
        ["tum", "a", "b", "--t_offset", "nan"],
        ["tum", "a", "b", "--registration", "none"],
        ["tum", "a", "b", "--missing", "skip"],
        ["kitti", "a", "b", "--t_offset", "1"],
        ["tum", "a", "b", "--save_results", "b.txt"],
        ["tum", "a", "b", "--save_plot", "b.txt"],
        ["tum", "a", "b", "--save_plot", "no/such/folder/b.png"],
    ],
)
def test_wrong_usage(run, arguments):
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ""
    assert "alignscores" in err.splitlines()[-1]
    assert "error: " in err.splitlines()[-1]


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--repeat", "0", "must be a whole number of at least 1, not '0'"),
        ("--seed", "1.5", "must be a whole number of at least 0, not '1.5'"),
        ("--seed", "9" * 400, "must be a whole number of at least 0"),
        ("--unit", "0", "must be a finite number above 0, not '0'"),
        ("--t_max_diff", "-1", "must be a finite number of at least 0, not '-1'"),
        ("--t_offset", "nan", "must be a finite number, not 'nan'"),
        ("--save_plot", "x.jpg", "x.jpg does not end in .png or .pdf or .svg"),
        ("--save_results", "no/x.zip", "no/x.zip: there is no folder no"),
    ],
)
def test_wrong_values_are_told_with_the_usage_of_their_format(run, option, value, reason):
    code, _, err = run("tum", "a", "b", option, value)
    assert code == 2
    assert err.startswith("usage: alignscores tum ")
    assert f"alignscores tum: error: argument {option}: {reason}" in err


def test_version(run):
    assert run("--version") == (0, f"alignscores {alignscores.__version__}\n", "")


def test_help(run):
    code, out, _ = run("--help")
    assert code == 0
    for form in FILES:
        assert f"alignscores {form} " in out
        code, text, _ = run(form, "--help")
        assert code == 0
        assert f"example: alignscores {form}" in text


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


def test_a_folder_where_a_file_should_be_written(run, tmp_path):
    (tmp_path / "a.png").mkdir()
    code, _, err = run("tum", *FILES["tum"], "--save_plot", tmp_path / "a.png")
    assert code == 1
    assert err == f"alignscores: error: [Errno 21] Is a directory: '{tmp_path / 'a.png'}'\n"
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_nothing_half_written(run, tmp_path, monkeypatch):
    def full(self, target):
        raise OSError(28, "No space left on device", str(target))

    monkeypatch.setattr("pathlib.Path.replace", full)
    code, _, err = run("tum", *FILES["tum"], "--save_results", tmp_path / "a.zip")
    assert code == 1
    assert err.count("\n") == 1
    assert "No space left" in err
    assert list(tmp_path.iterdir()) == []


def test_other_warnings_pass(run, monkeypatch):
    def noisy(*arguments):
        warnings.warn("of something else", RuntimeWarning, stacklevel=1)
        return Convention()

    monkeypatch.setattr(scoring, "find_convention", noisy)
    with pytest.warns(RuntimeWarning, match="of something else"):
        run("tum", *FILES["tum"])


# As a process


def test_as_a_module(examples, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "alignscores", "tum", *FILES["tum"]],
        cwd=examples,
        env={**os.environ, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0
    assert done.stderr == ""
    assert "registration pcr99" in done.stdout
    assert list(tmp_path.iterdir()) == []  # nothing in the home directory


@pytest.mark.parametrize(
    ("blocked", "arguments", "extra"),
    [
        ("evo", ["tum", *FILES["tum"]], "files"),
        ("evo", ["nerf", *FILES["nerf"], "--save_results", "/tmp/never.zip"], "files"),
        ("pycolmap", ["colmap", *FILES["colmap"]], "colmap"),
        ("matplotlib", ["nerf", *FILES["nerf"], "--save_plot", "/tmp/never.png"], "plots"),
    ],
)
def test_missing_extras_are_named(examples, blocked, arguments, extra):
    code = f"sys.modules[{blocked!r}] = None; from alignscores.cli import main; sys.exit(main())"
    done = process(*arguments, cwd=examples, code=code)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr == (
        f'alignscores: error: {blocked} is not installed: pip install "alignscores[{extra}]"\n'
    )


def test_completion_without_argcomplete_is_one_line(examples):
    code = "sys.modules['argcomplete'] = None; from alignscores.cli import main; sys.exit(main())"
    done = process(cwd=examples, code=code, _ARGCOMPLETE="1")
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert 'pip install "alignscores[files]"' in done.stderr


def test_nerf_needs_no_extra(examples):
    blocked = "sys.modules.update(dict.fromkeys(['evo', 'matplotlib', 'pandas', 'pycolmap']))"
    code = f"{blocked}; from alignscores.cli import main; sys.exit(main())"
    done = process("nerf", *FILES["nerf"], cwd=examples, code=code)
    assert (done.returncode, done.stderr) == (0, "")


def test_nobody_reads_on(examples):
    command = f"{sys.executable} -m alignscores tum {' '.join(FILES['tum'])} | true"
    done = subprocess.run(
        ["bash", "-c", command], cwd=examples, capture_output=True, text=True, timeout=100
    )
    assert done.stderr == ""


def test_shell_completion(examples, tmp_path):
    line = "alignscores tum --t_"
    process(
        cwd=examples,
        code="sys.argv[0] = 'alignscores'; from alignscores.cli import main; sys.exit(main())",
        _ARGCOMPLETE="1",
        _ARGCOMPLETE_IFS=" ",
        _ARGCOMPLETE_STDOUT_FILENAME=str(tmp_path / "completions"),
        COMP_LINE=line,
        COMP_POINT=str(len(line)),
    )
    assert (tmp_path / "completions").read_text().split() == ["--t_max_diff", "--t_offset"]


def test_the_output_in_the_readme(examples, run, monkeypatch):
    readme = (examples.parents[1] / "README.md").read_text()
    command, *lines = re.search(r"\$ alignscores (.*?)```", readme, re.DOTALL)[1].splitlines()
    monkeypatch.chdir(examples.parents[1])
    code, out, err = run(*command.split())
    assert code == 0
    assert err.splitlines() + out.splitlines() == lines
    assert len(lines) == 4
