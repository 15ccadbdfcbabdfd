"""The benchmarks run."""

from pathlib import Path

import pandas as pd
import pytest

from benchmarks import hints
from benchmarks.__main__ import main


def test_every_contender_has_a_time_in_every_column(capsys):
    assert main(["--largest", "10", "--scenes", "2", "--turns", "1"]) == 0
    head, *rows = (line.split(" | ") for line in capsys.readouterr().out.splitlines())
    assert head == ["milliseconds", "10", "2 x 20"]
    assert {"TAS", "RAS", "pycolmap, robust", "C loop"} < {name for name, *_ in rows}
    assert all(float(time) > 0 for _, *times in rows for time in times)


def test_another_version_stands_in_brackets(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("benchmarks.__main__.RUNS", 1)
    folder = Path(__file__).parents[3]  # the same one
    assert main(["--largest=10", "--scenes=2", "--turns=1", f"--against={folder}"]) == 0
    head, first, *_ = capsys.readouterr().out.splitlines()
    assert head == "milliseconds | 10 | 2 x 20"
    times = [cell.strip("()").split(" (") for cell in first.split(" | ")[1:]]
    assert all(float(time) > 0 for pair in times for time in pair)
    with pytest.raises(SystemExit):
        main([f"--against={tmp_path}"])
    assert f"{tmp_path} is not a checkout" in capsys.readouterr().err


def test_transposed_rotations_are_named_beside_a_longer_path_of_both_inverses():
    """Of a hand-held camera, whose inverse positions fit better than its positions."""
    judged = hints.judge(5, 91, "rotations inverted", [])
    assert judged.verdict == "right"
    assert "rotations of estimate.txt seem to be world-to-camera" in judged.hints


def test_hints_are_counted_for_each_mistake(capsys, tmp_path):
    output = tmp_path / "pairs.csv"
    arguments = ["--pairs=2", "--seed=1", "--mistakes", "inverted", "--n_jobs=1"]
    arguments.append(f"--output={output}")
    assert hints.main(arguments) == 0
    head, _, *rows = (line.split() for line in capsys.readouterr().out.splitlines())
    assert head == ["pairs", "costly", "named", "silent", "wrong"]
    assert sorted(rows) == [
        ["inverted", "2", "2", "2", "0", "0"],
        ["none", "2", "0", "0", "0", "0"],
    ]
    pairs = pd.read_csv(output)
    assert (pairs.hints.str.contains("world-to-camera") == (pairs.mistake == "inverted")).all()
