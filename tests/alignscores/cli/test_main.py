"""Usage, options, and the command as a process."""

import re
import shutil
import subprocess
import sys

import pytest

import alignscores
from alignscores.cli.command import build_parser
from alignscores.trajectories.formats import FORMATS

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"
COLMAP = "colmap", "colmap/reference", "colmap/estimate"
NERF = "nerf", "nerf/reference.json", "nerf/estimate.json"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["tum"],
        ["tum", "reference"],
        ["sfm", "a", "b"],
        ["tum", "a", "b", "--registration", "none"],
        ["tum", "a", "b", "--missing", "skip"],
    ],
)
def test_wrong_usage(run, arguments):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert "alignscores" in err.splitlines()[-1]
    assert "error: " in err.splitlines()[-1]


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--repeat", "0", "must be a whole number of at least 1, not '0'"),
        ("--repeat", "1.5", "must be a whole number of at least 1, not '1.5'"),
        ("--seed", "-1", "must be a whole number of at least 0, not '-1'"),
        ("--seed", "1.5", "must be a whole number of at least 0, not '1.5'"),
        ("--seed", "9" * 400, "must be a whole number of at least 0"),
        ("--unit", "0", "must be a finite number above 0, not '0'"),
        ("--unit", "inf", "must be a finite number above 0, not 'inf'"),
        ("--weight", "1.1", "must be a finite number from 0 to 1, not '1.1'"),
        ("--max_threshold", "0", "must be a finite number above 0, not '0'"),
        ("--t_max_diff", "-1", "must be a finite number of at least 0, not '-1'"),
        ("--t_offset", "nan", "must be a finite number or auto, not 'nan'"),
        ("--save_plot", "x.jpg", "x.jpg does not end in .png or .pdf or .svg"),
        ("--save_results", "x.txt", "x.txt does not end in .zip"),
        ("--save_results", "no/x.zip", "no/x.zip: there is no folder no"),
    ],
)
def test_wrong_values_are_named_in_one_line(run, option, value, reason):
    code, out, err = run("tum", "a", "b", option, value)
    assert (code, out) == (2, "")
    assert err.startswith(f"alignscores tum: error: argument {option}: {reason}")
    assert err.endswith("; see alignscores tum --help\n")
    assert err.count("\n") == 1


@pytest.mark.parametrize("up", [["--up", "-y"], ["--up=-y"], ["--up", "y"]])
@pytest.mark.parametrize("before", [True, False])
def test_an_axis_with_a_sign_is_no_option(run, up, before):
    """Else argparse takes -y for one."""
    options = ["--alignment", "yaw"]
    options = [*up, *options] if before else [*options, *up]
    code, out, err = run(*TUM, *options)
    assert (code, err) == (0, "")
    assert "registration refined, aligned about the y axis, without scale" in out
    code, out, _ = run("compare", "tum", TUM[1], "tum/{system}.txt", *options)
    assert code == 0
    assert "; registration refined, aligned about the y axis, without scale\n" in out


def test_files_may_have_the_names_of_axes(command, examples, tmp_path, monkeypatch):
    for name, file in zip("xy", TUM[1:], strict=True):
        shutil.copy(examples / file, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    assert command("tum", "x", "y", "--alignment", "yaw", "--up", "-y")[::2] == (0, "")


def test_other_axes_are_refused(run):
    for up in (["--up", "-q"], ["--up"], ["--up", "north"]):
        code, out, err = run(*TUM, "--alignment", "yaw", *up)
        assert (code, out) == (2, "")
        assert "argument --up: " in err
    code, out, err = run(*TUM, "--up", "-y")
    assert (code, out) == (1, "")
    assert err == (
        "alignscores: error: up is used by alignment=yaw alone: set that, too, or leave up out\n"
    )


def test_version(run):
    assert run("--version") == (0, f"alignscores {alignscores.__version__}\n", "")


def test_help(run):
    code, out, _ = run("--help")
    assert code == 0
    assert "\nScore estimated camera trajectories against a reference: TAS " in out
    compare = " compare systems over sequences and runs, with their uncertainty "
    assert compare in " ".join(out.split())
    for name, form in FORMATS.items():
        assert f"alignscores {name} {form.example}\n" in out
        assert f" {name} {form.help} " in " ".join(out.split())
        code, text, _ = run(name, "--help")
        assert code == 0
        assert f" {name}: {form.help}. positional arguments: " in " ".join(text.split())
        assert f"example: alignscores {name}" in text
        assert "(default: refined)" in text
        assert not re.search(r"default: (None|False)", text)


def test_help_of_compare(run):
    code, out, _ = run("compare", "--help")
    assert code == 0
    assert " compare: systems over sequences and runs. Lost frames, " in " ".join(out.split())
    assert "\n3 certainly worse than the baseline (--fail_on worse)\n" in out  # a line of its own


def test_every_argument_is_explained_and_its_value_named():
    """No help says ``--save_errors SAVE_ERRORS``."""
    (commands,) = (each.choices for each in build_parser()._actions if each.choices)
    assert set(commands) == {*FORMATS, "compare"}
    for command in commands.values():
        for argument in command._actions:
            assert argument.help
            assert argument.nargs == 0 or argument.metavar or argument.choices


def test_as_a_module(examples, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME")
    command = [sys.executable, "-m", "alignscores", *TUM]
    done = subprocess.run(command, cwd=examples, capture_output=True, text=True, timeout=100)
    assert (done.returncode, done.stderr) == (0, "")
    assert "registration refined" in done.stdout
    assert list(tmp_path.iterdir()) == []  # nothing in the home directory
    saved = tmp_path / "errors.csv"
    # Nobody reads on.
    closed = ["bash", "-c", '"$@" | true', "bash", *command, "--save_errors", str(saved)]
    done = subprocess.run(closed, cwd=examples, capture_output=True, text=True, timeout=100)
    assert done.stderr == ""
    assert saved.stat().st_size > 0


@pytest.mark.parametrize(
    ("blocked", "arguments", "extra"),
    [
        ("evo", [*NERF, "--save_results", "/tmp/never.zip"], "evo"),
        ("pycolmap", COLMAP, "colmap"),
        ("matplotlib", [*NERF, "--save_plot", "/tmp/never.png"], "plots"),
        ("yaml", ["compare", "never.yaml"], "yaml"),
    ],
)
def test_missing_extras_are_named(run, monkeypatch, blocked, arguments, extra):
    monkeypatch.setitem(sys.modules, blocked, None)
    code, out, err = run(*arguments)
    assert (code, out) == (1, "")
    assert err == (
        f'alignscores: error: {blocked} is not installed: pip install "alignscores[{extra}]"\n'
    )
