"""One input has the same numbers from every door: Python, the command, and the comparison."""

import json

import numpy as np
import pytest

from alignscores import compare, evaluate
from alignscores.evaluation.evaluation import finite_or_none
from alignscores.io import FORMATS, inverse_poses, read_stamps
from alignscores.metrics import metric
from tests.files import FILES, write_poses

NUMBERS = "TAS", "RAS", "PAS", "half_distance", "half_angle", "n", "unit", "metrics"
METRICS = "ATE,ate:rmse,auc@30:vggt,kitti"
ALL_FORMATS = {"tum", "kitti", "colmap"}
TIMED, NAMED = {"tum"}, {"colmap"}
LENIENT = {"max_threshold": 100, "max_threshold_deg": 180}
POSE = "t x y z qx qy qz qw"
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
CASES = {  # what differs from the defaults: the formats that have it, and settings
    "nothing": (ALL_FORMATS, {}),
    "missing": (ALL_FORMATS - {"kitti"}, {"missing": "ignore"}),
    "sync": (TIMED, {"sync": "nearest", "max_gap": 0.0}),
    "rate": (TIMED, {"rate": 5, "max_gap": 0.5}),
    "limits": (TIMED, {"t_start": 1.7e9 + 0.5, "t_end": 1.7e9 + 3.2}),
    "t_offset": (TIMED, {"t_offset": -0.0019, "t_max_diff": 0.0005}),
    "t_offset auto": (TIMED, {"t_offset": "auto"}),
    "frames": (TIMED, {"frames": "frames.txt"}),
    "invert": (TIMED, {"invert": True}),
    "both of them": ({"kitti"}, {"invert": True, "body_rotation": "auto"}),
    "thresholds": (
        NAMED,
        {"unit": 0.25, "max_threshold": 0.2, "max_threshold_deg": 3, "weight": 0.2},
    ),
    "registration": (NAMED, {"registration": "pcr99", "seed": 4, "repeat": 3}),
    "rigid": (TIMED, {"alignment": "rigid"}),
    "yaw": (NAMED, {"alignment": "yaw", "up": "-y", **LENIENT}),
    "none": (TIMED, {"alignment": "none", "registration": "pcr99", **LENIENT}),
    "est_format": ({"tum", "colmap"}, {"est_format": None}),
    "lever_arm": (TIMED, {"lever_arm": "0.1,0,0.2"}),
    "reference_sigma": (NAMED, {"reference_sigma": "0.05,2"}),
    "columns": (TIMED, {"columns": POSE, "ref_columns": POSE, "est_columns": f"t_s{POSE[1:]}"}),
    "metrics": (NAMED, {"metrics": "ATE,rra@5:vggt,TAS,PAS,half_distance"}),
}
OTHER = {"tum": "euroc", "colmap": "nerf"}  # est_format


@pytest.fixture(scope="module")
def written(examples, tmp_path_factory):
    """(case, format) -> the reference, a pattern of the estimate, and the estimate itself.

    The estimates are those of the examples, inverted or with another camera frame where the
    settings say so.
    """
    folder = tmp_path_factory.mktemp("doors")
    stamps = read_stamps(examples / "tum/reference.txt")
    np.savetxt(folder / "frames.txt", stamps[::2] - 0.002, fmt="%.6f")

    def written(case, format_name):
        settings = CASES[case][1]
        ending = "" if format_name == "colmap" else ".any"
        path = folder / f"{case}_{format_name}" / f"orb{ending}"
        reference = examples / FILES[format_name][0]
        if path.exists():
            return reference, path.parent / f"{{system}}{ending}", path
        path.parent.mkdir(exist_ok=True)
        keys, poses = FORMATS[format_name].read(examples / FILES[format_name][1])
        if settings.get("body_rotation"):
            poses = poses @ OPENGL
        if settings.get("invert"):
            poses = inverse_poses(poses)
        est_format = OTHER[format_name] if "est_format" in settings else format_name
        write_poses[est_format](path, keys, poses)
        return reference, path.parent / f"{{system}}{ending}", path

    return written


def settings_of(case, format_name):
    """Return the settings of a case for Python."""
    settings = {"format": format_name, "metrics": METRICS}
    if format_name in NAMED:
        settings["metrics"] = METRICS.removesuffix(",kitti")
    settings |= CASES[case][1]
    if "est_format" in settings:
        settings["est_format"] = OTHER[format_name]
    return settings


def words(settings):
    """Return settings as they stand on the command line, but for the format."""
    options = []
    for name, value in settings.items():
        if name != "format":
            options += [f"--{name}"] if value is True else [f"--{name}={value}"]
    return options


def numbers(result):
    """Return the numbers that all doors give, of an entry in their results."""
    return {key: result[key] for key in NUMBERS}


def in_columns(metrics):
    """Return metrics as a comparison has them: the worst where there is no value."""
    return {
        name: finite_or_none(metric(name).worst) if value is None else value
        for name, value in metrics.items()
        if name not in NUMBERS
    }


@pytest.mark.parametrize(
    ("case", "format_name"),
    [(case, format_name) for case in CASES for format_name in sorted(CASES[case][0])],
)
def test_every_door_gives_the_same_numbers(
    case, format_name, written, command, tmp_path, monkeypatch
):
    reference, pattern, estimate = written(case, format_name)
    monkeypatch.chdir(estimate.parents[1])
    settings = settings_of(case, format_name)
    evaluation = evaluate(reference, estimate, **settings)
    expected = evaluation.to_dict()
    assert expected["ate"] == evaluation.ate
    assert 0 < expected["TAS"] < 1
    assert 0 < expected["RAS"] < 1

    _, out, _ = command(settings["format"], reference, estimate, *words(settings), "--json")
    document = json.loads(out)
    (printed,) = document["results"]
    printed_notes, notes = printed.pop("notes"), expected.pop("notes")
    of_reference = "ends", "reference"
    assert [note for note in notes if note["kind"] not in of_reference] == printed_notes
    assert printed == {**expected, "name": printed["name"], "file": str(estimate)}

    comparison = compare(str(reference), str(pattern), cache=tmp_path, **settings)
    (compared,) = comparison.to_dict()["runs"]
    expected_row = numbers(expected) | in_columns(expected["metrics"])
    del expected_row["metrics"]
    assert {name: compared[name] for name in expected_row} == expected_row
    cached = set(tmp_path.iterdir())
    options = *words(settings), "--json", "--cache", tmp_path, "--jobs", 1
    _, out, _ = command("compare", settings["format"], reference, pattern, *options)
    assert json.loads(out) == comparison.to_dict()
    assert set(tmp_path.iterdir()) == cached  # by the same settings: nothing is computed anew

    in_memory = [
        FORMATS[format_name].read(reference),
        FORMATS[settings.get("est_format", format_name)].read(estimate),
    ]
    settings.pop("format")
    if "frames" in settings:
        settings["frames"] = read_stamps(settings["frames"])
    comparison = evaluate(*in_memory, **settings).to_dict()
    assert numbers(comparison) == numbers(expected)
    assert comparison["ate"] == expected["ate"]


@pytest.mark.parametrize("format_name", sorted(ALL_FORMATS))
def test_metrics_are_of_the_corrected_poses(format_name, written):
    """As they are scored: inverted, and without the rotation of the camera frame."""
    honest, plain, corrected = (
        evaluate(*written(case, format_name)[::2], **settings_of(case, format_name))
        for case in ("nothing", "invert", "both of them")
    )
    assert corrected.ras == pytest.approx(honest.ras, abs=1e-9)
    assert corrected.body_rotation is not None
    assert plain.body_rotation is None
    assert corrected.metrics == pytest.approx(honest.metrics, abs=1e-9)
