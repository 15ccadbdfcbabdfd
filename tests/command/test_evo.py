"""In evo's place: its options, and results that its other programs and its users read."""

import json
import re
import shutil
import sys
import warnings
import zipfile
from contextlib import nullcontext, redirect_stdout, suppress
from decimal import Decimal
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from evo.tools import file_interface

from tests.files import KITTI, TUM

SCORES = "TAS", "RAS", "PAS", "half_distance", "half_angle"


@pytest.fixture
def finite(examples, tmp_path, monkeypatch):
    """The example in TUM's format without its pose of nan, at which evo stops."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(examples / TUM[1], "groundtruth.txt")
    lines = (examples / TUM[2]).read_text().splitlines(keepends=True)
    (tmp_path / "run.txt").write_text("".join(line for line in lines if "nan" not in line))
    return "tum", "groundtruth.txt", "run.txt"


def evo(program, *arguments):
    """Run a program of evo, in this process; return what it prints."""
    with (
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(StringIO()) as printed,
        warnings.catch_warnings(action="ignore"),
    ):
        from evo.cli import entry_points
        from evo.tools.settings import SETTINGS

        patch.setattr(sys, "argv", [program, *map(str, arguments)])
        patch.setitem(SETTINGS, "save_traj_in_zip", True)
        with suppress(SystemExit) if "--help" in arguments else nullcontext():
            getattr(entry_points, program)()
    return printed.getvalue()


def evo_ape(*arguments):
    """Return the result that evo_ape saves, with the trajectories."""
    evo("ape", *arguments, "--save_results", "evo.zip", "--no_warnings")
    return zipfile.ZipFile("evo.zip")


@pytest.mark.parametrize(
    "options",
    [
        ["-as"],
        ["-va"],
        ["-as", "-r", "angle_deg"],
        ["-a", "-r", "point_distance", "--t_max_diff", "0.02", "--t_offset", "0.004"],
    ],
)
def test_the_zip_is_that_of_evo_with_our_scores(run, score, finite, options):
    """Every file in it: information, statistics to all digits, arrays and both trajectories."""
    theirs = evo_ape(*finite, *options)
    code, _, err = run(*finite, *options, "--save_results", "ours.zip")
    assert code == 0, err
    ours = zipfile.ZipFile("ours.zip")
    assert ours.namelist() == theirs.namelist()
    assert ours.read("info.json") == theirs.read("info.json")
    stats, expected = (json.loads(archive.read("stats.json")) for archive in (ours, theirs))
    assert {name: stats[name] for name in expected} == expected
    (scores,) = score(*finite, *options, "--save_results", "ours.zip")
    assert {name: stats[name] for name in SCORES} == {name: scores[name] for name in SCORES}
    assert stats["coverage"] == 1 - scores["lost"]
    for name in ours.namelist()[2:]:
        read = np.load if name.endswith(".npy") else np.loadtxt
        values = [read(archive.open(name)) for archive in (ours, theirs)]
        if name.endswith(".tum"):  # a quaternion and its negative are the same rotation
            values = [np.column_stack([rows[:, :4], np.abs(rows[:, 4:])]) for rows in values]
        np.testing.assert_allclose(*values, rtol=1e-12, atol=1e-9)


def test_nanoseconds_are_associated_as_evo_does(run, finite):
    """With all digits of both files, though here they are seconds, and so are the options."""
    for file in finite[1:]:
        rows = [line.split() for line in Path(file).read_text().splitlines() if line[0] != "#"]
        lines = [" ".join([str(int(Decimal(row[0]) * 10**9)), *row[1:]]) for row in rows]
        Path(file).write_text("\n".join(lines) + "\n")
    theirs = evo_ape(*finite, "-as", "--t_max_diff", "20000000", "--t_offset", "4000000")
    code, _, err = run(
        *finite, "-as", "--t_max_diff", "0.02", "--t_offset", "0.004", "--save_results", "ours.zip"
    )
    assert code == 0, err
    ours = zipfile.ZipFile("ours.zip")
    stats, expected = (json.loads(archive.read("stats.json")) for archive in (ours, theirs))
    assert {name: stats[name] for name in expected} == expected
    stamps = [np.load(archive.open("timestamps.npy")) for archive in (ours, theirs)]
    np.testing.assert_array_equal(*stamps)


def test_the_zip_of_rows_and_of_names(run, score, examples, tmp_path):
    """Without stamps evo has the matched poses; names have no order of time."""
    for files in (KITTI, ("colmap", "colmap/reference", "colmap/estimate")):
        assert run(*files, "--save_results", tmp_path / "one.zip")[0] == 0
        result = file_interface.load_res_file(tmp_path / "one.zip", load_trajectories=True)
        (expected,) = score(*files)
        assert result.stats["rmse"] == pytest.approx(expected["ate"])
        assert result.stats["TAS"] == expected["TAS"]
        assert result.info["title"].startswith("APE w.r.t. translation part (m)")
        lengths = {trajectory.num_poses for trajectory in result.trajectories.values()}
        assert lengths == {len(result.np_arrays["error_array"])}


def test_the_zip_under_each_alignment(run, finite):
    """Yaw, which evo lacks, is aligned before; the title says so."""
    titles = []
    for alignment in ("none", "yaw"):
        assert run(*finite, "--alignment", alignment, "--save_results", "a.zip")[0] == 0
        result = file_interface.load_res_file("a.zip")
        titles.append(result.info["title"].partition("\n")[2])
        ate = json.loads(run(*finite, "--alignment", alignment, "--json")[1])["results"][0]["ate"]
        assert result.stats["rmse"] == pytest.approx(ate, rel=0.02)  # nearest, not interpolated
    assert titles == ["(not aligned)", "(with yaw alignment of alignscores)"]


def test_an_estimate_without_a_result_of_evo(run, finite, tmp_path):
    """It is scored; one line says why there is no file."""
    line = np.zeros((40, 8))
    line[:, :2], line[:, 7] = np.arange(40)[:, None] * [0.1, 1], 1
    np.savetxt("line.txt", line)
    code, out, err = run("tum", "line.txt", "line.txt", "--save_results", "never.zip")
    assert code == 1
    assert "never.zip: is not written, since evo has no result: Degenerate covariance" in err
    assert out.startswith("estimate")
    assert not (tmp_path / "never.zip").exists()


def test_what_a_benchmark_around_evo_does_with_the_zip(run, finite, tmp_path):
    """The calls of VSLAM-LAB: it takes both trajectories by their path, and evo_res's table."""
    truth, estimate = (tmp_path / name for name in finite[1:])
    saved = tmp_path / "run.zip"
    options = "-va", "-as", "--t_max_diff", "0.05", "--save_results", saved
    assert run("tum", truth, estimate, *options)[0] == 0
    with zipfile.ZipFile(saved) as archive:
        for file in (truth, estimate):
            (name,) = [name for name in archive.namelist() if name.endswith(f"{file}.tum")]
            rows = pd.read_csv(archive.open(name), header=None, sep=" ")
            assert rows.shape == (37, 8)
    theirs = json.loads(evo_ape(*finite, "-as", "--t_max_diff", "0.05").read("stats.json"))
    for arguments in ([], ["--use_filenames"]):
        evo("res", saved, *arguments, "--save_table", "table.csv", "--no_warnings")
        table = pd.read_csv("table.csv", index_col=0)
        assert list(table.index) == [str(saved) if arguments else "run.txt"]
        assert table["rmse"].item() == pytest.approx(theirs["rmse"], rel=1e-14)
        assert {"TAS", "RAS", "PAS", *theirs} <= {*table}


@pytest.mark.parametrize("file_name", ["vislam_ba/3.txt", "vio_mono/0.txt"])
def test_rmse_of_a_real_run(run, real, tmp_path, monkeypatch, file_name):
    monkeypatch.chdir(tmp_path)
    files = real / "euroc/MH_03/groundtruth.txt", real / "euroc/MH_03" / file_name
    assert run("tum", *files, "-as", "--save_results", "ours.zip")[0] == 0
    theirs = evo_ape("tum", *files, "-as")
    stats = [
        json.loads(archive.read("stats.json")) for archive in (zipfile.ZipFile("ours.zip"), theirs)
    ]
    assert stats[0] | stats[1] == stats[0]


@pytest.mark.parametrize(
    ("options", "alignment", "note"),
    [
        (["-a"], "rigid", "-a: --alignment rigid"),
        (["-as"], "similarity", "-as: --alignment similarity"),
        (["-sa"], "similarity", "-as: --alignment similarity"),
        (["-va"], "rigid", "-a: --alignment rigid"),
        (["-vas"], "similarity", "-as: --alignment similarity"),
        (["--align", "--correct_scale"], "similarity", "-as: --alignment similarity"),
        (["-a", "--alignment", "rigid"], "rigid", "-a: --alignment rigid"),
        (["-v", "-r", "trans_part"], "similarity", ""),
    ],
)
def test_options_that_mean_the_same(run, options, alignment, note):
    code, out, err = run(*TUM, *options, "--json")
    assert code == 0
    assert json.loads(out)["alignment"] == alignment
    assert note in err
    assert ("alignscores: note: -a" in err) == bool(note)


@pytest.mark.parametrize(
    ("metrics", "note"),
    [
        ("ate:rmse,are,tas", "ate:rmse, are: aligned as by -as of evo"),
        ("ate:rmse:se3,rpe@1f:none", ""),
    ],
)
def test_metrics_of_evo_keep_their_alignment(run, metrics, note):
    """A user of evo takes ``-a --metrics ate:rmse`` for the value of ``evo_ape -a``."""
    err = run(*TUM, "-a", "--metrics", metrics)[2]
    assert ("aligned as by -as" in err) == bool(note)
    assert note in err
    assert "aligned as by -as" not in run(*TUM, "-as", "--metrics", metrics)[2]


def test_the_plot_window_of_p(run):
    assert run(*TUM, "-p")[2] == run(*TUM, "--plot")[2]


@pytest.mark.parametrize(
    ("options", "instead"),
    [
        (["-s"], "-as is --alignment similarity"),
        (["-a", "--alignment", "yaw"], "-a is --alignment rigid, and --alignment is yaw"),
        (["-r", "angle_deg"], "--metrics are:rmse is evo's value"),
        (["-r", "full"], "-r is for --save_results"),
        (["--sync_method", "interpolation"], "--sync interpolate"),
        (["--n_to_align", "50"], "--alignment none"),
        (["--project_to_plane=xy"], "--alignment yaw"),
    ],
)
def test_options_that_are_said_otherwise(run, options, instead):
    code, out, err = run(*TUM, *options)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"alignscores: error: {options[0]}")
    assert instead in err


def test_every_option_of_evo_is_taken_or_answered(run, tmp_path, monkeypatch):
    """None is unknown, but those of plots that only evo draws."""
    monkeypatch.chdir(tmp_path)
    usages = re.findall(r"^  (-[^\n]*?)(?:  |$)", evo("ape", "tum", "--help"), re.MULTILINE)
    options = re.findall(r"(?<![\w-])--?\w+", " ".join(usages))
    assert {"-a", "--align", "-s", "-v", "--sync_method", "--save_results"} <= {*options}
    for option in options:
        if not option.startswith(("--plot_", "--ros_map", "--map_tile")):
            assert "unrecognized arguments" not in run(*TUM, option)[2], option
