"""Snakemake plans, runs, resumes and reruns what it should, and passes settings on."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import takewhile
from pathlib import Path

import pytest

from experiments.scenarios import load_study
from experiments.study import STUDIES
from experiments.study import load_study as load_parameter_study

ROOT = Path(__file__).resolve().parents[2]
SNAKEFILE = ROOT / "Snakefile"
SMALL = ["trials=2", "sigma_t=[0.02,0.05]", "n_cameras=[25]", "n_outliers=[0,2]"]

Snakemake = Callable[..., subprocess.CompletedProcess[str]]


def command(*arguments: str, profile: str = "default") -> list[str]:
    profiles = ["--profile", str(ROOT / "profiles" / profile)]
    start = [sys.executable, "-m", "snakemake", "--snakefile", str(SNAKEFILE)]
    return [*start, *profiles, *arguments]


@pytest.fixture
def snakemake(tmp_path: Path) -> Snakemake:
    """Run Snakemake with the project's workflow in an empty working directory."""

    def run(*arguments: str, **options: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command(*arguments, **options),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=110,
        )

    return run


def planned(done: subprocess.CompletedProcess[str]) -> dict[str, int]:
    """Jobs of a dry run by rule."""
    assert done.returncode == 0, done.stderr
    lines = (done.stdout + done.stderr).splitlines()
    start = lines.index("Job stats:")
    rows = [line.split() for line in takewhile(str.strip, lines[start + 3 :])]
    jobs = {row[0]: int(row[1]) for row in rows if len(row) == 2 and row[1].isdigit()}
    assert jobs.pop("total") == sum(jobs.values())
    return jobs


def test_figures_needs_eight_experiments_seven_figures_and_the_table(snakemake: Snakemake) -> None:
    jobs = planned(snakemake("figures", "--dry-run"))
    assert jobs == {"experiment": 8, "figure": 7, "comparison": 1, "figures": 1}


@pytest.mark.parametrize(("study", "parts"), [("threshold", 4), ("registration", 12)])
def test_a_study_needs_its_parts_and_no_experiment(
    snakemake: Snakemake, study: str, parts: int
) -> None:
    jobs = planned(snakemake(f"{study}_study", "--dry-run"))
    names = ("study_time", "study_figure", f"{study}_tables", f"{study}_study")
    assert jobs == {"study_part": parts} | dict.fromkeys(names, 1)


def test_another_axis_runs_its_trials_again(snakemake: Snakemake) -> None:
    target = "results/trials/threshold_study/seeds.csv"
    settings = ["trials=1", "registration_prescreen=[inf]", "registration_n_hypotheses=[10]"]
    assert snakemake(target, "--config", *settings).returncode == 0
    for same in (settings, [*settings, "backend=threading", "tas_registration=[pcr99]"]):
        done = snakemake(target, "--dry-run", "--config", *same)
        assert "Nothing to be done" in done.stdout
    other = [*settings, "tas_max_threshold=[0.5,1.5]"]
    assert planned(snakemake(target, "--dry-run", "--config", *other)) == {"study_part": 1}
    wrong = snakemake("threshold_study", "--config", "tas_max_threshold=[-1]")
    assert wrong.returncode != 0
    (line,) = [line for line in wrong.stderr.splitlines() if line.startswith("snakemake: ")]
    assert "max_threshold must be a positive number" in line


def test_one_figure_needs_its_experiment_alone(snakemake: Snakemake) -> None:
    jobs = planned(snakemake("results/figures/outliers.pdf", "--dry-run"))
    assert jobs == {"experiment": 1, "figure": 1}


def test_the_report_needs_everything_and_a_number_of_replicates(snakemake: Snakemake) -> None:
    jobs = planned(snakemake("report", "--dry-run", "--config", "replicates=2"))
    parts = sum(len(load_parameter_study(name).parts) for name in STUDIES)
    scenarios = len(load_study().scenarios)
    assert jobs == {
        **{"experiment": 8, "figure": 7, "comparison": 1},
        **{"replicate": 2, "claims": 1, "report": 1},
        **{"study_part": parts, "study_time": 2, "study_figure": 2},
        **{"threshold_tables": 1, "registration_tables": 1},
        **{"scenario": scenarios, "findings": 1, "findings_figure": 1},
    }


def test_the_report_shows_own_values_and_scenarios(snakemake: Snakemake, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(OWN)
    settings = ["replicates=2", "scenarios=mine.yaml", "tas_quantile=[0.5]"]
    done = snakemake("report", "--dry-run", "--printshellcmds", "--config", *settings)
    assert planned(done)["scenario"] == 2
    (command,) = [line for line in (done.stdout + done.stderr).splitlines() if "-m report" in line]
    assert " replicates=2 --scenarios mine.yaml 'tas_quantile=[0.5]' " in command


def test_the_profile_for_slurm_submits_trials_with_stated_needs_and_nothing_else(
    snakemake: Snakemake,
) -> None:
    settings = ["replicates=2", "trials=100"]
    done = snakemake("claims", "--dry-run", "--config", *settings, profile="slurm")
    assert planned(done) == {"replicate": 2, "claims": 1}
    lines = [line.strip() for line in (done.stdout + done.stderr).splitlines()]
    assert lines.count("rule replicate:") == 2
    needs = [line for line in lines if line.startswith("resources:") and "runtime" in line]
    assert len(needs) == 2
    assert all("runtime=17" in need and "mem_mb=1000" in need for need in needs)
    assert not any(line.startswith("threads:") for line in lines)  # named where more than one


@pytest.mark.parametrize(
    ("target", "submitted"),
    [
        ("figures", {"experiment"}),
        ("beyond", {"scenario"}),
        ("threshold_study", {"study_part", "study_time"}),
        ("registration_study", {"study_part", "study_time"}),
    ],
)
def test_on_a_cluster_what_runs_trials_is_a_job_of_one_core_and_stated_needs(
    snakemake: Snakemake, target: str, submitted: set[str]
) -> None:
    done = snakemake(target, "--dry-run", profile="slurm")
    output = done.stdout + done.stderr
    jobs = re.findall(r"^rule (\w+):\n((?: +.*\n)+)", output, re.MULTILINE)
    assert {name for name, text in jobs if "runtime=" in text and "mem_mb=" in text} == submitted
    assert "threads: " not in output  # named where more than one
    (block,) = re.findall(r"^localrules:.*\n((?:    \w+,\n)+)", SNAKEFILE.read_text(), re.MULTILINE)
    local = set(re.findall(r"\w+", block))
    assert {name for name, _ in jobs} - local == submitted


@pytest.mark.parametrize(
    ("setting", "named"),
    [("trials=0", "trials"), ("trails=5", "trails"), ("n_outliers=[11]", "n_outliers")],
)
def test_wrong_settings_end_with_one_line_before_any_trial(
    snakemake: Snakemake, tmp_path: Path, setting: str, named: str
) -> None:
    done = snakemake("figures", "--config", setting)
    assert done.returncode != 0
    assert "Traceback" not in done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("snakemake: ")]
    assert f"'{named}'" in line
    assert not (tmp_path / "results").exists()


def test_runs_and_reruns(snakemake: Snakemake, tmp_path: Path) -> None:
    target = "results/figures/outliers.pdf"
    done = snakemake(target, "--config", *SMALL)
    assert done.returncode == 0, done.stderr
    assert "results in results/" in done.stdout
    trials = tmp_path / "results" / "trials" / "outliers.csv"
    rows = trials.read_text().splitlines()
    assert len(rows) == 1 + 2 * 2 * 2
    for kind in ("logs", "benchmarks"):
        names = {path.stem for path in (tmp_path / "results" / kind).iterdir()}
        assert names == {"outliers", "figure_outliers"}

    # Nothing is left to do; how it is run changes nothing; another setting does.
    for same in (SMALL, [*SMALL, "backend=threading"]):
        assert "Nothing to be done" in snakemake(target, "--config", *same, "--dry-run").stdout
    more = ["trials=3", *SMALL[1:]]
    jobs = planned(snakemake(target, "--config", *more, "--dry-run"))
    assert jobs == {"experiment": 1, "figure": 1}

    # A lost table comes back bit for bit, and one whose record is lost with it.
    before = trials.read_bytes()
    trials.with_suffix(".json").unlink()
    jobs = planned(snakemake(target, "--config", *SMALL, "--dry-run", "--forcerun", "figure"))
    assert jobs == {"experiment": 1, "figure": 1}
    trials.unlink()
    assert snakemake("results/trials/outliers.csv", "--config", *SMALL).returncode == 0
    assert trials.read_bytes() == before


def test_a_changed_experiment_reruns_itself_alone(snakemake: Snakemake, tmp_path: Path) -> None:
    """Edit files in a copy of the project; replicates depend on it too."""
    copy = tmp_path / "copy"
    packages = ("alignscores", "baselines", "experiments", "figures", "report")
    for name in (*packages, "configs", "profiles"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", copy)
    tables = [f"results/trials/{name}.csv" for name in ("outliers", "rotations")]
    tables += ["results/replicates/0.csv", "results/figures/histogram.png"]
    arguments = ["--snakefile", str(copy / "Snakefile"), "--directory", str(copy), *tables]
    done = snakemake(*arguments, "--config", "trials=1")
    assert done.returncode == 0, done.stderr

    for module, jobs in (
        ("plots", {"figure": 1}),  # which has what the histogram draws
        ("registration", {"experiment": 2, "replicate": 1, "figure": 1}),
    ):
        path = copy / "alignscores" / f"{module}.py"
        code = path.read_text()
        path.write_text(f"{code}# changed\n")
        done = snakemake(*arguments, "--config", "trials=1", "--dry-run")
        assert planned(done) == jobs
        path.write_text(code)

    claims = copy / "configs" / "claims.yaml"
    for old, new, reruns in (
        ("A single outlier blinds", "One outlier blinds", False),
        ("id: outliers-ate-discerns", "id: outliers-ate-sees", False),
        ("n_outliers: [1], sigma_t: [0.01, 0.03,", "n_outliers: [1], sigma_t: [0.01, 0.02,", True),
        ("metric: DTE\n        versus: ATE", "metric: DTE\n        versus: mAA", True),
    ):
        text = claims.read_text()
        assert old in text
        claims.write_text(text.replace(old, new))
        done = snakemake(*arguments, "--config", "trials=1", "--dry-run")
        assert ("Nothing to be done" in done.stdout) != reruns
        assert not reruns or planned(done) == {"replicate": 1}
        claims.write_text(text)

    config = copy / "configs" / "experiment" / "outliers.yaml"
    config.write_text(config.read_text().replace("sigma_r_deg: [3.0]", "sigma_r_deg: [4.0]"))
    done = snakemake(*arguments, "--config", "trials=1", "--dry-run")
    assert planned(done) == {"experiment": 1, "replicate": 1}
    assert "output: results/trials/outliers.csv" in done.stdout + done.stderr
    assert "output: results/trials/rotations.csv" not in done.stdout + done.stderr


def test_trials_need_no_code_that_may_change_without_rerunning_them() -> None:
    left_out = re.findall(
        r"(?:ANALYSIS|FILES) = \[.*?in \(\n(.*?)\)\n\]", SNAKEFILE.read_text(), re.S
    )
    names = [re.findall(r'"(\w+)"', block) for block in left_out]
    packages = ("experiments", "alignscores")
    modules = {
        f"{package}.{name}" for package, of in zip(packages, names, strict=True) for name in of
    }
    assert {"experiments.verdicts", "alignscores.cli"} <= modules
    code = """
import sys
from experiments.config import METRICS, load
from experiments.sweep import sweep
settings = [f"metrics=[{','.join(METRICS)}]", "trials=1", "n_jobs=1", "backend=sequential"]
sweep(load([*settings, "n_cameras=[20]", "n_outliers=[2]", "sigma_t=[0.1]"]))
print(*sys.modules)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert "alignscores.registration" in done.stdout.split()
    assert modules.isdisjoint(done.stdout.split())


OWN = """\
settings: {trials: 2, n_cameras: [20], n_outliers: [0, 4], sigma_t: [0, 0.1], sigma_r_deg: [1, 5]}
scenarios:
  circle: {geometry: orbit}
  wrong_merge: {geometry: orbit, outliers: cluster}
"""


def test_beyond_needs_its_scenarios_a_table_and_a_figure(snakemake: Snakemake) -> None:
    jobs = planned(snakemake("beyond", "--dry-run"))
    scenarios = len(load_study().scenarios)
    assert jobs == {"scenario": scenarios, "findings": 1, "findings_figure": 1, "beyond": 1}


def test_a_study_of_ones_own_runs_and_reruns_what_changed(
    snakemake: Snakemake, tmp_path: Path
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(OWN)
    arguments = ["beyond", "--config", "scenarios=mine.yaml"]
    done = snakemake(*arguments)
    assert done.returncode == 0, done.stderr
    results = tmp_path / "results"
    table = (results / "tables" / "beyond_mine.csv").read_text()
    assert table.count("\ncircle,orbit,gaussian,uniform,10.0,") == 9  # metrics
    assert table.count("\nwrong_merge,orbit,gaussian,cluster,10.0,") == 9
    figures = {path.name for path in (results / "figures").iterdir()}
    assert figures == {"beyond_mine.pdf", "beyond_mine.png", "paths.pdf", "paths.png"}
    for extension in ("csv", "json"):
        assert (results / "trials" / "beyond_mine" / f"circle.{extension}").exists()

    assert "Nothing to be done" in snakemake(*arguments, "--dry-run").stdout
    file.write_text(OWN.replace("outliers: cluster", "outliers: frozen"))
    done = snakemake(*arguments, "--dry-run")
    assert planned(done) == {"scenario": 1, "findings": 1, "findings_figure": 1, "beyond": 1}
    assert "output: results/trials/beyond_mine/wrong_merge.csv" in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("text", "named"),
    [(None, "No such file"), ("scenarios: {a: {geometry: sphere}}", "scenario 'a'")],
)
def test_a_wrong_study_ends_with_one_line_before_any_trial(
    snakemake: Snakemake, tmp_path: Path, text: str | None, named: str
) -> None:
    if text is not None:
        (tmp_path / "mine.yaml").write_text(text)
    done = snakemake("beyond", "--config", "scenarios=mine.yaml")
    assert done.returncode != 0
    assert "Traceback" not in done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("snakemake: ")]
    assert named in line
    assert not (tmp_path / "results").exists()


def test_a_changed_setting_redraws_the_histogram(snakemake: Snakemake) -> None:
    target = "results/figures/histogram.pdf"
    assert snakemake(target).returncode == 0
    assert "Nothing to be done" in snakemake(target, "--dry-run").stdout
    assert planned(snakemake(target, "--dry-run", "--config", "seed=1")) == {"figure": 1}


def test_a_killed_run_goes_on_to_the_same_bytes(snakemake: Snakemake, tmp_path: Path) -> None:
    """Kill it, workers and all, when one table is there and the other is being made."""
    names = ("outliers", "collinear")
    settings = ["trials=300", "n_outliers=[0,10]", "sigma_t=[0.02,0.05]", "metrics=[TAS,DTE]"]

    def arguments(place: str) -> list[str]:
        targets = [f"{place}/trials/{name}.csv" for name in names]
        return [*targets, "--cores", "1", "--config", *settings, f"results_dir={place}"]

    def tables(place: str) -> list[bytes]:
        return [path.read_bytes() for path in sorted((tmp_path / place).rglob("*.csv"))]

    assert snakemake(*arguments("whole")).returncode == 0
    with subprocess.Popen(
        command(*arguments("killed")),
        cwd=tmp_path,
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        # On one core the second job starts when Snakemake has put down the first as done.
        while process.poll() is None and len(list((tmp_path / "killed" / "logs").glob("*"))) < 2:
            time.sleep(0.05)
        time.sleep(1)
        os.killpg(process.pid, signal.SIGKILL)
    assert len(tables("killed")) == 1

    assert planned(snakemake(*arguments("killed"), "--dry-run")) == {"experiment": 1}
    assert snakemake(*arguments("killed")).returncode == 0
    assert tables("killed") == tables("whole")
    assert len(tables("whole")) == 2
