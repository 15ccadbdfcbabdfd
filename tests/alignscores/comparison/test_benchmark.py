"""Benchmarks that are described in a YAML file."""

import pytest

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
    results = compare("b.yaml")["results"]
    units = {entry["unit"] for entry in results if entry["sequence"] == "car"}
    assert units == {0.5, None}
    assert "Car & co" in run("b.yaml")[1]


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("format: tum", "format: sfm", "format must be one of tum, "),
        ("runs: 3", "runs: 0", "runs must be a positive whole number or a list of names"),
        ("runs: 4", "speed: 4", "systems: a_b: unknown key 'speed'; known are name, "),
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
