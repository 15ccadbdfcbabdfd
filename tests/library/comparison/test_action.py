"""The GitHub action: its last step is run in a shell, as GitHub runs it."""

import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

ROOT = Path(__file__).parents[3]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text())
SYSTEMS = {"orb": (0.1, 1.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}
WORSE = {"orb": (0.3, 3.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}


@pytest.fixture
def act(tmp_path):
    """(inputs) -> what the last step of the action ended with; those before install."""
    step = ACTION["runs"]["steps"][-1]
    (tmp_path / "alignscores/bin").mkdir(parents=True)
    for program in ("python", "alignscores"):
        (tmp_path / "alignscores/bin" / program).symlink_to(Path(sys.executable).parent / program)

    def act(**inputs):
        summary = tmp_path / "summary.md"
        environment = {"GITHUB_STEP_SUMMARY": str(summary), "RUNNER_TEMP": str(tmp_path)}
        for name, value in step["env"].items():
            key = re.fullmatch(r"\$\{\{ inputs\.(\w+) \}\}", value)[1]
            environment[name] = inputs.get(key, ACTION["inputs"][key].get("default"))
        shell = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
        done = subprocess.run(
            shell, cwd=tmp_path, env=os.environ | environment, capture_output=True, text=True
        )
        written = summary.read_text() if summary.exists() else ""
        return SimpleNamespace(
            code=done.returncode, out=done.stdout, err=done.stderr, summary=written
        )

    return act


def test_the_action_on_the_page(act, benchmark_of, run_compare, tmp_path):
    """Green where nothing changed, red where a system is worse, with a summary of both."""
    page = (ROOT / "docs/how-to/compare.md").read_text()
    job = yaml.safe_load(re.search(r"# accuracy.yml\n(.*?)```", page, re.DOTALL)[1])
    (inputs,) = (
        step["with"]
        for step in job["jobs"]["accuracy"]["steps"]
        if step.get("uses") == "./alignscores"
    )
    patterns = benchmark_of(SYSTEMS, n=60)  # elsewhere than those on the page
    inputs |= dict(zip(("format", "reference", "estimates"), patterns, strict=True))
    (tmp_path / "saved.csv").write_text(run_compare(*patterns, "--csv")[1])
    ended = act(**inputs)
    passed = f"alignscores: note: passed: {inputs['fail_on']}\n"
    assert (ended.code, ended.err, ended.summary.count("not significant (adjusted p = ")) == (
        0,
        passed,
        2,
    )
    benchmark_of(WORSE, n=60, runs=3)
    ended = act(**inputs)
    assert ended.code == 3
    assert ended.err.count("error: orb: PAS 0.8") == 2
    assert ended.err.count(", worse (adjusted p = 0.005") == 1
    assert ended.summary.startswith("**Fails:** orb: PAS 0.8")
    assert re.search(r"\| orb +\| +0\.8", ended.summary)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("", []),
        ("--jobs 1 --align rigid", ["--jobs", "1", "--align", "rigid"]),
        ("--jobs 1\n--rate 20\n\n", ["--jobs", "1", "--rate", "20"]),
        (
            """--columns 't x y z'\n--frames "a b.txt"\n--name it\\'s""",
            ["--columns", "t x y z", "--frames", "a b.txt", "--name", "it's"],
        ),
        ("$(touch stolen) `touch stolen` ;*", ["$(touch", "stolen)", "`touch", "stolen`", ";*"]),
    ],
)
def test_options_are_words_of_a_shell_on_any_line(act, tmp_path, options, words):
    program = tmp_path / "alignscores/bin/alignscores"
    program.unlink()
    program.write_text("#!/bin/sh\nprintf '%s\\n' \"$@\"\n")
    program.chmod(0o755)
    ended = act(format="tum", reference="ref.txt", fail_on="PAS<0.5", options=options)
    before = ["compare", "tum", "ref.txt", "--fail_on", "PAS<0.5", "--markdown"]
    assert ended.out.splitlines() == [*before, str(tmp_path / "summary.md"), *words]
    assert (ended.code, ended.err) == (0, "")
    assert not (tmp_path / "stolen").exists()


def test_an_open_quotation_is_named(act):
    ended = act(format="tum", fail_on="worse", options="--columns 't x")
    assert ended.code == 2
    assert "::error::cannot split the input options into words" in ended.out
