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

from alignscores import cli, pas, tas
from alignscores.association import match
from alignscores.cli import main
from alignscores.io import inverse_poses, read_kitti, read_tum
from alignscores.report import unique_names

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
    header, row, settings = out.splitlines()
    assert header.split("  ")[0] == "estimate"
    cells = row.split()
    assert cells[0] == "estimate.txt"
    assert cells[-5:] == ["38", "38", "2", "1", "0"]
    assert header.split()[-5:] == ["n", "matched", "missing", "non-finite", "duplicate"]
    assert "ATE [m]" in header
    assert "d [m]" in header
    assert "registration pcr99, seed 0" in settings
    assert "missing cameras: ignore" in settings


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
    }
    assert {key: printed[key] for key in settings} == settings


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
    assert "of the reference's time" not in err
    code, _, err = run("nerf", *FILES["nerf"][::-1])
    assert code == 0
    assert "3 of 40 images are not in the reference; left out (it has all of" in err


def test_an_estimate_that_ends_early_is_told(run, tmp_path, examples):
    """Else lost frames would silently improve the score."""
    lines = (examples / "tum/estimate.txt").read_text().splitlines()
    (tmp_path / "est.txt").write_text("\n".join(lines[:20]))
    _, _, err = run("tum", FILES["tum"][0], tmp_path / "est.txt")
    assert "est.txt: only 51% of the reference's time is scored; --missing fail counts" in err
    assert run("tum", FILES["tum"][0], tmp_path / "est.txt", "--missing", "fail")[2] == ""


def test_the_registration_is_named_and_a_steadier_one_pointed_to(run, monkeypatch):
    pcr99 = cli.REGISTRATIONS["pcr99"]
    monkeypatch.setitem(cli.REGISTRATIONS, "refined", pcr99)
    _, out, _ = run("tum", *FILES["tum"], "--registration", "pcr99")
    assert "--registration refined makes it steadier" in out
    _, out, _ = run("tum", *FILES["tum"], "--registration", "refined")
    assert "registration refined, seed 0" in out
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
    assert ("--invert --body_rotation auto" in err) == inverted
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
        ("1700000000 0 0 0 0 0 0 1", "bad.txt: TAS needs at least 4 .*; pass --unit to set it"),
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


def test_help(run):
    code, out, _ = run("--help")
    assert code == 0
    for form in FILES:
        assert f"alignscores {form} " in out
        code, text, _ = run(form, "--help")
        assert code == 0
        assert f"example: alignscores {form}" in text


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
        return cli.Convention()

    monkeypatch.setattr(cli, "find_convention", noisy)
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
    code, out, _ = run(*command.split())
    assert code == 0
    assert out.splitlines()[: len(lines)] == lines
    assert len(lines) == 2
