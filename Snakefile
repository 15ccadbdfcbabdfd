# From the Hydra configs to the figures of the paper:
#   snakemake figures                         the whole evaluation
#   snakemake figures --config trials=5       a quick look; any key of configs/ can be set
#   snakemake results/figures/outliers.pdf    one figure and what it needs
#   snakemake claims                          which of the paper's claims hold, from 20 replicates
#   snakemake threshold_study                 what the paper's thresholds cost and gain
#   snakemake threshold_study --config tas_max_threshold=[0.5,1,1.5]    your own values
#   snakemake registration_study              the paper's registration and the refined one
#   snakemake beyond                          what the paper leaves out: paths, errors, outliers
#   snakemake beyond --config scenarios=my.yaml    a study of your own (docs/studies.md)
#   snakemake report                          all of it on one page, results/report.html
import sys
from functools import cache
from hashlib import sha256
from math import ceil, gcd
from pathlib import Path

sys.path.insert(0, workflow.basedir)
from experiments.claims import CLAIMS_FILE, load_claims
from experiments.config import (
    HOW, ConfigError, experiment_names, load, result_settings, to_overrides,
)
from experiments.scenarios import BEYOND, load_study as load_scenarios, study_name
from experiments.study import STUDIES, axis_names, load_study
from figures import FIGURES, HISTOGRAM_EXPERIMENT
from figures import STUDIES as STUDY_FIGURES

REPLICATES = config.pop("replicates", None)
AXES = {key: config.pop(key) for key in axis_names() if key in config}
SCENARIOS = Path(config.pop("scenarios", BEYOND))
OVERRIDES = to_overrides({key: value for key, value in config.items() if key != "n_jobs"})
STUDY_OVERRIDES = to_overrides(AXES)
EXPERIMENTS = experiment_names()
STUDY = study_name(SCENARIOS)


def refuse(error, *overrides):
    """Wrong settings end in one line, before any trial."""
    sys.exit(f"snakemake: {' '.join([str(error), *overrides])}")


def resolve(*overrides):
    try:
        return load(overrides)
    except ConfigError as error:
        refuse(error, f"({' '.join(overrides)})")


@cache
def settings(experiment):
    """What the results of an experiment depend on: where it changes, they are made again."""
    return result_settings(resolve(f"experiment={experiment}", *to_overrides(config)))


@cache
def scenarios():
    """The settings of each scenario, likewise; read where they are needed."""
    try:
        study = load_scenarios(SCENARIOS, to_overrides(config))
    except ConfigError as error:
        refuse(error)
    return {name: result_settings(config) for name, config in study.scenarios.items()}


@cache
def claim_list():
    """The claims with their number of replicates, likewise."""
    try:
        return load_claims(REPLICATES)
    except ConfigError as error:
        refuse(error)


def replicate_records(*extensions):
    numbers = range(claim_list().replicates)
    return expand(RESULTS / "replicates" / "{number}.{ext}", number=numbers, ext=extensions)


@cache
def replicate_plan():
    """What the replicates depend on, in short: Snakemake prints it for each one where it changes."""
    from experiments.replicate import plan  # which takes a while

    try:
        planned = plan(claim_list(), to_overrides(config))
    except ConfigError as error:
        refuse(error)
    trials = [
        (trials, result_settings(settings), wanted) for trials, (settings, wanted) in planned.items()
    ]
    return sha256(repr(trials).encode()).hexdigest()


@cache
def study(name):
    """A study under these settings; read where it is needed."""
    try:
        return load_study(name, STUDY_OVERRIDES + to_overrides(config))
    except ConfigError as error:
        refuse(error)


def part_threads(wildcards):
    """The fixed inputs take a moment; the other parts are few and of very different length."""
    part = study(wildcards.study).parts[wildcards.part]
    return THREADS if part.seeds or "n_jobs" in config else CORES


def part_settings(wildcards):
    """What the trials of a part of a study depend on."""
    return result_settings(study(wildcards.study).parts[wildcards.part].config)


def timed_settings(wildcards):
    """What the run times of a study are measured on."""
    parts = study(wildcards.study).parts.values()
    return [result_settings(part.config) for part in parts if part.seeds]


RUN = resolve(*to_overrides({key: config[key] for key in (*HOW, "trials") if key in config}))
RESULTS = Path(RUN.results_dir)
TRIALS = RESULTS / "trials"
CORES = workflow.cores or 1
if "n_jobs" not in config:
    THREADS = max(1, CORES // len(EXPERIMENTS))  # all experiments may run at once
else:
    THREADS = CORES if RUN.n_jobs == -1 else RUN.n_jobs


def sources(*packages):
    """Imported code is invisible to Snakemake's rerun logic unless it is an input."""
    folders = [Path(workflow.basedir, name) for name in packages]
    return [path for folder in folders for end in ("py", "c") for path in folder.rglob(f"*.{end}")]


ANALYSIS = [  # of the trials, which do not depend on it
    Path(workflow.basedir, "experiments", f"{name}.py")
    for name in (
        "claims",
        "comparison",
        "effects",
        "findings",
        "registration_study",
        "replicate",
        "scenarios",
        "statistics",
        "study_time",
        "threshold_study",
        "verdicts",
    )
]
FILES = [  # of people's own trajectories, which trials have nothing to do with
    Path(workflow.basedir, "alignscores", f"{name}.py")
    for name in (
        "__main__",
        "association",
        "cli",
        "conventions",
        "evo",
        "extras",
        "io",
        "plots",
        "report",
    )
]
TRIAL_CODE = [
    path
    for path in sources("alignscores", "baselines", "experiments")
    if path not in (*ANALYSIS, *FILES)
]


# What a cluster is asked for. Measured (docs/cluster.md): a process takes 140 MB, as does each of the
# two Snakemakes beside it; a replicate of all claims takes 0.7 s for each trial of a cell.
def memory(wildcards, threads):
    """Twice that, and a megabyte for each trial of a cell: rows are held until they are written."""
    return 600 + 300 * threads + RUN.trials


def minutes(wildcards, threads):
    """Six times that, and ten minutes for nodes and file systems that are slow to start."""
    return 10 + ceil(4 * RUN.trials / 60 / threads)


localrules:  # seconds each: not worth a job
    figures,
    figure,
    comparison,
    claims,
    threshold_study,
    registration_study,
    threshold_tables,
    registration_tables,
    study_figure,
    beyond,
    findings,
    findings_figure,
    report,


def records(path, **wildcards):
    """Tables of trials and, beside each, what it rests on: who reads the one checks the other."""
    return expand(f"{path}.{{ext}}", ext=["csv", "json"], **wildcards)


def part_records(name):
    paths = [part.path for part in study(name).parts.values()]
    return [*paths, *(path.with_suffix(".json") for path in paths)]


def study_tables(name):
    """The tables of a study, and what they say in sentences."""
    kinds = [f"{kind}.csv" for kind in STUDY_FIGURES[f"{name}_study"]]
    return [RESULTS / "tables" / f"{name}_study{kind}" for kind in [*kinds, ".md"]]


def study_results(name):
    figures = [RESULTS / "figures" / f"{name}_study.{ext}" for ext in ("pdf", "png")]
    return [*study_tables(name), *figures]


wildcard_constraints:
    replicate=r"\d+",
    scenario=r"\w+",
    experiment="|".join(EXPERIMENTS),
    figure="|".join(FIGURES),
    study="|".join(STUDIES),
    part=r"\w+",


rule figures:
    input:
        expand(RESULTS / "figures" / "{figure}.{ext}", figure=FIGURES, ext=["pdf", "png"]),
        RESULTS / "tables" / "method_comparison.md",


rule experiment:
    input:
        TRIAL_CODE,
    output:
        csv=TRIALS / "{experiment}.csv",
        provenance=TRIALS / "{experiment}.json",
    params:
        settings=lambda wildcards: settings(wildcards.experiment),
    priority: 1 # figures meanwhile would leave a core idle at the end
    threads: THREADS
    resources:
        mem_mb=memory,
        runtime=minutes,
    log:
        RESULTS / "logs" / "{experiment}.log",
    benchmark:
        RESULTS / "benchmarks" / "{experiment}.tsv"
    shell:
        "{sys.executable:q} -m experiments.run experiment={wildcards.experiment} {OVERRIDES:q}"
        " n_jobs={threads} > {log:q} 2>&1"


rule figure:
    input:
        lambda wildcards: records(TRIALS / "{name}", name=FIGURES[wildcards.figure]),
        TRIAL_CODE,
        FILES, # which have a plot of errors
        sources("figures"),
    output:
        pdf=RESULTS / "figures" / "{figure}.pdf",
        png=RESULTS / "figures" / "{figure}.png",
    params:
        settings=lambda wildcards: [
            settings(name) for name in FIGURES[wildcards.figure] or [HISTOGRAM_EXPERIMENT]
        ],
    log:
        RESULTS / "logs" / "figure_{figure}.log",
    benchmark:
        RESULTS / "benchmarks" / "figure_{figure}.tsv"
    shell:
        "{sys.executable:q} -m figures {wildcards.figure} {OVERRIDES:q} > {log:q} 2>&1"


rule comparison:
    input:
        records(TRIALS / "{name}", name=EXPERIMENTS),
        ANALYSIS,
    output:
        csv=RESULTS / "tables" / "method_comparison.csv",
        md=RESULTS / "tables" / "method_comparison.md",
    log:
        RESULTS / "logs" / "comparison.log",
    benchmark:
        RESULTS / "benchmarks" / "comparison.tsv"
    shell:
        "{sys.executable:q} -m experiments.comparison {OVERRIDES:q} > {log:q} 2>&1"


rule replicate:
    input:
        TRIAL_CODE,
        Path(workflow.basedir, "experiments", "replicate.py"),
    output:
        csv=RESULTS / "replicates" / "{replicate}.csv",
        provenance=RESULTS / "replicates" / "{replicate}.json",
    params:
        plan=lambda wildcards: replicate_plan(),
    # The last round leaves no core idle.
    threads: lambda wildcards: CORES // gcd(CORES, claim_list().replicates)
    resources:
        mem_mb=memory,
        runtime=minutes,
    log:
        RESULTS / "logs" / "replicate_{replicate}.log",
    benchmark:
        RESULTS / "benchmarks" / "replicate_{replicate}.tsv"
    shell:
        "{sys.executable:q} -m experiments.replicate {OVERRIDES:q}"
        " replicate={wildcards.replicate} n_jobs={threads} > {log:q} 2>&1"


rule claims:
    input:
        lambda wildcards: replicate_records("csv", "json"),
        CLAIMS_FILE,
        ANALYSIS,
    output:
        claims=RESULTS / "claims.csv",
        decisions=RESULTS / "tables" / "decisions.csv",
    params:
        replicates=lambda wildcards: claim_list().replicates,
    log:
        RESULTS / "logs" / "claims.log",
    benchmark:
        RESULTS / "benchmarks" / "claims.tsv"
    shell:
        "{sys.executable:q} -m experiments.verdicts replicates={params.replicates}"
        " {OVERRIDES:q} > {log:q} 2>&1"


rule threshold_study:
    input:
        study_results("threshold"),


rule registration_study:
    input:
        study_results("registration"),


rule study_part:
    input:
        TRIAL_CODE,
    output:
        csv=TRIALS / "{study}_study" / "{part}.csv",
        provenance=TRIALS / "{study}_study" / "{part}.json",
    params:
        settings=part_settings,
    threads: part_threads
    resources:
        mem_mb=memory,
        runtime=minutes,
    log:
        RESULTS / "logs" / "{study}_study" / "{part}.log",
    benchmark:
        RESULTS / "benchmarks" / "{study}_study" / "{part}.tsv"
    shell:
        "{sys.executable:q} -m experiments.study {wildcards.study} {wildcards.part}"
        " {STUDY_OVERRIDES:q} {OVERRIDES:q} n_jobs={threads} > {log:q} 2>&1"


rule study_time:
    input:
        TRIAL_CODE,
        Path(workflow.basedir, "experiments", "study_time.py"),
    output:
        RESULTS / "tables" / "{study}_study_time.csv",
    params:
        metrics=lambda wildcards: study(wildcards.study).columns,
        scenes=timed_settings,
    threads: CORES # nothing beside it
    resources:
        mem_mb=memory,
        runtime=minutes,
    log:
        RESULTS / "logs" / "{study}_study" / "time.log",
    benchmark:
        RESULTS / "benchmarks" / "{study}_study" / "time.tsv"
    shell:
        "{sys.executable:q} -m experiments.study_time {wildcards.study}"
        " {STUDY_OVERRIDES:q} {OVERRIDES:q} > {log:q} 2>&1"


rule threshold_tables:
    input:
        lambda wildcards: part_records("threshold"),
        RESULTS / "tables" / "threshold_study_time.csv",
        ANALYSIS,
    output:
        study_tables("threshold"),
    log:
        RESULTS / "logs" / "threshold_study.log",
    benchmark:
        RESULTS / "benchmarks" / "threshold_study.tsv"
    shell:
        "{sys.executable:q} -m experiments.threshold_study {STUDY_OVERRIDES:q} {OVERRIDES:q} > {log:q} 2>&1"


rule registration_tables:
    input:
        lambda wildcards: part_records("registration"),
        RESULTS / "tables" / "registration_study_time.csv",
        ANALYSIS,
    output:
        study_tables("registration"),
    log:
        RESULTS / "logs" / "registration_study.log",
    benchmark:
        RESULTS / "benchmarks" / "registration_study.tsv"
    shell:
        "{sys.executable:q} -m experiments.registration_study {STUDY_OVERRIDES:q} {OVERRIDES:q} > {log:q} 2>&1"


rule study_figure:
    input:
        lambda wildcards: study_tables(wildcards.study),
        sources("figures"),
    output:
        pdf=RESULTS / "figures" / "{study}_study.pdf",
        png=RESULTS / "figures" / "{study}_study.png",
    log:
        RESULTS / "logs" / "figure_{study}_study.log",
    benchmark:
        RESULTS / "benchmarks" / "figure_{study}_study.tsv"
    shell:
        "{sys.executable:q} -m figures {wildcards.study}_study {STUDY_OVERRIDES:q} {OVERRIDES:q} > {log:q} 2>&1"


rule beyond:
    input:
        RESULTS / "tables" / f"{STUDY}.csv",
        expand(RESULTS / "figures" / "{name}.{ext}", name=[STUDY, "paths"], ext=["pdf", "png"]),


rule scenario:
    input:
        TRIAL_CODE,
    output:
        csv=TRIALS / STUDY / "{scenario}.csv",
        provenance=TRIALS / STUDY / "{scenario}.json",
    params:
        settings=lambda wildcards: scenarios()[wildcards.scenario],
    threads: THREADS
    resources:
        mem_mb=memory,
        runtime=minutes,
    log:
        RESULTS / "logs" / STUDY / "{scenario}.log",
    benchmark:
        RESULTS / "benchmarks" / STUDY / "{scenario}.tsv"
    shell:
        "{sys.executable:q} -m experiments.scenarios {wildcards.scenario}"
        " --scenarios {SCENARIOS:q} {OVERRIDES:q} n_jobs={threads} > {log:q} 2>&1"


rule findings:
    input:
        lambda wildcards: records(TRIALS / STUDY / "{name}", name=scenarios()),
        ANALYSIS,
    output:
        RESULTS / "tables" / f"{STUDY}.csv",
    log:
        RESULTS / "logs" / f"{STUDY}.log",
    benchmark:
        RESULTS / "benchmarks" / f"{STUDY}.tsv"
    shell:
        "{sys.executable:q} -m experiments.findings --scenarios {SCENARIOS:q}"
        " {OVERRIDES:q} > {log:q} 2>&1"


rule findings_figure:
    input:
        RESULTS / "tables" / f"{STUDY}.csv",
        TRIAL_CODE,
        sources("figures"),
    output:
        expand(RESULTS / "figures" / "{name}.{ext}", name=[STUDY, "paths"], ext=["pdf", "png"]),
    log:
        RESULTS / "logs" / f"figure_{STUDY}.log",
    benchmark:
        RESULTS / "benchmarks" / f"figure_{STUDY}.tsv"
    shell:
        "{sys.executable:q} -m figures.beyond --scenarios {SCENARIOS:q}"
        " {OVERRIDES:q} > {log:q} 2>&1"


rule report:
    input:
        expand(RESULTS / "figures" / "{figure}.png", figure=FIGURES),
        RESULTS / "tables" / "method_comparison.csv",
        RESULTS / "claims.csv",
        RESULTS / "tables" / "decisions.csv",
        expand(TRIALS / "{name}.json", name=EXPERIMENTS),
        lambda wildcards: replicate_records("json"),
        [study_results(name) for name in STUDIES],
        expand(RESULTS / "tables" / "{name}_study_time.csv", name=STUDIES),
        lambda wildcards: [path for name in STUDIES for path in part_records(name)],
        RESULTS / "tables" / f"{STUDY}.csv",
        expand(RESULTS / "figures" / "{name}.png", name=[STUDY, "paths"]),
        lambda wildcards: expand(TRIALS / STUDY / "{name}.json", name=scenarios()),
        [path for path in Path(workflow.basedir, "report").iterdir() if path.is_file()],
    output:
        RESULTS / "report.html",
    params:
        replicates=lambda wildcards: claim_list().replicates,
    log:
        RESULTS / "logs" / "report.log",
    benchmark:
        RESULTS / "benchmarks" / "report.tsv"
    shell:
        "{sys.executable:q} -m report replicates={params.replicates}"
        " --scenarios {SCENARIOS:q} {STUDY_OVERRIDES:q} {OVERRIDES:q} > {log:q} 2>&1"


onsuccess:
    print(f"results in {RESULTS}/")
