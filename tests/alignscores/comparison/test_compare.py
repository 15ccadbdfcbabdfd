"""The whole command on made benchmarks whose truth is known."""

import json
import shutil

import numpy as np
import pytest

from alignscores import compare as library_compare
from alignscores import pas, ras_profile, tas_profile
from alignscores.cli import main
from alignscores.trajectories.files import read_tum

SYSTEMS = {  # sigma_t, sigma_r in degrees, every so many frames, share lost at the end
    "best": (0.1, 1.0, 1, 0.0),
    "twin": (0.1, 1.0, 1, 0.0),
    "sparse": (0.25, 2.5, 3, 0.0),
    "loses_track": (0.1, 1.0, 1, 0.6),
}


def test_the_table_tells_the_truth_that_was_put_in(benchmark_of, compare, tmp_path):
    patterns = benchmark_of(SYSTEMS, sequences=("car", "helix", "cube"), runs=3, n=100)
    (tmp_path / "car/twin/2.txt").unlink()
    found = compare(*patterns)
    results = {
        (entry["sequence"], entry["system"], entry["run"]): entry for entry in found["results"]
    }
    assert len(results) == 4 * 3 * 3
    gone = results["car", "twin", "2"]
    assert (gone["status"], gone["TAS"], gone["RAS"], gone["PAS"]) == ("missing", 0, 0, 0)
    assert (gone["half_distance"], gone["half_angle"], gone["failures"]) == (None, None, 100)
    assert results["car", "loses_track", "0"]["failures"] == 50  # half a gap is covered
    assert len({entry["unit"] for key, entry in results.items() if key[0] == "car"} - {None}) == 1

    def entry(system, sequence=None):
        (only,) = (
            each
            for each in found["systems"]
            if (each["system"], each["sequence"]) == (system, sequence)
        )
        return only

    car = [results["car", "twin", str(number)]["PAS"] for number in range(3)]
    assert entry("twin", "car")["PAS"] == pytest.approx(np.mean(car))
    assert entry("twin", "car")["PAS_sd"] == pytest.approx(np.std(car, ddof=1))
    assert (entry("twin")["runs"], entry("twin")["failed_runs"]) == (9, 1)
    assert entry("sparse")["PAS"] == pytest.approx(
        np.mean([entry("sparse", name)["PAS"] for name in ("car", "helix", "cube")])
    )
    ranks = {name: entry(name)["PAS_rank_best"] for name in SYSTEMS}
    assert ranks["best"] == 1
    assert ranks["twin"] <= 2  # the same system, with a failed run
    assert min(ranks["sparse"], ranks["loses_track"]) == 3
    pair = next(
        pair
        for pair in found["comparisons"]
        if {pair["a"], pair["b"]} == {"best", "sparse"}
        and (pair["sequence"], pair["metric"]) == (None, "TAS")
    )
    assert pair["difference"] == pytest.approx(entry(pair["a"])["TAS"] - entry(pair["b"])["TAS"])
    assert pair["low"] < pair["difference"] < pair["high"]
    assert (pair["better"], pair["method"]) == ("best", "ranks within sequences")


def test_a_run_is_scored_as_the_library_does(benchmark_of, compare, tmp_path):
    name = "ate:rmse"
    patterns = benchmark_of({"only": (0.2, 2.0, 1, 0.0)}, sequences=["car"], runs=1)
    (entry,) = compare(*patterns, "--metrics", name)["results"]
    gt, est = (read_tum(tmp_path / path).poses for path in ("car/gt.txt", "car/only/0.txt"))
    expected = pas(gt, est, registration="refined")
    assert (entry["TAS"], entry["RAS"]) == (expected.tas.score, expected.ras.score)
    assert entry["unit"] == expected.tas.unit
    distance = tas_profile(gt[:, :3, 3], est[:, :3, 3]).half
    assert entry["half_distance"] == pytest.approx(distance, rel=5e-3)
    assert entry["half_angle"] == ras_profile(gt[:, :3, :3], est[:, :3, :3]).half
    assert 0.2 < entry["metrics"][name] < 0.5


def test_cameras_without_a_rotation_are_failures(benchmark_of, compare, tmp_path):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], 2, n=20)
    stamped = np.loadtxt(tmp_path / "car/a/1.txt")
    stamped[3, 4:] = np.nan
    stamped[5:7, 1:4] = np.nan
    np.savetxt(tmp_path / "car/a/1.txt", stamped)
    assert [result["failures"] for result in compare(*patterns)["results"]] == [0, 3]


def test_expected_frames_depend_on_the_reference_alone(benchmark_of, compare, tmp_path):
    """On one sequence a run has every third frame, on the other all; each lacks the second run."""
    patterns = benchmark_of({"a": (0.1, 1.0, 3, 0.0)}, ["car"], runs=2, n=60)
    benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["helix"], runs=1, n=60)
    (tmp_path / "car/a/1.txt").write_text("")
    found = [(one["sequence"], one["n"], one["failures"]) for one in compare(*patterns)["results"]]
    assert found == [("car", 60, 0), ("car", 60, 60), ("helix", 60, 0), ("helix", 60, 60)]


def test_time_that_no_run_of_a_sequence_covers_is_one_note(benchmark_of, tmp_path, monkeypatch):
    """On one no run has the last 4 s, on the other a single one does."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.5), "b": (0.1, 1.0, 1, 0.5)}, n=100)
    benchmark_of({"b": (0.1, 1.0, 1, 0.0)}, ["car"], runs=1, n=100)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "helix/a/0.txt").write_text("")
    notes = library_compare(*patterns[1:], format="tum").notes
    (note,) = (note for note in notes if "no estimate covers" in note)
    assert note.startswith("helix: no estimate covers the last 4.0 s of the reference; --t_end 5.9")
    notes = library_compare(*patterns[1:], format="tum", missing="ignore").notes
    assert not any("no estimate covers" in note for note in notes)


def test_the_chance_level_is_one_note_a_sequence(benchmark_of, tmp_path, monkeypatch):
    """It depends on the reference, which here has few frames."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0), "b": (0.1, 1.0, 1, 0.0)}, ["car"], n=12)
    monkeypatch.chdir(tmp_path)
    notes = [note for note in library_compare(*patterns[1:], format="tum").notes if "moves" in note]
    assert len(notes) == 1
    assert notes[0].startswith("car: a camera that never moves would have a TAS of ")


def test_processes_do_not_matter(benchmark_of, run, tmp_path):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], runs=2)
    reference = tmp_path / "car/gt.txt"
    reference.write_text(reference.read_text() + reference.read_text().splitlines()[-1])
    options = "--json", "--jobs"
    found = run(*patterns, *options, 1)
    assert found == run(*patterns, *options, 2)
    assert found[2] == (
        "alignscores: note: car: duplicates in the reference (of stamp or name), left out: 1\n"
    )


def test_wrong_files_are_a_line_each_and_the_rest_is_compared(benchmark_of, run, tmp_path):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0), "b": (0.3, 1.0, 1, 0.0)}, runs=2)
    (tmp_path / "car/a/0.txt").write_text("")
    (tmp_path / "car/b/1.txt").write_text("this is no trajectory\n")
    (tmp_path / "helix/a/1.txt").unlink()
    (tmp_path / "new/c").mkdir(parents=True)
    (tmp_path / "new/c/0.txt").write_text("0 0 0 0 0 0 0 1\n")
    (tmp_path / "lonely").mkdir()
    (tmp_path / "lonely/gt.txt").write_text("0 0 0 0 0 0 0 1\n")
    code, out, err = run(*patterns, "--json", "--jobs", 1)
    assert code == 1
    lines = err.splitlines()
    assert lines[:3] == [
        "alignscores: error: sequence lonely: no system has a run on it; left out",
        "alignscores: error: sequence new: has no reference; left out",
        "alignscores: error: system c: has no run on a sequence with a reference; left out",
    ]
    assert lines[3].startswith("alignscores: error: car/a/0.txt: ")
    assert lines[4].startswith("alignscores: error: car/b/1.txt")
    assert lines[5] == ("alignscores: error: a: has no run 1 on helix; it counts as a failure")
    assert len(lines) == 6
    status = [entry["status"] for entry in json.loads(out)["results"]]
    assert (status.count("scored"), status.count("failed"), status.count("missing")) == (5, 2, 1)


def test_a_sequence_without_its_frames_is_left_out(benchmark_of, run, tmp_path):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0), "b": (0.3, 1.0, 1, 0.0)}, runs=2, n=40)
    np.savetxt(tmp_path / "car/rgb.txt", np.arange(40) / 10)
    code, out, err = run(*patterns, "--frames", "{sequence}/rgb.txt", "--json")
    assert code == 1
    assert err == (
        "alignscores: error: sequence helix: left out: helix/rgb.txt: cannot be read "
        "(No such file or directory)\n"
    )
    assert {entry["sequence"] for entry in json.loads(out)["results"]} == {"car"}


def test_infinite_errors_lose_and_have_no_difference(benchmark_of, compare, tmp_path):
    """A system whose every run is infinitely wrong is last; one with a failed run is not ahead."""
    systems = {
        "good": (0.05, 1.0, 1, 0.0),
        "poor": (0.3, 1.0, 1, 0.0),
        "lost": (0.05, 1.0, 1, 0.8),
        "once": (0.01, 1.0, 1, 0.0),
    }
    patterns = benchmark_of(systems, ["car"], runs=5, n=100)
    (tmp_path / "car/once/3.txt").write_text("")
    pairs = {
        frozenset((entry["a"], entry["b"])): entry
        for entry in compare(*patterns)["comparisons"]
        if (entry["sequence"], entry["metric"]) == ("car", "half_distance")
    }
    for a, b, better, known in (
        ("good", "poor", "good", True),
        ("good", "lost", "good", False),
        ("poor", "lost", "poor", False),
        ("poor", "once", None, False),  # four times better, and infinitely worse once
    ):
        entry = pairs[frozenset((a, b))]
        assert entry["better"] == better, (a, b)
        assert (entry["difference"] is not None) == known


def test_a_distance_that_no_run_is_given_is_no_failure(benchmark_of, compare, tmp_path):
    """Four cameras have none; nor has a run there that fails."""
    systems = {"a": (0.02, 1.0, 1, 0.0), "b": (0.1, 1.0, 1, 0.0)}
    patterns = benchmark_of(systems, ["car"], n=40)
    benchmark_of(systems, ["helix"], n=4)
    (tmp_path / "helix/a/1.txt").write_text("")
    found = compare(*patterns)
    entries = {(one["system"], one["sequence"]): one for one in found["systems"]}
    assert entries["a", "helix"]["half_distance"] is None
    assert entries["a", "helix"]["half_distance_rank_best"] is None
    for system in "ab":
        of_car = entries[system, "car"]["half_distance"]
        assert entries[system, None]["half_distance"] == of_car > 0
    assert entries["a", None]["failed_runs"] == 1
    assert entries["a", "helix"]["PAS"] == pytest.approx(
        2 / 3 * entries["a", "helix"]["PAS_scored"]
    )


def test_a_metric_without_a_value_is_told(benchmark_of, run):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.5)}, ["car"], runs=2, n=60)
    code, out, err = run(*patterns, "--metrics", "kitti", "--json", "--jobs", 1)
    assert code == 0
    assert [entry["metrics"] for entry in json.loads(out)["results"]] == [{"kitti": None}] * 2
    assert "note: car, a, run 0: no value of kitti: the KITTI errors need all poses" in err
    assert (
        "note: car, a, run 0: without a value, counted as failures: kitti (and alike for 1 more of "
        "a)\n"
    ) in err


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["tum", "*/{sequence}.txt", "{sequence}/{system}/*"], 1, "car/gt.txt, old/gt.txt: all"),
        (["tum", "car/gt.txt", "car/{system}{run}/0.txt"], 1, "in more than one way (system 'lon"),
        (["tum", "car/gt.txt", "car/{system}/0.txt", "--frames", "{run}.txt"], 1, "it may have {"),
        (["colmap", "car/gt.txt", "old/{system}", "--metrics", "rpe@1m"], 2, "rpe@1m needs camera"),
    ],
)
def test_wrong_usage(benchmark_of, run, arguments, code, reason):
    benchmark_of({"long": (0.1, 1.0, 1, 0.0)}, ["car"], runs=1, n=5)
    shutil.copytree("car", "old")
    found, out, err = run(*arguments)
    assert (found, out) == (code, "")
    assert reason in err.splitlines()[-1]


def test_names_of_metrics(benchmark_of, compare, run):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], runs=1, n=20)
    (entry,) = compare(*patterns, "--metrics", "tas,half,ate,AUC@30:vggt,half:rotation")["results"]
    assert list(entry["metrics"]) == ["ATE", "auc@30:vggt"]
    _, _, err = run(*patterns, "--metrics", "tas,half,half:rotation,half_angle")
    assert "note: half is an old name, which will go: write half_distance\n" in err
    assert "note: half:rotation is an old name, which will go: write half_angle\n" in err
    code, out, _ = run("--metrics", "help")
    assert code == 0
    assert "auc@K:{vggt," in out


def test_as_many_runs_are_missing_as_there_are_fewer(benchmark_of, run, tmp_path):
    """Whatever their names."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, runs=2, n=5)
    (tmp_path / "helix/a/1.txt").unlink()
    (tmp_path / "car/a/0.txt").rename(tmp_path / "car/a/9.txt")
    out = run(*patterns, "--dry-run")[1]
    assert "helix/gt.txt\n  a, run 0: helix/a/0.txt\n  a, run 1: missing\n2 seq" in out


IMAGES = """\
format: {format}
reference: "{{sequence}}/gt{ending}"
estimate: "{{sequence}}/{{system}}/0*"
systems: {{other: {{est_format: {other}}}}}
"""


@pytest.mark.parametrize(("format", "other"), [("colmap", "nerf"), ("nerf", "colmap")])
def test_images_are_scored_as_on_their_own(compare, examples, tmp_path, capsys, format, other):
    endings = {"colmap": "", "nerf": ".json"}

    def put(name, target):
        source = examples / name
        (tmp_path / target).parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if source.is_dir() else shutil.copy)(source, tmp_path / target)

    ending = endings[format]
    for sequence in ("desk", "room & co"):
        put(f"{format}/reference{ending}", f"{sequence}/gt{ending}")
        put(f"{format}/reference{ending}", f"{sequence}/perfect/0{ending}")
        put(f"{format}/estimate{ending}", f"{sequence}/noisy/0{ending}")
        put(f"{other}/estimate{endings[other]}", f"{sequence}/other/0{endings[other]}")
    if format == "colmap":
        put("colmap/estimate", "desk/parts/0/0")
        put("colmap/estimate", "desk/parts/0/1")
    text = IMAGES.format(format=format, ending=ending, other=other)
    (tmp_path / "b.yaml").write_text(text)
    results = compare("b.yaml")["results"]
    assert sum(entry["status"] == "scored" for entry in results) == (7 if format == "colmap" else 6)
    for entry in results:
        if entry["status"] == "scored":
            (estimate,) = (tmp_path / entry["sequence"] / entry["system"]).glob("0*")
            options = ["--registration", "refined", "--missing", "fail", "--json"]
            if entry["system"] == "other":
                options += ["--est_format", other]
            files = [str(tmp_path / entry["sequence"] / f"gt{ending}"), str(estimate)]
            assert main([format, *files, *options]) == 0
            (alone,) = json.loads(capsys.readouterr().out)["results"]
            scores = "TAS", "RAS", "PAS"
            assert [entry[name] for name in scores] == pytest.approx(
                [alone[name] for name in scores]
            )
            assert (entry["PAS"] == 1) == (entry["system"] == "perfect")


@pytest.mark.parametrize("start", ["", "./"])
def test_files_of_a_reference_that_is_a_folder_are_no_runs(run, examples, tmp_path, start):
    for name in ("gt", "orb/0"):
        shutil.copytree(examples / "colmap/reference", tmp_path / "desk" / name)
    patterns = f"{start}{{sequence}}/gt", f"{start}{{sequence}}/{{system}}/{{run}}"
    code, out, err = run("colmap", *patterns, "--dry-run")
    assert (code, err) == (0, "")
    assert [line.split(":")[0] for line in out.splitlines()[:-1]] == ["desk", "  orb, run 0"]
