"""`compare` from Python: patterns or a YAML file, and what its result tells."""

import numpy as np
import pytest

from alignscores import compare, evaluate


@pytest.fixture
def comparison(patterns, tmp_path, monkeypatch):
    """The comparison of two systems; the second lacks a run."""
    monkeypatch.chdir(tmp_path)
    return compare(*patterns[1:], format=patterns[0], metrics="ate:rmse")


def test_files_and_systems_are_compared_without_patterns(comparison, tmp_path):
    """On one sequence, whose format is recognised; their runs are those of the patterns."""
    runs = {name: [f"car/{name}/{k}.txt" for k in range(3)] for name in ("a_b", "c")}
    scores = comparison.runs.loc[comparison.runs["sequence"] == "car", "PAS"].tolist()
    again = compare("car/gt.txt", runs, metrics="ate:rmse")
    assert again.runs["PAS"].tolist()[:3] == scores[:3]
    files = compare(tmp_path / "car/gt.txt", [*runs["a_b"][:2], "car/none.txt"])
    assert set(files.runs["system"]) == {"0.txt", "1.txt", "none.txt"}
    assert repr(files) == ("Comparison(systems=3, sequences=1, runs=3, failed=1, by='PAS')")


def test_it_shows_itself_in_a_notebook(in_notebook, comparison):
    shown = in_notebook(comparison)
    assert shown.startswith("<p>a_b is ahead of c: it wins 100 % ")
    assert f"<td>{comparison.overall['PAS'].iloc[0]:.4g}</td>" in shown


RUNS = "{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"


@pytest.mark.parametrize(
    ("patterns_of", "settings", "message"),
    [
        (["car/gt.txt", []], {}, "there are no estimates to compare"),
        (RUNS[:1], {"format": "tum"}, "give a pattern of estimates, too, or one YAML"),
        (["x.txt", "{system}.txt"], {"format": "tum"}, "no reference matches the pattern x.txt"),
        (["car/gt.txt", "{system}.csv"], {"format": "tum"}, "no estimate matches the pattern {sys"),
        (["car/gt.txt", "a.txt"], {"format": "tum"}, "the pattern of the estimates needs {system}"),
        (["car/gt.txt", RUNS[1]], {"format": "tum"}, "both patterns need {sequence}, or none"),
        (RUNS, {"format": "tum", "frames": np.arange(3)}, "frames must be a file, or a pattern"),
        (["none.yaml"], {}, "none.yaml: cannot be read (No such file or directory)"),
        (RUNS, {"format": "tum", "weight": 2}, "weight must be a finite number from"),
    ],
)
def test_what_is_wrong_is_a_value_error(
    patterns, tmp_path, monkeypatch, patterns_of, settings, message
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        compare(*patterns_of, **settings)
    assert message in str(caught.value)


def test_its_tables_agree_and_are_compared_by_another_metric(comparison):
    """And the same by another metric, from the table of runs."""
    assert len(comparison.summary) == 2 * 3
    overall = comparison.overall.set_index("system")
    entries = {e["system"]: e for e in comparison.to_dict()["summary"] if e["sequence"] is None}
    assert overall["PAS"].to_dict() == {name: entry["PAS"] for name, entry in entries.items()}
    assert {"TAS", "RAS_sd", "half_distance", "ate:rmse", "runs"} <= set(comparison.summary)
    again = compare(comparison.runs, by="ate:rmse")
    assert again.pairs["better"].iloc[0] == "a_b"
    assert compare(comparison.runs).verdict == comparison.verdict


def test_a_gap_of_the_reference_is_longer_than_two_expected_frames(tmp_path):
    """As in `evaluate`: with a frame in ten seconds a hole of eight is none."""
    stamps = np.arange(0, 60, 0.1)
    stamps = stamps[(stamps < 20) | (stamps > 28)]
    positions = np.column_stack([np.cos(stamps), np.sin(stamps), np.cos(2 * stamps)])
    table = np.column_stack([stamps, positions, np.tile([0, 0, 0, 1], (len(stamps), 1))])
    file = tmp_path / "reference.txt"
    np.savetxt(file, table)
    for rate, noted in ((10, True), (0.1, False)):
        settings = {"rate": rate, "unit": 1}
        evaluated = [str(note) for note in evaluate(file, file, **settings).notes]
        assert any("the reference has no pose" in note for note in evaluated) == noted
        compared = compare(file, [file], **settings).notes
        assert any("the reference has no pose" in note for note in compared) == noted
