"""Benchmarks that are described in a YAML file."""

import re

import pytest

from alignscores.comparison.benchmark import Run, from_patterns, read_yaml
from alignscores.comparison.comparison import find_benchmark

YAML = """\
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}/{run}.txt"
runs: 3
sequences:
  car: {name: Car & co, unit: 0.5, t_offset: 0.0}
systems:
  a_b: {name: <A>, runs: 4}
"""


def test_yaml(patterns, run, compare, tmp_path):
    (tmp_path / "b.yaml").write_text(YAML)
    results = compare("b.yaml")["results"]
    missing = [(entry["system"], entry["run"]) for entry in results if entry["status"] == "missing"]
    assert missing == [("a_b", "3"), ("c", "2"), ("a_b", "3")]
    (tmp_path / "named.yaml").write_text(YAML.replace("runs: 4", "runs: [0, 1, 7]"))
    results = compare("named.yaml")["results"]
    missing = [(entry["system"], entry["run"]) for entry in results if entry["status"] == "missing"]
    assert missing == [("a_b", "7"), ("c", "2"), ("a_b", "7")]
    (tmp_path / "once.yaml").write_text(YAML.replace("runs: 3", "runs: 1"))
    assert {entry["system"] for entry in compare("once.yaml")["results"]} == {"a_b", "c"}
    results = compare("b.yaml")["results"]
    units = {entry["unit"] for entry in results if entry["sequence"] == "car"}
    assert units == {0.5, None}
    assert "Car & co" in run("b.yaml")[1]


def test_runs_that_are_missing_have_the_first_numbers_that_are_free(tmp_path):
    for name in ("gt.txt", "a/x.txt", "a/2.txt"):
        (tmp_path / "s" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "s" / name).touch()
    (tmp_path / "b.yaml").write_text(YAML.partition("sequences")[0].replace("3", "4"))
    runs = find_benchmark(str(tmp_path / "b.yaml"), None, None, expect_all=False).runs
    assert [run.run for run in runs if run.file is None] == ["1", "3"]


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("format: tum", "format: sfm", "format must be one of tum, "),
        ("runs: 3", "runs: 0", "runs must be a positive whole number or a list of names"),
        ("runs: 3", "runs: 10001", "a list of names, at most 10000, not 10001"),
        ("runs: 3", "runs: [[1], 2]", "runs must be a positive whole number or a list of names"),
        (
            "runs: 3",
            "speed: 3",
            "b.yaml: unknown key 'speed'; known are format, reference, estimate, runs, sequences, "
            "systems\n",
        ),
        (
            "unit: 0.5",
            "speed: 4",
            "sequences: car: unknown key 'speed'; known are name, format, t_offset, frames, unit\n",
        ),
        (
            "runs: 4",
            "speed: 4",
            "systems: a_b: unknown key 'speed'; known are name, est_format, runs, invert\n",
        ),
        (
            "unit: 0.5",
            "unit: small",
            "car: unit must be a finite number above 0, not 'small'",
        ),
        ("runs: 3", "runs: [", "cannot be read: "),
        ("reference:", "# reference:", "needs reference, a text"),
    ],
)
def test_wrong_yaml(run, tmp_path, old, new, reason):
    (tmp_path / "b.yaml").write_text(YAML.replace(old, new))
    code, out, err = run("b.yaml")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "b.yaml" in err
    assert reason in err


def test_hostile_files_are_a_line_that_names_file_and_key(tmp_path):
    """Values of every kind in place of each: no traceback, no long message."""
    values = "[a]", "{a: 1}", "~", "-1", "[[1]]", "&a [x, *a]", "!!int x", "9" * 400
    values += f"[{'x,' * 100_000}x]", "[" * 30_000, "x" * 10_000, "2024-01-01"
    keys = "format", "reference", "estimate", "runs", "sequences", "systems"
    inner = ("sequences", "unit"), ("sequences", "frames"), ("systems", "runs")
    inner += (("systems", "est_format"),)
    lines = ["format: tum", "reference: '{sequence}/gt.txt'", "estimate: '{sequence}/{system}.txt'"]
    for value in values:
        files = {
            key: "\n".join(
                [*(line for line in lines if not line.startswith(key)), f"{key}: {value}"]
            )
            for key in keys
        }
        files |= {
            f"{kind}: s: {key}": "\n".join([*lines, f"{kind}: {{s: {{{key}: {value}}}}}"])
            for kind, key in inner
        }
        for where, text in files.items():
            (tmp_path / "b.yaml").write_text(text)
            with pytest.raises(ValueError, match=r"b\.yaml: ") as caught:
                find_benchmark(str(tmp_path / "b.yaml"), None, None, expect_all=False)
            message = str(caught.value)
            assert len(message) < 1000, (where, value[:40])
            assert "\n" not in message


def test_many_missing_runs_are_told_in_a_few_lines(patterns, run, tmp_path):
    (tmp_path / "b.yaml").write_text(YAML.replace("runs: 4", "runs: 300"))
    code, _, err = run("b.yaml")
    assert code == 1
    (more,) = re.findall(r"error: and (\d+) more of these; --json has all", err)
    assert int(more) == 2 * (300 - 3) + 1 - 50
    assert err.count("\n") < 70


@pytest.fixture
def files(tmp_path, monkeypatch):
    """(names) -> nothing; there are empty files of such names in this folder."""
    monkeypatch.chdir(tmp_path)

    def files(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()

    return files


PATTERNS = "tum", "{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"


def test_all_that_patterns_find(files):
    """In the order of sequence, system and run, the numbers in their names as such."""
    found = ["s10/a/2.txt", "s10/a/10.txt", "s9/b2/1.txt", "s9/b10/1.txt", "s9/a/x.txt"]
    found.append("s10/late/1.txt")
    files("s10/gt.txt", "s9/gt.txt", "left/gt.txt", *found, "lost/a/1.txt", "lost/c/1.txt")
    benchmark = from_patterns(*PATTERNS)
    assert benchmark.format == "tum"
    assert list(benchmark.references.items()) == [("s9", "s9/gt.txt"), ("s10", "s10/gt.txt")]
    assert benchmark.runs == [
        Run("s9", "a", "2", None),
        Run("s9", "a", "x", "s9/a/x.txt"),
        Run("s9", "b2", "1", "s9/b2/1.txt"),
        Run("s9", "b10", "1", "s9/b10/1.txt"),
        Run("s10", "a", "2", "s10/a/2.txt"),
        Run("s10", "a", "10", "s10/a/10.txt"),
        Run("s10", "late", "1", "s10/late/1.txt"),
    ]
    assert benchmark.problems == [
        "sequence left: no system has a run on it; left out",
        "sequence lost: has no reference; left out",
        "system c: has no run on a sequence with a reference; left out",
    ]
    references = ["left/gt.txt", "s10/gt.txt", "s9/gt.txt"]
    assert benchmark.files == [*references, *sorted([*found, "lost/a/1.txt", "lost/c/1.txt"])]


def test_expected_runs_are_a_number_or_names(files):
    files("s/gt.txt", "s/a/1.txt", "t/gt.txt", "t/a/1.txt", "t/b/x.txt")
    benchmark = from_patterns(*PATTERNS, expected={"": 2, "b": ["x", "y"]})
    assert [(run.sequence, run.system, run.run, run.file is None) for run in benchmark.runs] == [
        *(("s", "a", "1", False), ("s", "a", "2", True)),
        *(("s", "b", "x", True), ("s", "b", "y", True)),
        *(("t", "a", "1", False), ("t", "a", "2", True)),
        *(("t", "b", "x", False), ("t", "b", "y", True)),
    ]


def test_one_sequence_is_named_after_its_reference(files):
    files("gt.txt", "a.txt", "b.txt")
    benchmark = from_patterns("tum", "gt.txt", "{system}.txt")
    assert benchmark.references == {"gt": "gt.txt"}
    assert [(run.sequence, run.system, run.file) for run in benchmark.runs] == [
        ("gt", "a", "a.txt"),
        ("gt", "b", "b.txt"),
    ]
    assert len({run.run for run in benchmark.runs}) == 1


def test_of_several_files_of_a_run_none_is_taken(files):
    files("s/gt.txt", "s/x/a.txt", "s/y/a.txt", "s/y/b.txt")
    benchmark = from_patterns("tum", "{sequence}/gt.txt", "{sequence}/*/{system}.txt")
    assert [run.file for run in benchmark.runs] == ["s/y/b.txt"]
    (problem,) = benchmark.problems
    assert problem.startswith("s/x/a.txt, s/y/a.txt: all of them match s/a/")
    assert problem.endswith("; none of them is taken")
    files("s/c/gt.txt", "s/d/gt.txt", "t/c/gt.txt", "t/d/gt.txt")
    with pytest.raises(
        ValueError, match=r"; s/c/gt\.txt, s/d/gt\.txt: all of them match s; none of them is taken$"
    ):
        from_patterns("tum", "{sequence}/*/gt.txt", "{sequence}/{system}.txt")


@pytest.mark.parametrize(
    ("patterns", "message"),
    [
        (("gt.txt", "a.txt"), "the pattern of the estimates needs {system}: a.txt"),
        (
            ("{sequence}.txt", "{system}.txt"),
            "both patterns need {sequence}, or none of them: {sequence}.txt and {system}.txt",
        ),
        (
            ("gt.txt", "{sequence}/{system}.txt"),
            "both patterns need {sequence}, or none of them: gt.txt and {sequence}/{system}.txt",
        ),
        (
            ("{system}/gt.txt", "{system}.txt"),
            "the pattern {system}/gt.txt has a field {system}; it may have {sequence}",
        ),
        (("none.txt", "{system}.txt"), "no reference matches the pattern none.txt"),
        (("gt.txt", "{system}.csv"), "no estimate matches the pattern {system}.csv"),
    ],
)
def test_patterns_that_find_nothing(files, patterns, message):
    files("gt.txt", "a.txt")
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        from_patterns("tum", *patterns)


def test_what_a_yaml_file_sets(files, tmp_path):
    """Files of a YAML file are beside it, wherever the program is started."""
    files("in/s/gt.txt", "in/s/a.txt")
    text = """\
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}.txt"
sequences: {s: {frames: f.txt, t_offset: 0.5}}
systems: {a: {invert: true, name: A}}
"""
    (tmp_path / "in/b.yaml").write_text(text)
    found = read_yaml("in/b.yaml")
    assert found.sequence_options == {"s": {"frames": "in/f.txt", "t_offset": 0.5}}
    assert found.system_options == {"a": {"invert": True, "name": "A"}}
    assert found.references == {"s": "in/s/gt.txt"}
