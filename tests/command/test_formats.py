"""The same scene in every format."""

import json
import shlex

import numpy as np
import pytest

from alignscores import evaluate, pas
from alignscores.io import FORMATS, read_colmap
from tests.files import AT_STAMPS, FILES, write_poses


@pytest.mark.parametrize("format_name", FILES)
def test_every_format_scores_the_same_scene_the_same(format_name, score, examples):
    options = () if format_name == "kitti" else ("--missing", "fail")
    options += AT_STAMPS if FORMATS[format_name].timed else ()
    (result,) = score(format_name, *FILES[format_name], *options, "--registration", "pcr99")
    matches = evaluate(*(examples / path for path in FILES["kitti"])).matches
    expected = pas(matches.gt_poses, matches.est_poses)
    assert result["n"] == 40
    assert result["TAS_seeds"][0] == pytest.approx(expected.tas.score, abs=1e-12)
    assert result["RAS"] == pytest.approx(expected.ras.score, abs=1e-12)
    assert result["unit"] == pytest.approx(expected.tas.unit)
    assert result["within_unit"] == np.mean(expected.tas.errors < expected.tas.unit)
    assert result["within_10_deg"] == np.mean(expected.ras.errors < 10)
    # 37 of 40 were estimated; how the others show depends on the format.
    assert result["expected"] == 40
    assert result["lost"] == pytest.approx(3 / 40)


TIMED, NAMED = {"tum", "euroc"}, {"colmap", "nerf"}


@pytest.mark.parametrize("format_name", sorted(TIMED | NAMED))
def test_lost_frames_are_counted(format_name, score, run, examples, write, models):
    """In a KITTI file it cannot be left out: it is nan, and fails; one of 18 with a time is nan."""
    lost = 23 if FORMATS[format_name].timed else 22
    if format_name == "colmap":
        half = models(range(18)) / "0"
    elif format_name == "nerf":
        content = json.loads((examples / FILES[format_name][1]).read_text())
        half = write(json.dumps({"frames": content["frames"][:18]}))
    else:
        half = write((examples / FILES[format_name][1]).read_text().splitlines()[:19])
    options = AT_STAMPS if FORMATS[format_name].timed else ()
    files = format_name, FILES[format_name][0], half, *options
    (ignored,) = score(*files, "--missing", "ignore")
    (failed,) = score(*files, "--missing", "fail")
    assert (ignored["n"], ignored["expected"]) == (40 - lost, 40)
    assert (failed["n"], failed["matched"]) == (40, 40 - lost)
    assert failed["lost"] == ignored["lost"] == pytest.approx(lost / 40)
    assert failed["RAS"] == pytest.approx(ignored["RAS"] * (40 - lost) / 40)
    _, out, _ = run(*files, "--missing", "ignore")
    assert ", lost ones left out; " in out


@pytest.mark.parametrize(("format_name", "est_format"), [("colmap", "nerf"), ("nerf", "colmap")])
def test_estimates_of_another_format(format_name, est_format, score, run):
    """The images are in a folder in one of them, and not in the other."""
    (result,) = score(
        format_name, FILES[format_name][0], FILES[est_format][1], "--est_format", est_format
    )
    (expected,) = score(format_name, *FILES[format_name])
    assert result["PAS"] == pytest.approx(expected["PAS"], abs=1e-12)
    assert "matched by the end of their path: " in result["notes"][0]["text"]
    (result,) = score("tum", FILES["tum"][0], FILES["euroc"][0], "--est_format", "euroc")
    assert result["PAS"] == 1.0


@pytest.fixture
def models(examples, tmp_path):
    """(rows of each part) -> a folder of COLMAP models with these images of the estimate."""
    names, poses = read_colmap(examples / "colmap/estimate")

    def models(*parts):
        for number, rows in enumerate(parts):
            write_poses["colmap"](tmp_path / f"sparse/{number}", names[rows], poses[rows])
        return tmp_path / "sparse"

    return models


def test_a_folder_of_models_is_no_reference(run, models):
    folder = models(range(18), range(13, 35))
    code, _, err = run("colmap", folder, "colmap/estimate")
    assert code == 1
    assert err.endswith(f"sparse: holds 2 models; name one, such as {folder / '0'}\n")


def test_the_columns_that_a_refusal_names_are_read(run, examples, write):
    """The format of the estimate is its own, whatever that of the reference."""
    rows = (examples / "colmap/reference/images.txt").read_text().splitlines()
    rows = [row.replace(" ", ",") for row in rows if row.endswith(".png")]
    table = write(["image_id,qw,qx,qy,qz,tx,ty,tz,camera_id,name", *rows], "est.csv")
    code, _, err = run("colmap/reference", table)
    assert code == 1
    options = shlex.split(err.partition("as in ")[2])
    assert options[:2] == ["--est_invert", "--est_columns"]
    code, out, _ = run("colmap/reference", table, *options)
    assert (code, out.splitlines()[1].split()[1:4]) == (0, ["1.000"] * 3)
    message = "est.csv: is not a text table but read as colmap: --est_columns does not apply; name"
    assert message in run("colmap", "colmap/reference", table, *options)[2]
