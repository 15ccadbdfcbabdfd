"""Arguments of the command ``compare``, and its messages on problems."""

import sys


def test_progress_is_shown_on_a_terminal(benchmark_of, run_compare, monkeypatch):
    """Each step replaces the last one, and at the end the line is empty."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], 2, n=10)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    code, _, err = run_compare(*patterns, "--jobs", 1)
    assert code == 0
    shown, _, notes = err.rpartition("\r\x1b[K")
    assert shown.endswith("\r\x1b[Kscoring 1/2\r\x1b[Kscoring 2/2")
    assert all(line.startswith("alignscores: note: ") for line in notes.splitlines())


def test_a_dry_run_shows_what_is_found_and_what_is_left_out(benchmark_of, run_compare, tmp_path):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ("car", "cube", "helix"), runs=2, n=5)
    (tmp_path / "helix/gt.txt").unlink()
    (tmp_path / "cube/a/1.txt").unlink()
    code, out, err = run_compare(*patterns, "--dry-run")
    assert code == 1
    assert "car: car/gt.txt\n  a, run 0: car/a/0.txt\n  a, run 1: car/a/1.txt\n" in out
    assert "\n  a, run 1: missing\n" in out
    assert out.endswith("2 sequences, 1 systems, 4 runs, 1 of them missing\n")
    assert err == "alignscores: error: sequence helix: has no reference; left out\n"


def test_the_format_is_recognised(benchmark_of, run_compare):
    format_name, *patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], 1, n=20)
    assert run_compare(*patterns, "--jobs", 1) == run_compare(format_name, *patterns, "--jobs", 1)
