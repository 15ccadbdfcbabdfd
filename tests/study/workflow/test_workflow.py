"""Snakemake plans, runs, resumes and reruns what it should, and passes settings on."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from modulefinder import ModuleFinder
from pathlib import Path

import pytest

from tests.snakemake_server import home

from .conftest import ROOT, SNAKEFILE, Done, options

FOLDERS = ("alignscores", "baselines", "experiments", "studies", "figures", "report")


def copy_of_the_project(folder):
    leave = shutil.ignore_patterns("__pycache__")
    for name in (*FOLDERS, "configs"):
        shutil.copytree(ROOT / name, folder / name, ignore=leave)
    shutil.copy(SNAKEFILE, folder)
    return folder


TARGETS = {  # rules of the jobs that each target needs, from nothing; with two replicates
    "figures": {
        **{"trials": 8, "position_figures": 1, "pose_figures": 1},
        **{"captions": 1, "table1": 1},
    },
    "claims": {"replicate": 2, "verdicts": 1},
    "readings": {},
    "head_to_head": {"trials": 8, "study_trials": 8, "orders": 1},
    "threshold_study": {"study_trials": 3, "threshold_effects": 1, "study_figure": 1},
    "beyond": {"study_trials": 31, "scenarios": 1, "study_figure": 1},
}


@pytest.mark.parametrize("target", TARGETS)
def test_a_target_needs_its_own_trials_and_no_others(snakemake, target):
    jobs = snakemake(target, "--dry-run", "--config", "replicates=2").planned
    assert jobs == TARGETS[target] | {target: 1}


@pytest.mark.slow
def test_the_report_needs_each_job_once(snakemake):
    jobs = snakemake("report", "--dry-run", "--config", "replicates=2").planned
    needed = Counter(report=1, readings=1)  # which makes its table itself
    for target in TARGETS:
        needed += Counter(TARGETS[target])
    assert jobs == needed - Counter(trials=8)  # which figures and head_to_head share


def test_on_a_cluster_what_runs_trials_is_a_job_of_one_core_and_stated_needs(snakemake):
    settings = ("replicates=2", "trials=100", "results_dir=quick")
    one_of_each = "quick/trials/outliers.csv", "threshold_study", "quick/replicates/0.csv"
    done = snakemake(*one_of_each, "readings", "--dry-run", "--config", *settings, profile="slurm")
    needs = {rule for rule, text in done.jobs if "runtime=" in text and "mem_mb=" in text}
    assert needs == {"trials", "study_trials", "replicate", "readings"}
    assert "threads: " not in done.text  # named where more than one


def test_on_a_cluster_what_else_makes_files_runs_where_it_was_started():
    """A dry run does not tell; `use rule` leaves behind what one rule says of itself."""
    code = SNAKEFILE.read_text()
    rules = re.findall(r"^(rule|use rule \w+ as) (\w+).*:\n((?:\n|    .*\n)*)", code, re.MULTILINE)
    makes = {name for keyword, name, body in rules if keyword != "rule" or "output:" in body}
    local = "".join(re.findall(r"^localrules:\n((?:    \w+,\n)+)", code, re.MULTILINE))
    assert makes - {*re.findall(r"\w+", local)} == {
        *("trials", "study_trials", "replicate", "readings"),
    }


@pytest.mark.parametrize(
    ("target", "setting", "named"),
    [
        ("figures", "trails=5", "Could not override 'trails'"),
        ("figures", "trials=5", "trials=5 changes what the paper's figures show; name a folder"),
        ("figures", "output=a.csv", "setting 'output' cannot be set: the workflow decides it"),
        ("figures", "n_jobs=two", "setting 'n_jobs': should be a valid integer, not 'two'"),
        ("threshold_study", "tas_max_threshold=0.5", "'tas_max_threshold' must be a list in "),
        ("claims", "replicates=1", "'replicates'"),
        ("beyond", "scenarios=mine.yaml", "scenarios.a: setting 'geometry': must be one of "),
    ],
)
def test_wrong_settings_are_named_before_any_trial(snakemake, tmp_path, target, setting, named):
    (tmp_path / "mine.yaml").write_text("scenarios: {a: {geometry: sphere}}")
    done = snakemake(target, "--config", setting)
    assert done.returncode != 0
    assert named in done.text
    assert "Traceback" not in done.text
    assert not (tmp_path / "results").exists()


@pytest.mark.slow
def test_runs_and_reruns(snakemake, tmp_path):
    target = "quick/trials/outliers.csv"
    small = ["trials=2", "sigma_t=[0.02,0.05]", "n_cameras=[25]", "n_outliers=[0,2]"]
    small += ["results_dir=quick"]
    done = snakemake(target, "--config", *small)
    assert done.returncode == 0, done.text
    trials = tmp_path / "quick" / "trials" / "outliers.csv"
    assert len(trials.read_text().splitlines()) == 1 + 2 * 2 * 2
    before = trials.read_bytes()

    # Nothing is left to do; how it is run changes nothing; another setting does.
    parallel = [*small, "n_jobs=2"]
    assert snakemake(target, "--dry-run", "--config", *parallel).planned == {}
    more = ["trials=3", *small[1:]]
    again = {"trials": 1}
    assert snakemake(target, "--dry-run", "--config", *more).planned == again

    # So does a table by hand in this place, with or without what Snakemake remembers.
    record = trials.with_suffix(".json")
    original = trials.read_bytes(), record.read_bytes()
    trials.unlink()
    record.unlink()
    run = ["experiment=outliers", *more[:-1], f"output={trials}", "n_jobs=1"]
    subprocess.run([sys.executable, "-m", "experiments.run", *run], cwd=tmp_path, check=True)
    assert snakemake(target, "--dry-run", "--config", *small).planned == again
    shutil.rmtree(tmp_path / ".snakemake")
    assert snakemake(target, "--dry-run", "--config", *small).planned == again
    trials.write_bytes(original[0])
    record.write_bytes(original[1])
    shutil.rmtree(tmp_path / "quick" / "settings")
    assert "trials" not in snakemake(target, "--dry-run", "--config", *small).planned

    # A table that was lost comes back bit for bit.
    trials.unlink()
    assert snakemake(target, "--config", *small).returncode == 0
    assert trials.read_bytes() == before

    # One that was changed is refused by what reads it.
    trials.write_bytes(before[:-2])
    draw = [sys.executable, "-m", "figures", "outliers", target, "--output", "outliers.png"]
    drawn = subprocess.run(draw, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert drawn.returncode != 0
    assert f"{target} was changed, or outliers.json is not" in drawn.stderr


SCENARIOS = """\
settings: {experiment: maa_vs_pas_outliers, n_outliers: [0, 4], metrics: [TAS]}
scenarios:
  paper: {}
  orbit: {geometry: orbit}
"""
FILES = (
    "results/figures/outliers.png",
    "results/figures/histogram.png",
    "results/replicates/7.csv",  # the first three are also judged under other readings: longer
    "results/figures/beyond.png",
)
DRAWN = {"position_figures": 1, "pose_figures": 1, "study_figure": 1}
ANALYSIS = {"scenarios": 1, "study_figure": 1}
EDITS = [  # files of the project, with the jobs that an edit of them makes run again
    (
        (
            *("alignscores/io/text.py", "alignscores/cli/compare.py"),
            *("report/study.rst", "studies/thresholds.py"),
            *("alignscores/show/rerun.py", "alignscores/evaluation/scoring.py"),
        ),
        {},
    ),
    (("alignscores/show/plots.py",), DRAWN),  # which has what the histogram draws
    (("figures/curves.py",), DRAWN),
    (("studies/beyond.py",), ANALYSIS),
    (("studies/order.py",), ANALYSIS),
    (
        ("experiments/scenes/errors.py",),
        {"trials": 8, "study_trials": 2, "replicate": 1, "scenarios": 1} | DRAWN,
    ),
]
CLAIMS = [  # a text, what takes its place, whether other trials are needed then
    ("A single outlier blinds", "One outlier blinds", False),
    ("n_outliers: [1], sigma_t: [0.01, 0.03,", "n_outliers: [1], sigma_t: [0.01, 0.02,", True),
]


@pytest.mark.slow
def test_an_edit_reruns_what_depends_on_it_and_nothing_else(snakemake, tmp_path):
    """Analysis reruns no trial and redraws what uses it; a generator of scenes reruns them all.

    Files are not made but taken for made, which Snakemake records alike.
    """
    copy = copy_of_the_project(tmp_path / "copy")
    (copy / "studies" / "beyond.yaml").write_text(SCENARIOS)

    def run(*arguments):
        done = snakemake(*arguments, "--config", "n_jobs=1", project=copy)
        assert done.returncode == 0, done.text
        return done

    def rerun(*targets):
        return run(*targets, "--dry-run").planned

    for _, text in run(*FILES, "--dry-run").jobs:
        for name in re.findall(r"^ +output: (.*)", text, re.MULTILINE)[0].split(", "):
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            (copy / name).write_text(f"taken for {name}")
    run(*FILES, "--touch", "--forceall")
    assert rerun(*FILES) == {}
    for files, jobs in EDITS:
        code = {copy / name: (copy / name).read_text() for name in files}
        for path, text in code.items():
            path.write_text(f"{text}# changed\n")
        assert rerun(*FILES) == jobs, files
        for path, text in code.items():
            path.write_text(text)

    claims = copy / "configs" / "claims.yaml"
    for old, new, is_run_again in CLAIMS:
        text = claims.read_text()
        assert old in text
        claims.write_text(text.replace(old, new))
        assert rerun("results/replicates/7.csv") == ({"replicate": 1} if is_run_again else {})
        claims.write_text(text)

    config = copy / "configs" / "experiment" / "outliers.yaml"
    config.write_text(config.read_text().replace("sigma_r_deg: [3.0]", "sigma_r_deg: [4.0]"))
    # In a process of its own: the server of the copy has composed the settings before.
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", *options(copy), *FILES[:3], "--dry-run"],
        cwd=copy,
        env=os.environ | home(tmp_path / "home"),
        capture_output=True,
        text=True,
    )
    planned = Done(done.returncode, done.stdout + done.stderr).planned
    assert planned == {"trials": 1, "position_figures": 1, "replicate": 1}


def test_an_experiment_of_your_own_changes_nothing_of_the_papers(snakemake, tmp_path):
    copy = copy_of_the_project(tmp_path / "copy")
    experiments = copy / "configs" / "experiment"
    text = (experiments / "outliers.yaml").read_text()
    (experiments / "circle.yaml").write_text(
        text.replace("name: outliers", "name: circle").replace(
            "n_outliers: [0, 1,", "n_outliers: ["
        )
    )
    for target in ("figures", "head_to_head"):
        planned = snakemake(target, "--dry-run", project=copy).planned
        assert planned == TARGETS[target] | {target: 1}
    assert snakemake("results/trials/circle.csv", "--dry-run", project=copy).planned == {
        "trials": 1
    }


def test_trials_rest_on_no_code_that_may_change_without_rerunning_them(tmp_path):
    """What a sweep of all metrics imports of the project is in the digest of its rule."""
    code = """
import sys
from experiments.config import load_sweep
from experiments.metrics import METRICS
from experiments.sweep import run_sweeps
settings = ["trials=1", f"metrics=[auc@30:vggt,{','.join(METRICS)}]"]
run_sweeps([load_sweep([*settings, "n_cameras=[20]", "n_outliers=[2]", "sigma_t=[0.1]"])])
files = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
print(*filter(None, files), sep="\\n")
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    paths = [Path(line) for line in done.stdout.splitlines() if line.startswith(f"{ROOT}/")]
    used = {path for path in paths if ".venv" not in path.parts and path.suffix == ".py"}
    left_out = re.search(r"leave_out=\((.*?)\)", SNAKEFILE.read_text())
    assert left_out
    names = [f"alignscores.{name}" for name in re.findall(r'"(.+?)"', left_out[1])]
    finder = ModuleFinder([str(ROOT)], excludes=names)
    finder.import_hook("experiments.run")
    digested = {Path(module.__file__) for module in finder.modules.values() if module.__file__}
    assert used <= digested
    parts = {path.relative_to(ROOT).parts[:2] for path in digested}
    for other in ("cli", "evaluation", "io", "show"):
        assert ("alignscores", other) not in parts


USER_STUDY = """\
settings: {trials: 2, n_cameras: [20], n_outliers: [0, 4], sigma_t: [0, 0.1], sigma_r_deg: [1, 5]}
scenarios:
  circle: {geometry: orbit}
  wrong_merge: {geometry: orbit, outliers: cluster}
"""


@pytest.mark.slow
def test_a_study_of_ones_own_runs_and_reruns_what_changed(snakemake, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(USER_STUDY)
    arguments = ["--config", "scenarios=mine.yaml", "n_jobs=1"]
    done = snakemake("beyond", *arguments)
    assert done.returncode == 0, done.text
    results = tmp_path / "results"
    table = (results / "tables" / "beyond_mine.csv").read_text()
    assert table.count("\ncircle,orbit,gaussian,uniform,10.0,") == 11  # metrics
    assert table.count("\nwrong_merge,orbit,gaussian,cluster,10.0,") == 11

    file.write_text(USER_STUDY.replace("outliers: cluster", "outliers: frozen"))
    done = snakemake("beyond", "--dry-run", *arguments)
    assert done.planned == {"study_trials": 1, "scenarios": 1, "study_figure": 1, "beyond": 1}
    assert "output: results/trials/beyond_mine/wrong_merge.csv" in done.text


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_same_bytes(snakemake, tmp_path):
    """Kill it, workers and all, when one table is there; the names of folders may be anybody's."""
    names = ("outliers", "collinear")
    settings = ["trials=100", "n_outliers=[0,10]", "sigma_t=[0.02,0.05]", "metrics=[TAS,DTE]"]

    def arguments(folder):
        targets = [f"{folder}/trials/{name}.csv" for name in names]
        return [*targets, "--cores", "1", "--config", *settings, f"results_dir={folder}"]

    def tables(folder):
        return [path.read_bytes() for path in sorted((tmp_path / folder).rglob("*.csv"))]

    def started(folder):
        return len(list((tmp_path / folder / "logs").rglob("*.log")))

    assert snakemake(*arguments("größe=1")).returncode == 0
    with subprocess.Popen(
        [sys.executable, "-m", "snakemake", *options(), *arguments("killed")],
        cwd=tmp_path,
        env=os.environ | home(tmp_path / "home"),
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        # On one core the second job starts when Snakemake has put down the first as done.
        while process.poll() is None and started("killed") < 2:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
    assert len(tables("killed")) == 1

    assert "Directory cannot be locked" in snakemake(*arguments("killed")).text
    assert snakemake(*arguments("killed"), "--unlock").returncode == 0
    assert snakemake(*arguments("killed"), "--dry-run").planned == {"trials": 1}
    assert snakemake(*arguments("killed")).returncode == 0
    assert tables("killed") == tables("größe=1")
    assert len(tables("größe=1")) == 2


TOY = '''\
"""Toy: the mean score of two metrics."""

from matplotlib.figure import Figure

from figures import style


def plan(settings):
    """Return the settings of one table, of the paper's collinear cameras."""
    levels = {"n_outliers": [0], "sigma_t": [0.1]}
    return {"line": {"experiment": "collinear", "metrics": ["TAS", "ATE"], **levels, **settings}}


def answer(trials):
    """Return the means as a table."""
    means = trials[0].table[["TAS", "ATE"]].mean()
    return [means.rename_axis("metric").reset_index(name="mean")]


def draw(table):
    """Figure: the mean of each metric."""
    figure = Figure(figsize=(style.COLUMN, 2))
    figure.subplots().bar(table["metric"], table["mean"])
    return figure
'''
RULES = """

use rule table1 as toy_means with:
    input:
        lambda w: trials_of("toy"),
    output:
        RESULTS / "tables/toy.csv",
    params:
        study="toy",
        code=lambda w: code("studies.__main__", "studies.toy"),
    log:
        RESULTS / "logs/answers/toy.log",
    benchmark:
        RESULTS / "benchmarks/answers/toy.tsv"


rule toy:
    input:
        rules.toy_means.output,
        expand(RESULTS / "figures/{figure}.{ext}", figure="toy", ext=["pdf", "png"]),
"""
ENTRIES = [  # in the Snakefile
    ("STUDY_FIGURES = {", 'STUDY_FIGURES = {"toy": "studies.toy:draw", '),
    ("\nSTUDIES = {", '\nSTUDIES = {"toy": "studies.toy", '),
]


@pytest.mark.slow
def test_a_new_study_is_a_file_and_a_rule(snakemake, tmp_path):
    """The recipe of docs/develop/extend.md: a target, a table and a figure."""
    copy = copy_of_the_project(tmp_path / "copy")
    (copy / "studies" / "toy.py").write_text(TOY)
    main = copy / "studies" / "__main__.py"
    main.write_text(main.read_text().replace("STUDIES = (", 'STUDIES = ("toy", '))
    snakefile = copy / "Snakefile"
    text = snakefile.read_text()
    for old, new in ENTRIES:
        assert old in text
        text = text.replace(old, new)
    snakefile.write_text(text + RULES)
    settings = ["--config", "trials=2", "results_dir=quick"]
    done = snakemake("toy", *settings, project=copy)
    assert done.returncode == 0, done.text
    results = copy / "quick"
    assert (results / "tables" / "toy.csv").read_text().startswith("metric,mean\nTAS,0.")
    assert (results / "figures" / "toy.png").exists()
    assert snakemake("toy", "--dry-run", *settings, project=copy).planned == {}
