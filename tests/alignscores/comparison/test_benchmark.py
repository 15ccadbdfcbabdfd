"""Benchmarks that are described in a YAML file."""

import re

import pytest

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
    values = "[a]", "{a: 1}", "~", "true", "1e7", "1.5", "-1", "[]", "[[1]]", "&a [x, *a]", "'\\0'"
    values += "!!int x", "9" * 400, f"[{'x,' * 100_000}x]", "[" * 30_000, "x" * 10_000, "2024-01-01"
    keys = "format", "reference", "estimate", "runs", "sequences", "systems"
    inner = (
        ("sequences", "name"),
        ("sequences", "unit"),
        ("sequences", "frames"),
        ("systems", "runs"),
    )
    inner += ("systems", "est_format"), ("systems", "invert")
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


@pytest.mark.parametrize("runs", ["10001", "1e5", "1.0e+7", "[[1], 2]", "true"])
def test_numbers_of_runs_are_bounded(run, tmp_path, runs):
    (tmp_path / "b.yaml").write_text(YAML.replace("runs: 3", f"runs: {runs}"))
    code, _, err = run("b.yaml")
    assert code == 1
    assert "b.yaml: runs must be a positive whole number or a list of names, at most 10000" in err


def test_many_missing_runs_are_told_in_a_few_lines(patterns, run, tmp_path):
    (tmp_path / "b.yaml").write_text(YAML.replace("runs: 4", "runs: 300"))
    code, _, err = run("b.yaml")
    assert code == 1
    (more,) = re.findall(r"error: and (\d+) more of these; --json has all", err)
    assert int(more) == 2 * (300 - 3) + 1 - 50
    assert err.count("\n") < 70
