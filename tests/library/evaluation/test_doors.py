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
FORMS = {"tum", "kitti", "colmap"}
TIMED, NAMED = {"tum"}, {"colmap"}
LENIENT = {"max_threshold": 100, "max_threshold_deg": 180}
POSE = "t x y z qx qy qz qw"
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
CASES = {  # what differs from the defaults: the formats that have it, and settings
    "nothing": (FORMS, {}),
    "missing": (FORMS - {"kitti"}, {"missing": "ignore"}),
    "sync": (TIMED, {"sync": "nearest", "max_gap": 0.0}),
    "rate": (TIMED, {"rate": 5, "max_gap": 0.5}),
    "limits": (TIMED, {"t_start": 1.7e9 + 0.5, "t_end": 1.7e9 + 3.2}),
    "t_offset": (TIMED, {"t_offset": -0.0019, "t_max_diff": 0.0005}),
    "t_offset auto": (TIMED, {"t_offset": "auto"}),
    "frames": (TIMED, {"frames": "frames.txt"}),
    "invert": (TIMED, {"invert": True}),
    "both of them": (FORMS, {"invert": True, "body_rotation": "auto"}),
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

    def written(case, form):
        settings = CASES[case][1]
        ending = "" if form == "colmap" else ".any"
        path = folder / f"{case}_{form}" / f"orb{ending}"
        reference = examples / FILES[form][0]
        if path.exists():
            return reference, path.parent / f"{{system}}{ending}", path
        path.parent.mkdir(exist_ok=True)
        keys, poses = FORMATS[form].read(examples / FILES[form][1])
        if settings.get("body_rotation"):
            poses = poses @ OPENGL
        if settings.get("invert"):
            poses = inverse_poses(poses)
        as_form = OTHER[form] if "est_format" in settings else form
        write_poses[as_form](path, keys, poses)
        return reference, path.parent / f"{{system}}{ending}", path

    return written


def settings_of(case, form):
    """Return the settings of a case for Python."""
    settings = {"format": form, "metrics": METRICS}
    if form in NAMED:
        settings["metrics"] = METRICS.removesuffix(",kitti")
    settings |= CASES[case][1]
    if "est_format" in settings:
        settings["est_format"] = OTHER[form]
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
    ("case", "form"), [(case, form) for case in CASES for form in sorted(CASES[case][0])]
)
def test_every_door_gives_the_same_numbers(case, form, written, command, tmp_path, monkeypatch):
    reference, pattern, estimate = written(case, form)
    monkeypatch.chdir(estimate.parents[1])
    settings = settings_of(case, form)
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
    expected_row["d"] = expected_row.pop("unit")
    del expected_row["metrics"]
    assert {name: compared[name] for name in expected_row} == expected_row
    cached = set(tmp_path.iterdir())
    options = *words(settings), "--json", "--cache", tmp_path, "--jobs", 1
    _, out, _ = command("compare", settings["format"], reference, pattern, *options)
    assert json.loads(out) == comparison.to_dict()
    assert set(tmp_path.iterdir()) == cached  # by the same settings: nothing is computed anew

    in_memory = [
        FORMATS[form].read(reference),
        FORMATS[settings.get("est_format", form)].read(estimate),
    ]
    settings.pop("format")
    if "frames" in settings:
        settings["frames"] = read_stamps(settings["frames"])
    comparison = evaluate(*in_memory, **settings).to_dict()
    assert numbers(comparison) == numbers(expected)
    assert comparison["ate"] == expected["ate"]


@pytest.mark.parametrize("form", sorted(FORMS))
def test_what_is_taken_out_is_taken_out_of_metrics_too(form, written):
    """They are of the poses as these were scored."""
    honest, plain, corrected = (
        evaluate(*written(case, form)[::2], **settings_of(case, form))
        for case in ("nothing", "invert", "both of them")
    )
    assert corrected.ras == pytest.approx(honest.ras, abs=1e-9)
    assert corrected.body_rotation is not None
    assert plain.body_rotation is None
    assert corrected.metrics == pytest.approx(honest.metrics, abs=1e-9)
