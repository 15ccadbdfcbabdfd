"""The benchmarks run."""

from pathlib import Path

import pytest

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
