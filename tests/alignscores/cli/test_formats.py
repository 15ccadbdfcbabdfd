"""The same scene in every format."""

import json

import numpy as np
import pytest

from alignscores import pas
from alignscores.cli.formats import FORMATS
from alignscores.trajectories.association import match
from alignscores.trajectories.files import read_kitti

FILES = {
    "tum": ("tum/reference.txt", "tum/estimate.txt"),
    "kitti": ("kitti/reference.txt", "kitti/estimate.txt"),
    "euroc": ("euroc/data.csv", "euroc/estimate.txt"),
    "colmap": ("colmap/reference", "colmap/estimate"),
    "nerf": ("nerf/reference.json", "nerf/estimate.json"),
}


@pytest.mark.parametrize("form", FILES)
def test_every_format_scores_the_same_scene_the_same(form, score, examples):
    missing = () if form == "kitti" else ("--missing", "fail")
    (result,) = score(form, *FILES[form], *missing)
    matches = match(*(read_kitti(examples / path) for path in FILES["kitti"]))
    expected = pas(matches.gt_poses, matches.est_poses)
    assert set(result) == {
        *("name", "file", "rank", "TAS", "TAS_sd", "RAS", "PAS", "PAS_sd", "TAS_seeds"),
        *("PAS_seeds", "ATE", "n", "lost", "matched", "missing", "non_finite", "no_position"),
        *("no_rotation", "duplicate", "unmatched", "unit", "within_unit", "within_10_deg"),
        *("n_hypotheses", "alignment", "body_rotation", "notes"),
    }
    assert result["n"] == 40
    assert result["TAS_seeds"][0] == pytest.approx(expected.tas.score, abs=1e-12)
    assert result["RAS"] == pytest.approx(expected.ras.score, abs=1e-12)
    assert result["PAS_seeds"][0] == pytest.approx(expected.score, abs=1e-12)
    assert result["unit"] == pytest.approx(expected.tas.unit)
    assert result["within_unit"] == np.mean(expected.tas.errors < expected.tas.unit)
    assert result["within_10_deg"] == np.mean(expected.ras.errors < 10)
    # 37 of 40 were estimated; how the others show depends on the format.
    assert result["matched"] - result["non_finite"] == 37
    assert result["matched"] + result["missing"] == 40


@pytest.mark.parametrize("form", [form for form in FILES if FORMATS[form].missing])
def test_missing_cameras_by_default(form, score):
    """Identity by name: they fail. By time: a reference has poses that nobody could estimate."""
    (result,) = score(form, *FILES[form])
    assert result["n"] == (38 if form in ("tum", "euroc") else 40)
    (ignoring,) = score(form, *FILES[form], "--missing", "ignore")
    assert ignoring["n"] == ignoring["matched"]
    assert ignoring["missing"] == result["missing"]


def test_the_order_of_frames_in_the_file_changes_nothing(score, examples, write):
    (colmap,) = score("colmap", *FILES["colmap"])
    for seed in range(3):
        files = []
        for name in ("reference", "estimate"):
            content = json.loads((examples / f"nerf/{name}.json").read_text())
            np.random.default_rng(seed).shuffle(content["frames"])
            files.append(write(json.dumps(content), f"{name}.json"))
        (shuffled,) = score("nerf", *files)
        assert shuffled["TAS_seeds"] == score("nerf", *FILES["nerf"])[0]["TAS_seeds"]
        assert shuffled["TAS"] == pytest.approx(colmap["TAS"], abs=1e-12)


@pytest.mark.parametrize(("form", "other"), [("colmap", "nerf"), ("nerf", "colmap")])
def test_estimates_of_another_format(form, other, score, run):
    """The images are in a folder in one of them, and not in the other."""
    (result,) = score(form, FILES[form][0], FILES[other][1], "--est_format", other)
    assert result["PAS"] == pytest.approx(score(form, *FILES[form])[0]["PAS"], abs=1e-12)
    assert "matched by file name: " in result["notes"][0]
    (result,) = score("tum", FILES["tum"][0], FILES["euroc"][0], "--est_format", "euroc")
    assert result["PAS"] == 1.0
    assert run("tum", *FILES["tum"], "--est_format", "kitti")[0] == 2


def test_euroc_estimates_in_nanoseconds(score, lines, write):
    """As ORB-SLAM3 writes them; in the format tum they are refused with a hint."""
    poses = [line.split() for line in lines]
    path = write([f"{float(t) * 1e9:.6f} {' '.join(pose)}" for t, *pose in poses], "f_orb.txt")
    (seconds,), (nanoseconds,) = (
        score("euroc", "euroc/data.csv", estimate) for estimate in ("tum/estimate.txt", path)
    )
    assert nanoseconds["TAS"] == pytest.approx(seconds["TAS"], abs=1e-9)
    assert nanoseconds["matched"] == seconds["matched"]
