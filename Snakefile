# From the Hydra configs to the figures and tables of the paper, and the studies of these and other trials.
#   snakemake figures                          the paper's figures and tables, in results/
#   snakemake results/trials/outliers.csv      the trials of one of them
#   snakemake figures --config trials=5 results_dir=quick       other settings, in another folder
#   snakemake figures --config 'tas={max_threshold: 2}' results_dir=wide     an option of a metric
#   snakemake results/trials/circle.csv        an experiment of your own, configs/experiment/circle.yaml
#   snakemake claims                           which of the paper's claims hold, from 20 replicates
#   snakemake readings                         what could give the caption's -59 %
#   snakemake head_to_head                     which metric orders neighbouring levels best
#   snakemake threshold_study                  what the paper's thresholds cost and gain
#   snakemake threshold_study --config tas_max_threshold=[0.5,1,1.5] results_dir=own    your own values
#   snakemake beyond                           what the paper leaves out: paths, errors, outliers
#   snakemake beyond --config scenarios=my.yaml    a study of your own (docs/how-to/parameter-study.md)
#   snakemake report                           all of it in one file, results/report.html
import shlex
import sys
from contextlib import suppress
from functools import cache, partial
from hashlib import sha256
from importlib import import_module
from math import ceil
from modulefinder import ModuleFinder
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError

ROOT = Path(workflow.basedir)
sys.path.insert(0, str(ROOT))
shell.prefix(f"PATH={shlex.quote(str(Path(sys.executable).parent))}:$PATH; ")  # so that `python` is this one

from experiments.config import EXPERIMENTS, ConfigError, load, load_sweep, settings_file, to_overrides

POSITIONS = ["outliers", "collinear", "trajectory_length"]  # figures of section 6.1, and their trials
POSES = ["histogram", "rotations", "combined", "maa_vs_pas"]  # figures of sections 6.2 and 6.3
# The order in which experiments start: those of POSITIONS, whose figures are then drawn while others
# run, so that at the end one core draws and one makes Table 1; then the longest first.
START = [*POSITIONS, "maa_vs_pas_outliers", "combined", "maa_vs_pas_collinear"]
START += ["maa_vs_pas_length", "rotations"]
CLAIMS_FILES = ["configs/claims.yaml", "studies/claims.html.j2"]
CAPTIONS = ["outliers", "combined", "maa_vs_pas_outliers", "maa_vs_pas_collinear"]  # with percentages
AXES = list(yaml.safe_load((ROOT / "studies/thresholds.yaml").read_text())["axes"])
OWN_KEYS = {"threshold_study": AXES, "beyond": ["scenarios"], "claims": ["replicates"]}
OTHER_KEYS = {"n_jobs", "results_dir", *sum(OWN_KEYS.values(), [])}
SETTINGS = {key: value for key, value in config.items() if key not in OTHER_KEYS}  # of experiments
RESULTS = Path(str(config.get("results_dir", "results")))
THREADS = config.get("n_jobs", max(1, workflow.cores // len(EXPERIMENTS)))  # processes of an experiment
TRIALS = config.get("trials", 50)
NAMES = glob_wildcards(ROOT / "configs/experiment/{name}.yaml").name  # of experiments, your own as well


def check_settings():
    """Refuse wrong settings, and other settings than the paper's in its folder."""
    for key in {"experiment", "name", "output"} & set(SETTINGS):
        raise ConfigError(f"setting {key!r} cannot be set: the workflow decides it")
    load(to_overrides({key: config[key] for key in ["n_jobs"] if key in config}))
    wrong = {}
    for name in EXPERIMENTS if SETTINGS else []:
        try:
            sweep = load_sweep(overrides(name))
        except ConfigError as error:  # of some experiments only: an error where they are wanted
            wrong[name] = error
            continue
        if RESULTS.resolve() == Path("results").resolve() and sweep != load_sweep([f"experiment={name}"]):
            raise ConfigError(
                f"{' '.join(to_overrides(SETTINGS))} changes what the paper's figures show; name a folder for "
                "such results, for example: --config results_dir=quick"
            )
    if len(wrong) == len(EXPERIMENTS):
        raise wrong["outliers"]
    if config.keys() & AXES:
        tables_of("threshold_study")  # wrong values end here, whatever the target


def overrides(experiment):
    return to_overrides({"experiment": experiment, **SETTINGS})


@cache
def tables_of(study):
    """Return the settings of each table of trials of a study, by its name."""
    keys = OWN_KEYS.get("beyond" if study == BEYOND else study, [])
    plan = import_module(STUDIES[study]).plan
    return plan({**SETTINGS, **{key: config[key] for key in keys if key in config}})


@cache
def sweeps_of_replicates():
    """Return the sweeps of each replicate study of the claims."""
    claims = import_module("studies.claims")
    known = claims.load_claims(config.get("replicates"))
    return claims.plan_replicates(known, to_overrides(SETTINGS), range(known.replicates))


def in_one_sentence(function, *arguments):
    """Call a function; end with one sentence, without a traceback, where settings are wrong."""
    try:
        return function(*arguments)
    except ConfigError as error:
        raise SystemExit(f"snakemake: {error}") from None


def trials_of(study):
    """Return the tables of trials of a study."""
    return [RESULTS / "trials" / study / f"{name}.csv" for name in in_one_sentence(tables_of, study)]


def overrides_of(wildcards):
    """Return the settings of a table of trials of a study."""
    return to_overrides(in_one_sentence(tables_of, wildcards.study)[wildcards.table])


def wanted(table, overrides):
    """Return the file of the settings that a table of trials should have."""
    return in_one_sentence(lambda: settings_file(RESULTS, table, [load_sweep(overrides)]))


@cache
def write_settings():
    """Write the settings of all experiments at once: Snakemake looks only once into a folder."""
    for name in NAMES:
        with suppress(ConfigError):  # an error where it is wanted
            settings_file(RESULTS, f"trials/{name}", [load_sweep(overrides(name))])


def wanted_trials(wildcards):
    """Return the file of the settings that the trials of an experiment should have."""
    write_settings()
    return wanted(f"trials/{wildcards.experiment}", overrides(wildcards.experiment))


def wanted_replicate(number):
    """Return the file of the settings that a replicate study should have."""
    sweeps = in_one_sentence(sweeps_of_replicates)[number]
    return settings_file(RESULTS, f"replicates/{number}", sweeps)


# What draws figures imports alignscores.show, which trials do not.
OF_FIGURES = "comparison.comparison", "evaluation", "io"


@cache
def code(*modules, leave_out=("comparison.comparison", "evaluation", "io", "show")):
    """Return a digest of some modules of the project and of all that they import of it."""
    # alignscores imports these when they are asked for, which trials do not.
    finder = ModuleFinder([str(ROOT)], excludes=[f"alignscores.{name}" for name in leave_out])
    for module in modules:
        finder.import_hook(module)
    files = {Path(module.__file__) for module in finder.modules.values() if module.__file__}
    files |= {*(ROOT / "alignscores").rglob("*.[ch]")}
    return sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()


def name_of_beyond():
    """Return the name of the results of a file of scenarios."""
    if "scenarios" not in config:
        return "beyond"
    return in_one_sentence(import_module("studies.beyond").study_name, Path(config["scenarios"]))


BEYOND = name_of_beyond()
# Imported where their trials are wanted: pandas and Matplotlib take half a second.
STUDIES = {
    "head_to_head": "studies.head_to_head",
    "threshold_study": "studies.thresholds",
    BEYOND: "studies.beyond",
}
try:
    check_settings()
except ConfigError as error:
    raise WorkflowError(str(error)) from None


report: "report/workflow.rst"


# Drawing and tables run where Snakemake was started, trials in jobs where there is a cluster.
localrules:
    figures,
    position_figures,
    pose_figures,
    captions,
    table1,
    verdicts,
    orders,
    threshold_effects,
    scenarios,
    study_figure,
    report,


wildcard_constraints:
    experiment="|".join(NAMES),
    figure=r"\w+",
    study=r"\w+",
    table=r"\w+",
    number=r"\d+",


# The paper's figures and tables.


rule figures:
    default_target: True
    input:
        expand(RESULTS / "figures/{figure}.{ext}", figure=[*POSITIONS, *POSES], ext=["pdf", "png"]),
        RESULTS / "tables/method_comparison.md",
        RESULTS / "tables/captions.md",


# A row a trial, with a record of settings, seed, versions and commit. It runs again where the record
# differs from the settings that are wanted, and where the code that trials import has changed.
rule trials:
    input:
        wanted_trials,
    output:
        RESULTS / "trials/{experiment}.csv",
        RESULTS / "trials/{experiment}.json",
    params:
        overrides=lambda w: overrides(w.experiment),
        table=lambda w, output: to_overrides({"output": output[0]}),
        code=lambda w: code("experiments.run"),
    priority: lambda w: len(START) - [*START, w.experiment].index(w.experiment)
    threads: workflow.cores if THREADS == -1 else THREADS
    resources:  # twice the megabytes and nine times the minutes that were measured, and ten for slow nodes
        mem_mb=lambda w, threads: 600 + 300 * threads + TRIALS,
        runtime=lambda w, threads: 10 + ceil(14 * TRIALS / 60 / threads),
    log:
        RESULTS / "logs/trials/{experiment}.log",
    benchmark:
        RESULTS / "benchmarks/trials/{experiment}.tsv"
    shell:
        "python -m experiments.run {params.overrides:q} n_jobs={threads} {params.table:q}"
        " hydra.run.dir=. hydra.output_subdir=null > {log:q} 2>&1"


def pictures(figures):
    """Return the PNG of each figure, with its caption in the report."""
    flag = partial(report, category="Figures")
    captions = {figure: f"report/figures/{figure}.rst" for figure in figures}
    return [
        flag(RESULTS / f"figures/{figure}.png", labels={"figure": figure}, caption=caption)
        for figure, caption in captions.items()
    ]


# Several in a process: importing Matplotlib takes nearly as long as drawing a figure.
rule position_figures:
    input:
        expand(RESULTS / "trials/{name}.csv", name=POSITIONS),
    output:
        expand(RESULTS / "figures/{figure}.pdf", figure=POSITIONS),
        pictures(POSITIONS),
    params:
        trials=RESULTS / "trials",
        draw=POSITIONS,
        figures=RESULTS / "figures",
        code=lambda w: code("figures.__main__", leave_out=OF_FIGURES),
    priority: len(START)
    log:
        RESULTS / "logs/figures/positions.log",
    benchmark:
        RESULTS / "benchmarks/figures/positions.tsv"
    shell:
        "python -m figures paper {params.trials:q} {params.draw} --output {params.figures:q} > {log:q} 2>&1"


use rule position_figures as pose_figures with:
    input:
        expand(RESULTS / "trials/{name}.csv", name=[name for name in EXPERIMENTS if name not in POSITIONS]),
    output:
        expand(RESULTS / "figures/{figure}.pdf", figure=POSES),
        pictures(POSES),
    params:
        trials=RESULTS / "trials",
        draw=POSES,
        figures=RESULTS / "figures",
        code=lambda w: code("figures.__main__", leave_out=OF_FIGURES),
    priority: 0
    log:
        RESULTS / "logs/figures/poses.log",
    benchmark:
        RESULTS / "benchmarks/figures/poses.tsv"


rule captions:
    input:
        expand(RESULTS / "trials/{name}.csv", name=CAPTIONS),
    output:
        RESULTS / "tables/captions.csv",
        report(
            RESULTS / "tables/captions.md",
            category="Tables",
            caption="report/table.rst",
            labels={"table": "Captions"},
        ),
    params:
        code=lambda w: code("figures.captions"),
    log:
        RESULTS / "logs/captions.log",
    benchmark:
        RESULTS / "benchmarks/captions/captions.tsv"
    shell:
        "python -m figures.captions {input:q} --output {output:q} > {log:q} 2>&1"


rule table1:
    input:
        expand(RESULTS / "trials/{name}.csv", name=EXPERIMENTS),
    output:
        RESULTS / "tables/method_comparison.csv",
        report(
            RESULTS / "tables/method_comparison.md",
            category="Tables",
            caption="report/table.rst",
            labels={"table": "Table 1"},
        ),
    params:
        study="table1",
        code=lambda w: code("studies.__main__", "studies.table1"),
    log:
        RESULTS / "logs/answers/table1.log",
    benchmark:
        RESULTS / "benchmarks/answers/table1.tsv"
    shell:
        "python -m studies {params.study} {input:q} --output {output:q} --n_jobs {threads} > {log:q} 2>&1"


# Claims: independent replicate studies, and the verdicts that they give.


rule claims:
    input:
        RESULTS / "claims.csv",
        RESULTS / "claims.html",


rule replicate:
    input:
        lambda w: wanted_replicate(int(w.number)),
    output:
        RESULTS / "replicates/{number}.csv",
        RESULTS / "replicates/{number}.json",
    params:
        overrides=to_overrides(SETTINGS),
        code=lambda w: code("experiments.run"),
    priority: 1
    threads: workflow.cores if THREADS == -1 else THREADS
    resources:
        mem_mb=lambda w, threads: 600 + 300 * threads + TRIALS,
        runtime=lambda w, threads: 10 + ceil(14 * TRIALS / 60 / threads),
    log:
        RESULTS / "logs/replicates/{number}.log",
    benchmark:
        RESULTS / "benchmarks/replicates/{number}.tsv"
    shell:
        "python -m studies.claims {wildcards.number} {params.overrides:q} n_jobs={threads} output={output[0]:q}"
        " > {log:q} 2>&1"


use rule table1 as verdicts with:
    input:
        lambda w: [RESULTS / f"replicates/{n}.csv" for n in range(len(in_one_sentence(sweeps_of_replicates)))],
    output:
        RESULTS / "claims.csv",
        RESULTS / "tables/readings.csv",
        RESULTS / "tables/criteria.csv",
        report(
            RESULTS / "claims.html",
            category="Claims",
            caption="report/claims.rst",
            labels={"page": "All statements"},
        ),
    params:
        study="claims",
        files=[sha256((ROOT / name).read_bytes()).hexdigest() for name in CLAIMS_FILES],
        code=lambda w: code("studies.__main__", "studies.claims"),
    threads: workflow.cores
    log:
        RESULTS / "logs/answers/claims.log",
    benchmark:
        RESULTS / "benchmarks/answers/claims.tsv"


rule readings:
    output:
        RESULTS / "tables/minus59.csv",
        report(
            RESULTS / "tables/minus59.md",
            category="Tables",
            caption="report/table.rst",
            labels={"table": "Readings of -59 %"},
        ),
    params:
        overrides=to_overrides(SETTINGS),
        code=lambda w: code("studies.readings"),
    threads: workflow.cores if THREADS == -1 else THREADS
    resources:
        mem_mb=lambda w, threads: 600 + 300 * threads + TRIALS,
        runtime=lambda w, threads: 10 + ceil(100 * TRIALS / 60 / threads),
    log:
        RESULTS / "logs/readings.log",
    benchmark:
        RESULTS / "benchmarks/readings/readings.tsv"
    shell:
        "python -m studies.readings {params.overrides:q} --n_jobs {threads} --output {output:q} > {log:q} 2>&1"


# Studies of other trials: a table of answers, and a figure where there is something to see.


use rule trials as study_trials with:
    input:
        lambda w: wanted(f"trials/{w.study}/{w.table}", overrides_of(w)),
    output:
        RESULTS / "trials/{study}/{table}.csv",
        RESULTS / "trials/{study}/{table}.json",
    params:
        overrides=overrides_of,
        table=lambda w, output: to_overrides({"output": output[0]}),
        code=lambda w: code("experiments.run"),
    priority: 1
    log:
        RESULTS / "logs/trials/{study}/{table}.log",
    benchmark:
        RESULTS / "benchmarks/{study}/{table}.tsv"


rule head_to_head:
    input:
        RESULTS / "tables/head_to_head.csv",


use rule table1 as orders with:
    input:
        rules.table1.input,
        lambda w: trials_of("head_to_head"),
    output:
        report(
            RESULTS / "tables/head_to_head.csv",
            category="Tables",
            caption="report/table.rst",
            labels={"table": "Head to head"},
        ),
    params:
        study="head_to_head",
        code=lambda w: code("studies.__main__", "studies.head_to_head"),
    log:
        RESULTS / "logs/answers/head_to_head.log",
    benchmark:
        RESULTS / "benchmarks/answers/head_to_head.tsv"


rule threshold_study:
    input:
        RESULTS / "tables/threshold_study.csv",
        expand(RESULTS / "figures/threshold_study.{ext}", ext=["pdf", "png"]),


use rule table1 as threshold_effects with:
    input:
        lambda w: trials_of("threshold_study"),
    output:
        RESULTS / "tables/threshold_study.csv",
    params:
        study="thresholds",
        code=lambda w: code("studies.__main__", "studies.thresholds"),
    log:
        RESULTS / "logs/answers/threshold_study.log",
    benchmark:
        RESULTS / "benchmarks/answers/threshold_study.tsv"


rule beyond:
    input:
        RESULTS / "tables" / f"{BEYOND}.csv",
        expand(RESULTS / "figures/{figure}.{ext}", figure=BEYOND, ext=["pdf", "png"]),


use rule table1 as scenarios with:
    input:
        lambda w: trials_of(BEYOND),
    output:
        RESULTS / "tables" / f"{BEYOND}.csv",
    params:
        study="beyond",
        code=lambda w: code("studies.__main__", "studies.beyond"),
    log:
        RESULTS / "logs/answers" / f"{BEYOND}.log",
    benchmark:
        RESULTS / "benchmarks/answers" / f"{BEYOND}.tsv"


STUDY_FIGURES = {"threshold_study": "studies.thresholds:draw", BEYOND: "studies.beyond:draw"}


rule study_figure:
    input:
        RESULTS / "tables/{figure}.csv",
    output:
        RESULTS / "figures/{figure}.pdf",
        report(
            RESULTS / "figures/{figure}.png",
            category="Studies",
            caption="report/study.rst",
            labels={"figure": "{figure}"},
        ),
    wildcard_constraints:
        figure="|".join(STUDY_FIGURES),
    params:
        draw=lambda w: STUDY_FIGURES[w.figure],
        code=lambda w: code("figures.__main__", STUDY_FIGURES[w.figure].split(":")[0], leave_out=OF_FIGURES),
    log:
        RESULTS / "logs/figures/{figure}.log",
    benchmark:
        RESULTS / "benchmarks/figures/{figure}.tsv"
    shell:
        "python -m figures {params.draw} {input:q} --output {output:q} > {log:q} 2>&1"


# Everything in one file, by Snakemake itself; it needs the extra `reports`.
REPORTED = [
    *rules.figures.input,
    *rules.claims.input,
    *rules.readings.output,
    *rules.head_to_head.input,
    *rules.threshold_study.input,
    *rules.beyond.input,
]


rule report:
    input:
        REPORTED,
    output:
        RESULTS / "report.html",
    params:
        snakefile=workflow.snakefile,
        targets=REPORTED,
        settings=[f"{key}={value}" for key, value in config.items()],
    log:
        RESULTS / "logs/report.log",
    shell:
        "python -m snakemake --snakefile {params.snakefile:q} --cores 1 --nolock --report {output:q}"
        " {params.targets:q} --config {params.settings:q} > {log:q} 2>&1"
