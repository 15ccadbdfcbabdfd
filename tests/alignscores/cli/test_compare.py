"""What the command ``compare`` says of problems, and where it keeps results."""

import sys

import pytest

from alignscores.cli.compare import SHOWN, _print_problems


@pytest.mark.parametrize("n", [0, SHOWN, SHOWN + 1, SHOWN + 7])
def test_of_many_problems_the_first_are_shown(capsys, n):
    problems = [f"file {number}" for number in range(n)]
    _print_problems(problems)
    lines = [*problems[:50], *([f"and {n - 50} more of these; --json has all"] if n > 50 else [])]
    assert capsys.readouterr().err == "".join(f"alignscores: error: {line}\n" for line in lines)


def test_the_cache_is_private_and_a_folder_that_is_named_stays_open(run_compare, tmp_path):
    """Others may read what they were given to read."""
    for folder, options, mode in (
        ("cache/alignscores", (), 0o700),
        ("shared", ("--cache", "shared"), 0o755),
    ):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder).chmod(0o755)
        code, out, err = run_compare("--clear_cache", *options)
        place = tmp_path / folder if not options else folder
        note = f"alignscores: note: 0 results removed from {place}\n"
        assert (code, out, err) == (0, "", note)
        assert (tmp_path / folder).stat().st_mode & 0o777 == mode


def test_progress_is_shown_on_a_terminal(benchmark_of, run_compare, monkeypatch):
    """Each step replaces the last one, and at the end the line is empty."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], 2, n=10)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    code, _, err = run_compare(*patterns, "--jobs", 1, "--no_cache")
    steps = [
        f"{doing} {number}" for doing in ("looking at", "scoring") for number in ("1/2", "2/2")
    ]
    shown = [*steps[:2], "", *steps[2:], ""]
    assert (code, err) == (0, "".join(f"\r\x1b[K{text}" for text in shown))


def test_a_dry_run_tells_what_is_left_out(benchmark_of, run_compare, tmp_path):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, runs=1, n=5)
    (tmp_path / "helix/gt.txt").unlink()
    code, out, err = run_compare(*patterns, "--dry-run")
    found = "car: car/gt.txt\n  a, run 0: car/a/0.txt\n"
    assert (code, out) == (1, f"{found}1 sequences, 1 systems, 1 runs, 0 of them missing\n")
    (problem,) = err.splitlines()
    assert problem.startswith("alignscores: error: ")
    assert "helix" in problem
