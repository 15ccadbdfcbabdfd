"""Real trajectories: the values that an independent implementation measured on them.

What is deterministic agrees in every digit given. The TAS is a distribution; the values are
its mean and standard deviation over 6 seeds.
"""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import compare, evaluate
from alignscores.cli import main


class Pair(NamedTuple):
    format_name: str
    reference: str
    estimate: str
    n: int
    d: float
    tas: float
    tas_sd: float
    ras: float
    ate: float


KITTI = "KITTI_00_gt.txt"
DESK = "fr2_desk_groundtruth.txt"
PAIRS = [
    Pair("kitti", KITTI, "KITTI_00_ORB.txt", 4541, 0.96539, 0.213, 0.021, 0.9507, 0.938),
    Pair("kitti", KITTI, "KITTI_00_SPTAM.txt", 4541, 0.96539, 0.090, 0.005, 0.8781, 3.635),
    Pair("tum", DESK, "fr2_desk_ORB.txt", 2174, 0.00819, 0.300, 0.009, 0.9238, 0.0061),
    Pair("tum", DESK, "fr2_desk_ORB_kf_mono.txt", 118, 0.06742, 0.865, 0.016, 0.9331, 0.0077),
]
each_pair = pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: Path(pair.estimate).stem)
ROUNDED = {"abs": 0.6e-4, "rel": 0}  # the last digit given


@each_pair
def test_real_runs_have_the_values_of_an_independent_program(real, pair, capsys):
    """By the paper's registration, on the reference poses that are nearest to the estimate's."""
    estimate = str(real / pair.estimate)
    arguments = [pair.format_name, str(real / pair.reference), estimate, "--json"]
    arguments += ["--registration", "pcr99", "--repeat", "4"]
    if pair.format_name == "tum":
        arguments += ["--frames", estimate, "--sync", "nearest"]
    assert main(arguments) == 0
    printed = capsys.readouterr()
    (result,) = json.loads(printed.out)["results"]
    assert result["n"] == result["matched"] == pair.n
    assert result["unit"] == pytest.approx(pair.d, abs=0.6e-5)
    assert result["RAS"] == pytest.approx(pair.ras, **ROUNDED)
    assert result["ate"] == pytest.approx(pair.ate, abs=0.6e-3 if pair.ate > 0.1 else 0.6e-4)
    assert abs(result["TAS"] - pair.tas) < 4 * max(pair.tas_sd, np.std(result["TAS_seeds"]))
    assert result["PAS"] == pytest.approx((result["TAS"] + result["RAS"]) / 2)
    for false_alarm in ("seem", "camera frame", "mirror"):
        assert false_alarm not in printed.err


def shifted(rotations):
    """Return rotations as if w, first in the quaternion, had been read as the last part."""
    return Rotation.from_quat(
        Rotation.from_matrix(rotations).as_quat()[:, [3, 0, 1, 2]]
    ).as_matrix()


OPENGL = np.diag([1.0, -1.0, -1.0])
MISTAKES = {
    "": lambda rotations: rotations,
    "the quaternions of the estimate seem to have w at the wrong end": shifted,
    "the rotations of the estimate seem to be world-to-camera": lambda rotations: rotations.mT,
    "the camera frame of the estimate is rotated against that of the reference, 180 deg": (
        lambda rotations: rotations @ OPENGL
    ),
}


@pytest.mark.parametrize("pair", PAIRS[1::2], ids=lambda pair: Path(pair.estimate).stem)
def test_each_mistake_of_convention_is_named(real, pair):
    """Of a poor estimate of a car, a frame late, and of few keyframes of a camera in the hand."""
    matches = evaluate(real / pair.reference, real / pair.estimate, missing="ignore").matches
    wrongs = {
        "the poses of the estimate seem to be world-to-camera": np.linalg.inv(matches.est_poses)
    }
    for words, mistake in MISTAKES.items():
        wrongs[words] = matches.est_poses.copy()
        wrongs[words][:, :3, :3] = mistake(matches.est_poses[:, :3, :3])
    usual = {"clock", "low", "apart", "few"}
    for words, wrong in wrongs.items():
        notes = evaluate(matches.gt_poses, wrong, unit=matches.unit).notes
        (text,) = [note.text for note in notes if note.kind not in usual] or [""]
        assert words in text
        assert bool(text) == bool(words)


@pytest.mark.slow
def test_the_means_of_visual_inertial_systems_on_a_page(real):
    """TAS, half-score distance, RAS and ATE under each alignment, over the four sequences."""
    if not (real / "euroc").is_dir():
        pytest.skip(f"no EuRoC runs at {real}")
    page = (Path(__file__).parents[2] / "docs/how-to/alignment.md").read_text()
    paths = [
        str(real / "euroc" / pattern)
        for pattern in ("{sequence}/groundtruth.txt", "{sequence}/vio_{system}/{run}.txt")
    ]
    frames = []
    for alignment in ("similarity", "rigid", "yaw"):
        comparison = compare(*paths, jobs=1, format="tum", metrics="ate", alignment=alignment)
        columns = ["TAS", "half_distance", "RAS", "ATE"]
        frames.append(comparison.runs.groupby("system")[columns].mean())
    for system in frames[0].index:
        cells = [
            " / ".join(f"{frame.loc[system, name]:.3f}" for frame in frames) for name in columns
        ]
        assert f"| `vio_{system}` | {' | '.join(cells)} |" in page


def test_a_run_that_fails_early(real, tmp_path):
    """The numbers at the top of README.md: the ATE improves, the PAS drops; evo's ATE is in evo."""
    folder, cut = real / "euroc/MH_03", tmp_path / "cut.txt"
    lines = (folder / "vio_mono/0.txt").read_text().splitlines()
    cut.write_text("\n".join(lines[: int(0.4 * len(lines))]))
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    for file, ate, pas in ((folder / "vio_mono/0.txt", 0.136, 0.623), (cut, 0.057, 0.336)):
        evaluation = evaluate(folder / "groundtruth.txt", file, sync="nearest")
        assert (evaluation.ate, evaluation.pas) == pytest.approx((ate, pas), abs=1e-3)
        assert f"{ate} m" in readme
        assert f"| {pas} |" in readme


def test_s_ptam_is_a_frame_late_on_kitti_00(real):
    """Its ATE, TAS and RAS are better if its row n is frame n + 1."""
    evaluation = evaluate(real / "KITTI_00_gt.txt", real / "KITTI_00_SPTAM.txt")
    (hint,) = [str(note) for note in evaluation.notes if note.kind == "clock"]
    assert hint.startswith("its frames are off by 1 against those of ")
    reference, estimate = evaluation.reference, evaluation.estimate
    later = evaluate(reference, estimate._replace(keys=estimate.keys + 1))
    assert later.ate < evaluation.ate - 0.1
    assert later.tas > evaluation.tas + 0.03
    assert later.ras > evaluation.ras + 0.04
