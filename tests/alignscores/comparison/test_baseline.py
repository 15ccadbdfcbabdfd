"""A comparison against a saved one, and conditions on which a build fails, by the command."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from alignscores.comparison.baseline import changes
from alignscores.comparison.benchmark import Run
from alignscores.comparison.runs import COLUMNS, Outcome
from alignscores.comparison.summary import summarise
from alignscores.trajectories.formats import FORMATS

SYSTEMS = {"orb": (0.1, 1.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}
WORSE = {"orb": (0.3, 3.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}


@pytest.fixture
def gate(run_compare, benchmark_of, tmp_path):
    """(what is done to the files in between, options, runs=, systems=) -> code, output, errors."""

    def gate(change, *options, fail_on="worse", runs=3, systems=SYSTEMS, first=()):
        patterns = benchmark_of(systems, n=60, runs=runs)
        common = *patterns, "--jobs", 1
        (tmp_path / "saved.json").write_text(run_compare(*common, "--json", *first)[1])
        change()
        gate = ("--fail_on", fail_on) if fail_on else ()
        return run_compare(*common, "--baseline", "saved.json", *gate, *options)

    return gate


@pytest.fixture
def worsen(benchmark_of):
    """(runs) -> what makes the runs of orb worse."""
    return lambda runs: lambda: benchmark_of(WORSE, n=60, runs=runs)


def test_a_system_that_is_better_does_not_fail(gate, benchmark_of):
    code, out, _ = gate(lambda: benchmark_of(SYSTEMS, n=60), "--json", systems=WORSE)
    assert code == 0
    found = {entry["system"]: entry for entry in json.loads(out)["baseline"]["systems"]}
    orb = found["orb"]
    assert (orb["change"], orb["wins"], found["dso"]["change"]) == ("better", 1, None)
    assert 0 < orb["low"] < orb["difference"] < orb["high"]
    assert orb["difference"] == pytest.approx(orb["now"] - orb["saved"])


def test_one_run_says_that_it_cannot_fail(gate, worsen):
    code, out, err = gate(worsen(1), runs=1)
    assert code == 0
    assert "note: too few runs for a significant change: --fail_on worse cannot fail\n" in err
    assert out.count("too few runs") == 2


@pytest.mark.parametrize(
    ("fail_on", "reasons"),
    [
        ("PAS drops 0.05", ["orb: PAS"]),
        ("PAS drops 0.5", []),
        ("half rises 0.01, PAS<0.7", ["orb: half_distance", "orb: PAS"]),
        ("PAS<0.1,half>10,lost>5%,failed>0", []),
        ("TAS < 0.9", ["orb: TAS", "dso: TAS"]),
    ],
)
def test_values_and_drops_fail_with_one_run(gate, worsen, fail_on, reasons):
    code, _, err = gate(worsen(1), runs=1, fail_on=fail_on)
    assert code == (3 if reasons else 0)
    found = [line.removeprefix("alignscores: error: ") for line in err.splitlines()]
    assert sorted(" ".join(line.split()[:2]) for line in found) == sorted(reasons)


def test_a_value_needs_no_baseline(patterns, run):
    assert run(*patterns, "--fail_on", "PAS<0.1")[0] == 1  # a run is missing
    code, _, err = run(*patterns, "--fail_on", "failed>0, half>10")
    assert code == 3
    assert err.splitlines()[-2:] == [
        "alignscores: error: c: failed 0.1667 > 0",
        "alignscores: error: c: half_distance ∞ > 10",
    ]
    name = "recall@5cm,5deg:hloc"  # with a comma
    code, _, err = run(*patterns, "--metrics", name, "--fail_on", f"{name}<101,PAS<0.1")
    assert (code, err.count("5deg:hloc 0.0000 < 101")) == (3, 2)


@pytest.mark.parametrize(
    ("fail_on", "message"),
    [
        ("worse", "worse: needs --baseline FILE"),
        ("better", "'better' must be worse, or like PAS<0.8, half>0.1, lost>5%, PAS drops 0.05"),
        ("PAS<much", "'PAS<much' must be worse, or like PAS<0.8"),
        ("ate:rmse>1", "'ate:rmse>1': ate:rmse must be one of TAS, RAS, PAS"),
    ],
)
def test_wrong_conditions(patterns, run, fail_on, message):
    code, out, err = run(*patterns, "--fail_on", fail_on)
    assert (code, out) == (2, "")
    assert f"argument --fail_on: {message}" in err


def test_runs_that_fail_or_are_gone_fail_the_build(gate, tmp_path):
    def fail():
        for file in tmp_path.glob("*/orb/*.txt"):
            file.write_text("nothing")
        shutil.rmtree(tmp_path / "car/dso")

    code, _, err = gate(fail)
    assert code == 3
    assert "orb: PAS 0.8" in err
    assert " to 0.0000, worse (p = " in err
    assert "alignscores: error: dso on car: has no run, but had one\n" in err


def test_what_is_new_or_gone_is_named(gate, tmp_path):
    def change():
        shutil.move(tmp_path / "car/dso", tmp_path / "car/lsd")
        shutil.rmtree(tmp_path / "helix")

    code, out, _ = gate(change, fail_on=None)
    assert code == 0
    assert out.splitlines()[-2:] == [
        "new: lsd on car",
        "gone: dso on car, dso on helix, orb on helix",
    ]


def test_a_sequence_with_another_reference_is_left_out(gate, tmp_path):
    def change():
        poses = np.loadtxt(tmp_path / "car/gt.txt")
        poses[:, 1:4] *= 2
        np.savetxt(tmp_path / "car/gt.txt", poses)

    code, out, _ = gate(change)
    assert code == 0
    assert out.splitlines()[-1].startswith("left out: sequence car, whose d was ")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("nonsense", "is not what `alignscores compare --json` prints"),
        ('{"results": [{"system": "orb"}]}', "is not what `alignscores compare --json` prints"),
        ('{"results": 7}', "is not what `alignscores compare --json` prints"),
        (None, "cannot be read (No such file or directory)"),
    ],
)
def test_a_broken_file(patterns, run, tmp_path, content, reason):
    if content:
        (tmp_path / "saved.json").write_text(content)
    code, out, err = run(*patterns, "--baseline", "saved.json")
    assert (code, out, err) == (1, "", f"alignscores: error: saved.json: {reason}\n")


def test_other_settings_do_not_compare(gate):
    code, out, err = gate(lambda: None, "--registration", "pcr99")
    assert (code, out) == (1, "")
    assert 'saved.json: has registration "refined", not "pcr99": nothing compares' in err


def test_equal_runs_seldom_fail():
    """Gates of two systems with five runs each on two sequences; of 1000, 43 fail."""
    rng = np.random.default_rng(0)
    runs = [Run(s, system, str(k), "file") for s in "st" for system in "ab" for k in range(5)]

    def drawn():
        scores = rng.standard_t(2.5, len(runs))
        outcomes = [Outcome(dict.fromkeys(COLUMNS, score), n=10, unit=1.0) for score in scores]
        return summarise(list(zip(runs, outcomes, strict=True)), [], FORMATS["tum"])

    failed = 0
    for _ in range(200):
        now, saved = drawn(), drawn()
        found = changes(now, "saved.json", saved.results, "PAS")
        failed += any(one.change == "worse" for one in found.systems)
    assert failed <= 12


def test_the_action_on_the_page(worsen, benchmark_of, run_compare, tmp_path):
    """Green where nothing changed, red where a system is worse, with a summary of both."""
    root = Path(__file__).parents[3]
    page = (root / "docs/how-to/compare.md").read_text()
    job = yaml.safe_load(re.search(r"# accuracy.yml\n(.*?)```", page, re.DOTALL)[1])
    (inputs,) = (step["with"] for step in job["jobs"]["accuracy"]["steps"] if "with" in step)
    patterns = benchmark_of(SYSTEMS, n=60)  # elsewhere than those on the page
    inputs |= dict(zip(("format", "reference", "estimates"), patterns, strict=True))
    (tmp_path / "saved.json").write_text(run_compare(*patterns, "--json")[1])
    action = yaml.safe_load((root / "action.yml").read_text())
    _, step = action["runs"]["steps"]  # the first installs
    (tmp_path / "alignscores").mkdir()
    (tmp_path / "alignscores/bin").symlink_to(Path(sys.executable).parent)

    def ended():
        summary = tmp_path / "summary.md"
        environment = {"GITHUB_STEP_SUMMARY": str(summary), "RUNNER_TEMP": str(tmp_path)}
        for name, value in step["env"].items():
            key = re.fullmatch(r"\$\{\{ inputs\.(\w+) \}\}", value)[1]
            environment[name] = inputs.get(key, action["inputs"][key].get("default"))
        shell = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
        done = subprocess.run(
            shell, cwd=tmp_path, env=os.environ | environment, capture_output=True, text=True
        )
        return done.returncode, done.stderr, summary.read_text()

    code, err, summary = ended()
    assert (code, err, summary.count("not significant (p = ")) == (0, "", 2)
    worsen(3)()
    code, err, summary = ended()
    assert (code, err.count("error: orb: PAS 0.8"), err.count(", worse (p = 0.005")) == (3, 2, 1)
    assert summary.startswith("**Fails:** orb: PAS 0.8")
    assert "| orb | 0.8" in summary


WRONG = None, True, -1, "x", [], {}, [1], {"a": 1}, "\ud800", 1e999


@pytest.mark.parametrize("name", ["sequence", "system", "run", "file", "error", "unit", "PAS"])
def test_a_value_of_another_type_is_one_sentence(patterns, run, tmp_path, name):
    saved = json.loads(run(*patterns, "--json")[1])
    for value in WRONG:
        saved["results"][0][name] = value
        (tmp_path / "saved.json").write_text(json.dumps(saved))
        code, out, err = run(*patterns, "--baseline", "saved.json", "--cache", "cache")
        assert code == 1
        assert "Traceback" not in err
        assert out.startswith("a_b is ahead of c") or err.count("\n") == 1
