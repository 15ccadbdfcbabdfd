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
try:
    CONFIGS = {name: load([f"experiment={name}", *OVERRIDES]) for name in experiment_names()}
except ConfigError as error:
    sys.exit(f"snakemake: {error}")

RESULTS = Path(next(iter(CONFIGS.values())).results_dir)
TRIALS = RESULTS / "trials"
HOW = {"n_jobs", "backend", "results_dir"}  # settings that no result depends on


def sources(*packages):
    """Imported code is invisible to Snakemake's rerun logic unless it is an input."""
    return [path for name in packages for path in Path(workflow.basedir, name).rglob("*.py")]


wildcard_constraints:
    experiment="|".join(CONFIGS),
    figure="|".join(FIGURES),


rule figures:
    input:
        expand(RESULTS / "figures" / "{figure}.{ext}", figure=FIGURES, ext=["pdf", "png"]),


rule experiment:
    input:
        sources("alignscores", "baselines", "experiments"),
    output:
        csv=TRIALS / "{experiment}.csv",
        provenance=TRIALS / "{experiment}.json",
    params:
        settings=lambda wildcards: {
            key: value for key, value in asdict(CONFIGS[wildcards.experiment]).items() if key not in HOW
        },
    threads: max(1, (workflow.cores or 1) // len(CONFIGS))
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


onsuccess:
    figures = sorted((RESULTS / "figures").glob("*.pdf"))
    print(f"{len(figures)} figures (pdf and png) in {RESULTS / 'figures'}/")
