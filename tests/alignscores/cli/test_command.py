"""From arguments to what is printed: the format that is not named, progress, and streams."""

import json
import os
import sys
from argparse import Namespace
from io import BytesIO, TextIOWrapper
from types import SimpleNamespace

import pytest

from alignscores.cli import command, main
from alignscores.cli.command import (
    check_outputs_possible,
    with_format,
    with_signed_axes,
)

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"


@pytest.mark.parametrize(
    ("given", "taken"),
    [
        ("tum a b --up -y", "tum a b --up=-y"),
        ("--up x --up -z a", "--up=x --up=-z a"),
        ("tum x y --seed -y z", "tum x y --seed -y z"),
        ("tum a --up", "tum a --up"),
        ("--up", "--up"),
        ("x a --up", "x a --up"),
        ("", ""),
    ],
)
def test_an_axis_is_joined_to_its_option_alone(given, taken):
    """A file may have the name of an axis."""
    assert with_signed_axes(given.split()) == taken.split()


@pytest.mark.parametrize(
    ("given", "taken", "note"),
    [
        (
            "tum/reference.txt tum/estimate.txt --seed 1",
            "tum tum/reference.txt tum/estimate.txt --seed 1",
            "taken for the format tum",
        ),
        (
            "euroc/data.csv euroc/estimate.txt euroc/estimate.txt",
            "euroc euroc/data.csv euroc/estimate.txt euroc/estimate.txt --est_format=tum",
            "taken for the format euroc; euroc/estimate.txt for tum",
        ),
        (
            "euroc/data.csv euroc/estimate.txt",
            "euroc euroc/data.csv euroc/estimate.txt --est_format=tum",
            "taken for the format euroc; euroc/estimate.txt for tum",
        ),
        (
            "colmap/reference colmap/estimate",
            "colmap colmap/reference colmap/estimate",
            "taken for the format colmap",
        ),
        ("tum/reference.txt --json", "tum/reference.txt --json", None),
        ("none none.txt", "none none.txt", None),
        ("tum tum/reference.txt", "tum tum/reference.txt", None),
        ("compare tum/reference.txt", "compare tum/reference.txt", None),
    ],
)
def test_the_format_stands_before_the_files(examples, monkeypatch, capsys, given, taken, note):
    monkeypatch.chdir(examples)
    assert with_format(given.split()) == taken.split()
    assert capsys.readouterr().err == (f"alignscores: note: {note}\n" if note else "")


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (
            ["tum/reference.txt", "kitti/estimate.txt"],
            "tum/reference.txt is in the format tum, kitti/estimate.txt in kitti: no match",
        ),
        (
            ["tum/reference.txt", "tum/estimate.txt", "kitti/estimate.txt"],
            "kitti/estimate.txt: is not in the format of tum/estimate.txt, tum; score it apart",
        ),
    ],
)
def test_files_of_several_formats_are_refused(run, files, message):
    assert run(*files) == (1, "", f"alignscores: error: {message}\n")


def test_a_file_that_is_not_there_is_named_where_it_looks_like_one(run):
    """What has no ending is taken for a format."""
    message = "none.txt: cannot be read (No such file or directory)"
    assert run("none.txt", TUM[2]) == (1, "", f"alignscores: error: {message}\n")
    code, _, err = run("none", TUM[2])
    assert code == 2
    assert "invalid choice: 'none'" in err


def test_without_arguments_the_format_is_asked_for(run):
    message = "the following arguments are required: FORMAT; see alignscores --help"
    assert run() == (2, "", f"alignscores: error: {message}\n")


@pytest.mark.parametrize(("estimates", "step"), [(1, None), (2, 0.1), (3, 0.1)])
def test_several_estimates_have_frames_in_common(run, monkeypatch, estimates, step):
    """Whose step is found once for all; of one alone it is its own."""
    score, steps, files = command.score, [], TUM[2:] * estimates

    def step_of_frames(paths, _):
        assert tuple(paths) == files
        return 0.1

    def scored(*arguments, step, **options):
        steps.append(step)
        return score(*arguments, step=step, **options)

    monkeypatch.setattr(command, "step_of_frames", step_of_frames)
    monkeypatch.setattr(command, "score", scored)
    assert run(*TUM[:2], *files)[0] == 0
    assert steps == [step] * estimates


def test_unknown_options_are_named(run):
    code, out, err = run(*TUM, "--nothing", "-x")
    assert (code, out) == (2, "")
    message = "unrecognized arguments: --nothing -x; see alignscores tum --help"
    assert err == f"alignscores tum: error: {message}\n"


@pytest.mark.parametrize("option", ["--no_cache", "--clear_cache"])
def test_options_that_are_gone_say_where_to_look(run, option):
    code, out, err = run("compare", *TUM, option)
    assert (code, out) == (2, "")
    assert f"unrecognized arguments: {option}; " in err
    assert "--cache" in err.replace(option, "")


def test_arguments_are_those_of_the_process(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["alignscores", "tum", "--metrics", "help"])
    with pytest.raises(SystemExit, match=r"^0$"):
        main()
    assert capsys.readouterr().out.startswith("TAS ")


class Terminal(BytesIO):
    """What has come out of a buffer."""

    def isatty(self):
        return True


@pytest.mark.parametrize("option", ["--json", "--seed=0"])
def test_what_is_printed_has_left_the_buffers(examples, monkeypatch, write, lines, option):
    """On an output that cannot encode all names, which are escaped there."""
    path, out, err = write(lines, "é.txt"), Terminal(), Terminal()
    monkeypatch.chdir(examples)
    monkeypatch.setattr(sys, "stdout", TextIOWrapper(out, "ascii"))
    monkeypatch.setattr(sys, "stderr", TextIOWrapper(err, "utf-8", line_buffering=True))
    assert main([*TUM[:2], str(path), option]) == 0
    if option == "--json":
        assert json.loads(out.getvalue())["results"][0]["name"] == "é.txt"
    else:
        assert out.getvalue().splitlines()[1].startswith(rb"\xe9.txt ")
    assert err.getvalue().endswith(b"\r\x1b[K")


SCORING = """[--unit X] [--max_threshold X] [--max_threshold_deg X] [--weight X]
[--registration {pcr99,refined}] [--alignment {similarity,rigid,yaw,none}]
[--up {z,y,x,-z,-y,-x}] [--seed X] [--repeat X]"""
TIMES = """[--t_max_diff X] [--sync {interpolate,nearest}] [--max_gap X] [--t_start X]
[--t_end X] [--t_offset X] [--frames FILE]"""
POSES = "[--invert] [--body_rotation {auto,none}]"
LOST = "[--missing {fail,ignore}]"
SAVED = "[--save_results FILE.zip] [--plot] [--save_plot FILE] [--save_page FILE.html] REF EST [EST"
SAVED_TABLES = """[--metrics NAMES] [--json] [--save_errors FILE.csv] [--all_cameras]
[--save_metrics FILE.csv] [--profile FILE.csv]"""
TOPICS = "[--ref_topic TOPIC] [--est_topic TOPIC]"
WITH_TIMES = "tum,euroc,vslamlab,arrays,bag"
USAGE = {  # of formats that have, or have not: times, topics, cameras that may be missing, a world
    "tum": f"""[-h] [--est_format {{{WITH_TIMES}}}] {LOST} {TIMES} {POSES} {SCORING} {SAVED_TABLES}
[--save_aligned FILE.txt] {SAVED} ...]""",
    "bag": f"""[-h] [--est_format {{{WITH_TIMES}}}] {TOPICS} {LOST} {TIMES} {POSES} {SCORING}
{SAVED_TABLES} [--save_aligned FILE.txt] {SAVED} ...]""",
    "kitti": f"""[-h] {POSES} {SCORING} {SAVED_TABLES} [--save_aligned FILE.txt] {SAVED} ...]""",
    "nerf": f"""[-h] [--est_format {{colmap,nerf}}] {LOST} {POSES} {SCORING} {SAVED_TABLES}
{SAVED} ...]""",
    "compare": f"""[-h] [--dry-run] [--baseline FILE.json] [--fail_on {{worse}}] [--expect_all]
[--est_format {{tum,kitti,euroc,colmap,vslamlab,arrays,bag,nerf}}] {TOPICS} {LOST} {TIMES} {POSES}
{SCORING} [--jobs X] [--cache FOLDER] [--metrics NAMES] [--by NAME]
[--html FILE.html] [--json | --csv | --markdown | --latex] [FORMAT] [PATTERN ...]""",
}
GROUPS = ["positional arguments:", "options:", "which poses belong together:", "scoring:"]


@pytest.mark.parametrize("name", USAGE)
def test_each_format_has_the_options_that_it_can_have(run, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "120")
    _, out, _ = run(name, "--help")
    usage, _, more = out.partition("\n\n")
    assert usage.split() == ["usage:", "alignscores", name, *USAGE[name].split()]
    work = ["work:"] if name == "compare" else []
    found = [line for line in more.splitlines() if line.endswith(":") and line[0] != " "]
    assert found[: 5 + len(work)] == [*GROUPS, *work, "output:"]


def test_outputs_have_their_names_in_the_help(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    out = run("compare", "--help")[1]
    for name in ("JSON", "CSV", "Markdown", "LaTeX"):
        assert f" print {name} instead of the table\n" in out
    assert " file with the time stamps of the frames that were to be estimated, or a pattern" in out


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="needs Linux")
def test_there_is_a_process_for_each_processor_that_may_be_used(process):
    one = "import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])"
    assert " processes side by side (default: 1)" in process("compare", "--help", before=one).stdout


@pytest.mark.parametrize(
    ("wanted", "required"),
    [
        ((), []),
        (("save_results",), ["evo"]),
        (("save_plot",), ["matplotlib"]),
        (("plot",), ["matplotlib.pyplot", "matplotlib.backends.registry"]),
        (("save_errors", "save_page"), []),
    ],
)
def test_outputs_need_what_makes_them_alone(monkeypatch, wanted, required):
    """A window needs a display, which the backend without one has not."""
    asked = []

    def require(module, extra):
        asked.append(module)
        assert extra == ("evo" if module == "evo" else "plots")
        filters = SimpleNamespace(NON_INTERACTIVE="without")
        registry = SimpleNamespace(list_builtin=lambda kind: ["agg"] * (kind == "without"))
        return SimpleNamespace(
            get_backend=lambda: "tkagg", backend_registry=registry, BackendFilter=filters
        )

    monkeypatch.setattr(command, "require", require)
    names = "save_results", "save_plot", "plot", "save_errors", "save_page"
    check_outputs_possible(Namespace(**{name: name in wanted for name in names}))
    assert asked == required
