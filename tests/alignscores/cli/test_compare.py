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


def test_progress_is_shown_on_a_terminal(benchmark_of, run_compare, monkeypatch):
    """Each step replaces the last one, and at the end the line is empty."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], 2, n=10)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    code, _, err = run_compare(*patterns, "--jobs", 1)
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


@pytest.mark.parametrize("jobs", ["0", "-1", "1.5", "all"])
def test_jobs_are_a_number_of_processes(run_compare, jobs):
    code, out, err = run_compare("b.yaml", f"--jobs={jobs}")
    message = f"must be a whole number of at least 1, not {jobs!r}; see alignscores compare --help"
    assert (code, out) == (2, "")
    assert err == f"alignscores compare: error: argument --jobs: {message}\n"


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--html", "page.txt"], "argument --html: page.txt does not end in .html"),
        (["--html", "no/page.html"], "argument --html: no/page.html: there is no folder no"),
        (["--fail_on", "worse"], "argument --fail_on: needs --baseline FILE"),
        (["--fail_on", "better"], "argument --fail_on: invalid choice: 'better' (choose from"),
        (
            ["--by", "ate", "--metrics", "auc@30:vggt,auc@30:vggt"],
            "argument --by: must be one of TAS, RAS, PAS, half_distance, half_angle, auc@30:vggt, "
            "not 'ate'",
        ),
    ],
)
def test_options_that_cannot_be_are_told_with_the_usage(
    benchmark_of, run_compare, options, problem
):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], 1, n=5)
    code, out, err = run_compare(*patterns, *options)
    assert (code, out) == (2, "")
    assert err.startswith(f"alignscores compare: error: {problem}")
    assert err.endswith("; see alignscores compare --help\n")


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["tum"],
        ["tum", "{sequence}"],
        ["tum", "a", "b", "c"],
        ["b.yaml", "a"],
        ["b.yml", "a", "b"],
        ["b.txt"],
    ],
)
def test_a_format_with_two_patterns_or_a_yaml_file(run_compare, arguments):
    code, out, err = run_compare(*arguments)
    formats = "tum, kitti, euroc, colmap, vslamlab, arrays, bag, nerf"
    usage = f"give one of {formats} and two patterns, or one YAML file"
    message = f"alignscores compare: error: {usage}; see alignscores compare --help\n"
    assert (code, out, err) == (2, "", message)


@pytest.mark.parametrize("name", ["b.yaml", "b.yml"])
def test_a_yaml_file_may_have_either_ending(run_compare, name):
    code, out, err = run_compare(name)
    message = f"{name}: cannot be read: No such file or directory"
    assert (code, out, err) == (1, "", f"alignscores: error: {message}\n")


def test_metrics_of_the_tables_have_short_names(benchmark_of, run_compare):
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0)}, ["car"], 1, n=20)
    code, out, _ = run_compare(*patterns, "--by", "half", "--jobs", 1)
    assert code == 0
    assert out == run_compare(*patterns, "--by", "half_distance", "--jobs", 1)[1]
