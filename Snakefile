# From the Hydra configs to the figures of the paper:
#   snakemake figures                         the whole evaluation
#   snakemake figures --config trials=5       a quick look; any key of configs/ can be set
#   snakemake results/figures/outliers.pdf    one figure and what it needs
import sys
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, workflow.basedir)
from experiments.config import ConfigError, experiment_names, load, to_overrides
from figures import FIGURES, HISTOGRAM_EXPERIMENT

OVERRIDES = to_overrides({key: value for key, value in config.items() if key != "n_jobs"})
EXPERIMENTS = experiment_names()
HOW = {"n_jobs", "backend", "results_dir"}  # settings that no result depends on


def resolve(*overrides):
    """Refuse wrong settings in one line, before any trial."""
    try:
        return asdict(load(overrides))
    except ConfigError as error:
        sys.exit(f"snakemake: {error} ({' '.join(overrides)})")


def settings(experiment):
    """What the results of an experiment depend on: where it changes, they are made again."""
    resolved = resolve(f"experiment={experiment}", *to_overrides(config))
    return {key: value for key, value in resolved.items() if key not in HOW}


RUN = resolve(*to_overrides({key: config[key] for key in HOW if key in config}))
RESULTS = Path(RUN["results_dir"])
TRIALS = RESULTS / "trials"
CORES = workflow.cores or 1
if "n_jobs" not in config:
    THREADS = max(1, CORES // len(EXPERIMENTS))  # all experiments may run at once
else:
    THREADS = CORES if RUN["n_jobs"] == -1 else RUN["n_jobs"]


def sources(*packages):
    """Imported code is invisible to Snakemake's rerun logic unless it is an input."""
    return [path for name in packages for path in Path(workflow.basedir, name).rglob("*.py")]


COMPARISON = Path(workflow.basedir, "experiments", "comparison.py")
TRIAL_CODE = [
    path for path in sources("alignscores", "baselines", "experiments") if path != COMPARISON
]


wildcard_constraints:
    experiment="|".join(EXPERIMENTS),
    figure="|".join(FIGURES),


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
    threads: THREADS
    log:
        RESULTS / "logs" / "{experiment}.log",
    benchmark:
        RESULTS / "benchmarks" / "{experiment}.tsv"
    shell:
        "{sys.executable:q} -m experiments.run experiment={wildcards.experiment} {OVERRIDES:q}"
        " n_jobs={threads} > {log:q} 2>&1"


rule figure:
    input:
        lambda wildcards: expand(TRIALS / "{name}.csv", name=FIGURES[wildcards.figure]),
        TRIAL_CODE,
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
        expand(TRIALS / "{name}.csv", name=EXPERIMENTS),
        COMPARISON,
    output:
        csv=RESULTS / "tables" / "method_comparison.csv",
        md=RESULTS / "tables" / "method_comparison.md",
    log:
        RESULTS / "logs" / "comparison.log",
    benchmark:
        RESULTS / "benchmarks" / "comparison.tsv"
    shell:
        "{sys.executable:q} -m experiments.comparison {OVERRIDES:q} > {log:q} 2>&1"


onsuccess:
    print(f"figures in {RESULTS / 'figures'}/, tables in {RESULTS / 'tables'}/")
