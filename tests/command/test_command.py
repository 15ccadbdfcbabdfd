"""Usage, help, and the command as a process."""

import re
import sys

import pytest

import alignscores
from alignscores.cli.compare import OF_SCORE, compare_parser
from alignscores.cli.score import OF_COMPARE, score_parser
from alignscores.evaluation.settings import ABOUT
from alignscores.io import FORMATS
from alignscores.metrics import METRICS
from tests.files import COLMAP, TUM

COMPARE = "compare", "tum", "tum/reference.txt", "tum/{system}.txt"
WRONG = [
    ([], "the following arguments are required: REF EST; see alignscores --help"),
    (["tum/reference.txt"], "give a reference and at least one estimate"),
    (["tum", "reference"], "give a reference and at least one estimate"),
    (["sfm", "a", "b"], "'sfm' is neither a file nor a format (tum, kitti, euroc, names,"),
    (
        [*TUM, "--registration", "none"],
        "registration must be one of pcr99, refined, not",
    ),
    ([*TUM, "--nothing", "-x"], "unknown option --nothing; see alignscores --help"),
    ([*TUM, "--alignement", "none"], "unknown option --alignement; did you mean --alignment?"),
    ([*TUM, "--save-page=a.html"], "unknown option --save-page; did you mean --save_page?"),
    ([*TUM, "--allign", "rigid"], "unknown option --allign; did you mean --alignment?"),
    ([*TUM, "--align", "rigid"], "-a and --align take no value; write --alignment rigid; see"),
    ([*TUM, "--t_offset", "-50ms"], "t_offset must be a finite number or auto, not '-50ms'"),
    ([*TUM, "--lever_arm", "-1,2"], "lever_arm must be X,Y,Z, each a finite number or auto, not"),
    ([*TUM, "--up", "-y"], "up is used only by alignment=yaw: set that, too, or leave up out"),
    ([*TUM, "--up", "-p"], "argument --up: expected one argument"),
    ([*TUM, "--by", "PAS"], "--by belongs to `alignscores compare`; see"),
    ([*TUM, "--fail-on", "PAS<1"], "unknown option --fail-on; did you mean --fail_on?"),
    ([*TUM, "--markdown", "-", "--csv"], "--markdown - and --csv both print"),
    ([*TUM, "--repeat", "0"], "repeat must be a whole number of at least 1, not '0'"),
    ([*TUM, "--save_plot", "x.jpg"], "x.jpg does not end in .png or .pdf or .svg"),
    ([*TUM, "--save_results", "no/x.zip"], "no/x.zip: there is no folder no"),
    (
        [*TUM, "--est_format", "nerf"],
        "nerf estimates cannot be matched to tum references: only nerf files have image names; "
        "write the poses of the tum file as a table 'name x y z qx qy qz qw'",
    ),
    ([*TUM, "--columns", "t x y"], "columns must be x, y and z, and all of a rotation or none, e"),
    ([*TUM, "--metrics", "auc@30"], "'auc@30'; close to it are auc@30:"),
    ([*COLMAP, "--save_aligned", "x.txt"], "--save_aligned cannot write colmap files"),
    (
        ["bag", "run.bag", "/gt", "/odom"],
        "topics are options here: alignscores bag run.bag run.bag",
    ),
    (["compare"], "the following arguments are required: [FORMAT] REF EST; see alignscores comp"),
    (["compare", "sfm", "a", "b"], "give a format (tum, kitti, euroc, names, hloc, colmap, "),
    ([*COMPARE, "--save_page", "page.txt"], "argument --save_page: page.txt does not"),
    ([*COMPARE, "--save_pages", "a.html"], "unknown option --save_pages; did you mean --save_page"),
    ([*COMPARE, "--save_rrd", "a.rrd"], "--save_rrd belongs to `alignscores REF EST`"),
    ([*COMPARE, "--fail_on", "worse"], "argument --fail_on: worse: needs --baseline FILE"),
    ([*COMPARE, "--by", "rpe@1m"], "argument --by: must be one of TAS, RAS, PAS, half_distance"),
    ([*COMPARE, "--better", "smaller"], "argument --better: better must not be smaller for PAS"),
    ([*COMPARE, "--jobs", "0"], "argument --jobs: must not be 0"),
    (["compare", "gt.txt", "runs/*.txt"], "the pattern of the estimates needs {system} in place"),
    (["compare", "gt.txt", "{system}.txt", "{run}.txt"], "give a format (tum, "),
    (["compare", "gt.txt"], "gt.txt: give a pattern of estimates, too, or one YAML or CSV file"),
    ([*COMPARE, "--est_topic", "/odom"], "est_topic applies only to bags: tum files have no"),
    ([*TUM[1:], "--est_topic", "/odom"], "est_topic applies only to bags: tum files have no"),
]


@pytest.mark.parametrize(("arguments", "reason"), WRONG)
def test_wrong_usage_is_one_line(run, arguments, reason):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert re.fullmatch("alignscores.*: error: .*", err.splitlines()[-1])
    assert reason in err


def test_help_has_the_everyday_options_and_help_all_has_all(run):
    _, short, _ = run("--help")
    _, full, _ = run("--help-all")
    assert "--alignment " in short
    assert "--weight " not in short
    for name in set(ABOUT) - {"format"}:
        assert f"--{name} " in full
    for name, file_format in FORMATS.items():
        assert f"  {name:8}  {file_format.help}\n" in short
    _, short, _ = run("compare", "--help")
    _, full, _ = run("compare", "--help-all")
    assert "--paired" not in short
    assert "--paired" in full
    assert "\n3 a condition of --fail_on holds\n" in short


def test_the_command_metrics_lists_all(run):
    code, out, err = run("metrics")
    assert (code, err) == (0, "")
    names = [line.split()[0] for line in out.splitlines() if line.startswith("  ")]
    assert names == [entry.syntax for entry in METRICS]


def test_the_version_is_printed(run):
    assert run("--version") == (0, f"alignscores {alignscores.__version__}\n", "")


def test_options_may_stand_between_the_files(run):
    assert run(TUM[0], TUM[1], "--seed", "1", TUM[2]) == run(*TUM, "--seed", "1")


@pytest.mark.parametrize(
    ("blocked", "arguments", "extra"),
    [
        ("evo", [*TUM, "--save_results", "never.zip"], "evo"),
        ("evo", [*TUM, "--metrics", "rpe@1m"], "evo"),
        ("matplotlib", [*TUM, "--save_plot", "never.png"], "plots"),
        ("pandas", ["compare", "a", "b"], "compare"),
        ("joblib", ["compare", "a", "b"], "compare"),
        ("yaml", ["compare", "never.yaml"], "compare"),
    ],
)
def test_missing_extras_are_named(run, monkeypatch, blocked, arguments, extra):
    monkeypatch.setitem(sys.modules, blocked, None)
    message = f'{blocked} is not installed: pip install "alignscores[{extra}]"'
    assert run(*arguments) == (1, "", f"alignscores: error: {message}\n")


def test_both_commands_write_alike_and_know_the_options_of_each_other():
    ours, theirs = (
        set(parser()._option_string_actions) for parser in (score_parser, compare_parser)
    )
    written = {"--save_page", "--save_plot", "--save_json", "--save_csv", "--latex", "--markdown"}
    assert {*written, "--json", "--csv", "-o", "--output", "-v", "--verbose"} <= ours & theirs
    assert set(OF_COMPARE) == theirs - ours
    assert set(OF_SCORE) == ours - theirs - {"--version"}
