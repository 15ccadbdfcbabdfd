"""One bad estimate never loses the results of the others."""

import json

import pytest

from alignscores.cli import command as cli
from alignscores.comparison import comparison, runs

FAILURES = [
    (MemoryError(), "there is not enough memory for it"),
    (RecursionError("maximum recursion depth"), "maximum recursion depth"),
    (OverflowError("int too large"), "int too large"),
    (FloatingPointError(), "FloatingPointError"),
    (OSError(5, "Input/output error"), "Input/output error"),
]


@pytest.fixture
def failing(monkeypatch):
    """(module, name, error) -> let a function of a module fail for files named 0.txt."""

    def failing(module, name, error):
        work = getattr(module, name)

        def fail(*arguments, **options):
            if any("0.txt" in str(argument) for argument in arguments):
                raise error
            return work(*arguments, **options)

        monkeypatch.setattr(module, name, fail)

    return failing


@pytest.mark.parametrize(("error", "reason"), FAILURES)
def test_one_run_fails(failing, patterns, run, error, reason):
    failing(runs, "score", error)
    code, out, err = run(*patterns, "--jobs", 1, "--json")
    results = json.loads(out)["results"]
    failed = {(entry["run"], entry["lost"]) for entry in results if entry["status"] == "failed"}
    assert (code, failed) == (1, {("0", 1.0)})
    assert sum(entry["PAS"] is not None for entry in results) >= 7
    assert f"0.txt: {reason}" in err or reason in err


@pytest.mark.parametrize(("error", "reason"), FAILURES)
def test_one_estimate_fails(failing, patterns, command, tmp_path, error, reason):
    failing(cli, "score", error)
    files = [f"{tmp_path}/car/{name}" for name in ("gt.txt", "a_b/0.txt", "a_b/1.txt")]
    code, out, err = command("tum", *files, "--json")
    found = json.loads(out)
    assert (code, len(found["results"]), len(found["failed"])) == (1, 1, 1)
    assert reason in found["failed"][0]["error"]
    assert err.count("error: ") == 1


def test_a_reference_fails(patterns, run, monkeypatch):
    read = comparison.reference_of

    def fail(path, *others):
        if "car" in path:
            raise MemoryError
        return read(path, *others)

    monkeypatch.setattr(comparison, "reference_of", fail)
    code, out, err = run(*patterns, "--jobs", 1)
    assert code == 1
    assert "sequence car: left out: there is not enough memory for it" in err
    assert "helix" in out


def test_files_that_are_too_large_are_failures(patterns, run, tmp_path, monkeypatch):
    monkeypatch.setenv("ALIGNSCORES_MAX_MB", "0.02")
    (tmp_path / "car/a_b/0.txt").write_bytes(b"0" * 10**5)
    code, out, err = run(*patterns, "--jobs", 1)
    assert (code, err.count("0.txt: has more than 20000 bytes")) == (1, 1)
    assert "a_b" in out
