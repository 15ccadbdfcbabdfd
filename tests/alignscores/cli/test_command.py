"""Usage, options, and the command as a process."""

import json
import os
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


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "the following arguments are required: FORMAT; see alignscores --help"),
        (["tum", "reference"], "the following arguments are required: EST; see alignscores tum --"),
        (["sfm", "a", "b"], "invalid choice: 'sfm'"),
        (["tum", "a", "b", "--registration", "none"], "argument --registration: invalid choice"),
        ([*TUM, "--nothing", "-x"], "unrecognized arguments: --nothing -x; see alignscores tum --"),
        (["tum", "a", "b", "--repeat", "0"], "--repeat: must be a whole number of at least 1, not"),
        (["tum", "a", "b", "--seed", "1.5"], "--seed: must be a whole number of at least 0, not '"),
        (["tum", "a", "b", "--unit", "inf"], "--unit: must be a finite number above 0, not 'inf'"),
        (["tum", "a", "b", "--weight", "1.1"], "--weight: must be a finite number from 0 to 1, no"),
        (["tum", "a", "b", "--t_offset", "nan"], "--t_offset: must be a finite number or auto, no"),
        (["tum", "a", "b", "--save_plot", "x.jpg"], "x.jpg does not end in .png or .pdf or .svg"),
        (["tum", "a", "b", "--save_results", "no/x.zip"], "no/x.zip: there is no folder no"),
        ([*TUM, "--alignment", "yaw", "--up"], "argument --up: expected one argument"),
        ([*TUM, "--alignment", "yaw", "--up", "-q"], "argument --up: "),
        ([*TUM, "--alignment", "yaw", "--up", "north"], "argument --up: invalid choice: 'north'"),
        (["compare", *TUM, "--no_cache"], "nothing is stored without --cache FOLDER; see align"),
        (["compare", "--clear_cache"], "delete the folder of --cache; see alignscores compare"),
    ],
)
def test_wrong_usage_is_one_line(run, arguments, reason):
    code, out, err = run(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert re.match("alignscores.*: error: ", err)
    assert reason in err


def test_an_option_that_needs_another_one(run):
    code, out, err = run(*TUM, "--up", "-y")
    assert (code, out) == (1, "")
    assert err == (
        "alignscores: error: up is used by alignment=yaw alone: set that, too, or leave up out\n"
    )


@pytest.mark.parametrize("up", [["--up", "-y"], ["--up=-y"], ["--up", "y"]])
def test_an_axis_with_a_sign_is_no_option(run, up):
    code, out, err = run(*TUM, *up, "--alignment", "yaw")
    assert (code, err) == (0, "")
    assert "registration refined, aligned about the y axis, without scale" in out


def test_files_may_have_the_names_of_axes(command, examples, tmp_path, monkeypatch):
    for name, file in zip("xy", TUM[1:], strict=True):
        shutil.copy(examples / file, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    assert command("tum", "x", "y", "--alignment", "yaw", "--up", "-y")[::2] == (0, "")


def test_version(run):
    assert run("--version") == (0, f"alignscores {alignscores.__version__}\n", "")


def test_help(run):
    code, out, _ = run("--help")
    assert code == 0
    for name, form in FORMATS.items():
        assert f"alignscores {name} {form.example}\n" in out
        code, text, _ = run(name, "--help")
        assert code == 0
        assert f" {name}: {form.help}. positional arguments: " in " ".join(text.split())
        assert not re.search(r"default: (None|False)", text)
    code, out, _ = run("compare", "--help")
    assert code == 0
    assert "\n3 a condition of --fail_on holds\n" in out  # a line of its own


def test_every_argument_is_explained_and_its_value_named():
    subcommands = next(
        action for action in build_parser()._actions if isinstance(action.choices, dict)
    )
    for command in subcommands.choices.values():
        for argument in command._actions:
            assert argument.help
            assert argument.nargs == 0 or argument.metavar or argument.choices


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="needs Linux")
def test_there_is_a_process_for_each_processor_that_may_be_used(process):
    one = "import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])"
    assert " processes in parallel (default: 1)" in process("compare", "--help", before=one).stdout


def test_as_a_module(examples, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "alignscores", *TUM],
        cwd=examples,
        env={**os.environ, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "registration refined" in done.stdout
    assert list(tmp_path.iterdir()) == []  # nothing in the home directory


@pytest.mark.parametrize("option", ["--json", "--seed=0"])
def test_an_output_that_cannot_encode_a_name(process, write, lines, option):
    path = write(lines, "é.txt")
    done = process(*TUM[:2], str(path), option, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
    if option == "--json":
        assert json.loads(done.stdout)["results"][0]["name"] == "é.txt"
    else:
        assert done.stdout.splitlines()[1].startswith(r"\xe9.txt ")


@pytest.mark.parametrize(
    ("blocked", "arguments", "extra"),
    [
        ("evo", [*TUM, "--save_results", "never.zip"], "evo"),
        ("pycolmap", COLMAP, "colmap"),
        ("matplotlib", [*TUM, "--save_plot", "never.png"], "plots"),
        ("yaml", ["compare", "never.yaml"], "yaml"),
    ],
)
def test_missing_extras_are_named(run, monkeypatch, blocked, arguments, extra):
    monkeypatch.setitem(sys.modules, blocked, None)
    message = f'{blocked} is not installed: pip install "alignscores[{extra}]"'
    assert run(*arguments) == (1, "", f"alignscores: error: {message}\n")
