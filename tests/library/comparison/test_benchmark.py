"""Benchmarks: files that match patterns, and that a YAML file names."""

import pytest

from alignscores.comparison.benchmark import Run, from_patterns, read_yaml

YAML = """\
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}/{run}.txt"
runs: 3
sequences:
  car: {unit: 0.5, t_offset: 0.0}
systems:
  a_b: {runs: 4}
"""
PATTERNS = "tum", "{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"


@pytest.fixture
def files(tmp_path, monkeypatch):
    """(names) -> nothing; there are empty files of such names in this folder."""
    monkeypatch.chdir(tmp_path)

    def files(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()

    return files


def test_runs_and_options_in_a_yaml_file(patterns, compare, run, tmp_path):
    (tmp_path / "b.yaml").write_text(YAML)
    assert run("b.yaml")[1].startswith("a_b and c are not distinguishable: ")
    results = compare("b.yaml")["runs"]
    missing = [(r["system"], r["run"]) for r in results if r["status"] == "missing"]
    assert missing == [("a_b", "3"), ("c", "2"), ("a_b", "3")]
    assert {r["unit"] for r in results if r["sequence"] == "car"} == {0.5, None}


def test_paths_are_relative_to_the_yaml_file(files, tmp_path):
    files("in/s/gt.txt", "in/s/a/1.txt")
    options = "sequences: {s: {frames: f.txt, t_offset: 0.5}}\nsystems: {a: {invert: true}}\n"
    (tmp_path / "in/b.yaml").write_text(YAML.partition("runs")[0] + options)
    benchmark = read_yaml("in/b.yaml")
    assert benchmark.sequence_options == {"s": {"frames": "in/f.txt", "t_offset": 0.5}}
    assert benchmark.system_options == {"a": {"invert": True}}
    assert benchmark.references == {"s": "in/s/gt.txt"}


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("format: tum", "format: sfm", "format must be one of tum, "),
        ("runs: 3", "runs: 0", "runs must be a positive whole number, not 0"),
        ("runs: 3", "speed: 3", "b.yaml: unknown key 'speed'; use format, reference, est"),
        ("unit: 0.5", "speed: 4", "sequences: car: unknown key 'speed'; use format"),
        ("unit: 0.5", "unit: small", "car: unit must be a finite number above 0, not 'small'"),
        ("runs: 3", "runs: [", "cannot be read: "),
        ("reference:", "# reference:", "needs reference, a text"),
        (
            "unit: 0.5, t_offset: 0.0}\nsystems:\n  a_b: {",
            "frames: f.txt}\nsystems:\n  a_b: {t_offset: auto, ",
            "b.yaml: car, a_b: frames need t_offset in seconds: auto would",
        ),
        ("{system}/", "{name}/", "b.yaml: the pattern {sequence}/{name}/{run}.txt has a field {na"),
    ],
)
def test_wrong_yaml(run, tmp_path, old, new, reason):
    (tmp_path / "b.yaml").write_text(YAML.replace(old, new))
    code, out, err = run("b.yaml")
    assert (code, out, err.count("\n")) == (1 if "cannot be read" in reason else 2, "", 1)
    assert "b.yaml" in err
    assert reason in err


def test_all_that_patterns_find(files):
    """In the order of sequence, system and run, the numbers in their names as such."""
    files("s10/gt.txt", "s9/gt.txt", "left/gt.txt", "lost/a/1.txt", "lost/c/1.txt")
    files("s10/a/2.txt", "s10/a/10.txt", "s9/b10/1.txt", "s9/b2/1.txt", "s9/a/x.txt")
    benchmark = from_patterns(*PATTERNS)
    assert benchmark.references == {"s9": "s9/gt.txt", "s10": "s10/gt.txt"}
    assert benchmark.runs == [
        Run("s9", "a", "2", None),  # it has two runs on the other sequence
        Run("s9", "a", "x", "s9/a/x.txt"),
        Run("s9", "b2", "1", "s9/b2/1.txt"),
        Run("s9", "b10", "1", "s9/b10/1.txt"),
        Run("s10", "a", "2", "s10/a/2.txt"),
        Run("s10", "a", "10", "s10/a/10.txt"),
    ]
    assert benchmark.problems == [
        "sequence left: no system has a run on it; left out",
        "sequence lost: has no reference; left out",
        "system c: has no run on a sequence with a reference; left out",
    ]


def test_of_several_files_of_a_run_none_is_taken(files):
    files("s/gt.txt", "s/x/a.txt", "s/y/a.txt", "s/y/b.txt")
    benchmark = from_patterns("tum", "{sequence}/gt.txt", "{sequence}/*/{system}.txt")
    assert [run.file for run in benchmark.runs] == ["s/y/b.txt"]
    (problem,) = benchmark.problems
    assert problem.startswith("s/x/a.txt, s/y/a.txt: all of them match s/a/")
