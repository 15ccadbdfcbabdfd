# From the Hydra configs to the figures of the paper:
#   snakemake figures                         the whole evaluation
#   snakemake figures --config trials=5       a quick look; any key of configs/ can be set
#   snakemake results/figures/outliers.pdf    one figure and what it needs
import sys
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, workflow.basedir)
from experiments.config import ConfigError, experiment_names, load, to_overrides
from figures import FIGURES

OVERRIDES = to_overrides(config)
EXPERIMENTS = experiment_names()
RESULTS = Path(config.get("results_dir", load().results_dir))
TRIALS = RESULTS / "trials"
HOW = {"n_jobs", "backend", "results_dir"}  # settings that no result depends on


def settings(experiment):
    """Resolve what an experiment's results depend on; refuse what is wrong before any trial."""
    try:
        resolved = asdict(load([f"experiment={experiment}", *OVERRIDES]))
    except ConfigError as error:
        sys.exit(f"snakemake: {experiment}: {error}")
    return {key: value for key, value in resolved.items() if key not in HOW}


def sources(*packages):
    """Imported code is invisible to Snakemake's rerun logic unless it is an input."""
    return [path for name in packages for path in Path(workflow.basedir, name).rglob("*.py")]


wildcard_constraints:
    experiment="|".join(EXPERIMENTS),
    figure="|".join(FIGURES),


rule figures:
    input:
        expand(RESULTS / "figures" / "{figure}.{ext}", figure=FIGURES, ext=["pdf", "png"]),
        RESULTS / "tables" / "method_comparison.md",


rule experiment:
    input:
        sources("alignscores", "baselines", "experiments"),
    output:
        csv=TRIALS / "{experiment}.csv",
        provenance=TRIALS / "{experiment}.json",
    params:
        settings=lambda wildcards: settings(wildcards.experiment),
    threads: max(1, (workflow.cores or 1) // len(EXPERIMENTS))
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
        sources("alignscores", "experiments", "figures"),
    output:
        pdf=RESULTS / "figures" / "{figure}.pdf",
        png=RESULTS / "figures" / "{figure}.png",
    log:
        RESULTS / "logs" / "figure_{figure}.log",
    benchmark:
        RESULTS / "benchmarks" / "figure_{figure}.tsv"
    shell:
        "{sys.executable:q} -m figures {wildcards.figure} {OVERRIDES:q} > {log:q} 2>&1"


rule comparison:
    input:
        expand(TRIALS / "{name}.csv", name=EXPERIMENTS),
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
