# From the Hydra configs to the figures and tables of the paper.
#   snakemake figures                          the paper's figures and tables, in results/
#   snakemake results/figures/outliers.pdf     one figure and what it needs
#   snakemake figures --config trials=5 results_dir=quick       other settings, in another folder
#   snakemake figures --config 'tas={max_threshold: 2}' results_dir=wide     an option of a metric
#   snakemake results/trials/circle.csv        an experiment of your own, configs/experiment/circle.yaml
# Studies of these and other trials (claims, head_to_head, threshold_study, beyond, real, report) are in
# workflow/studies.smk.
import shlex
import sys
from functools import cache
from hashlib import sha256
from math import ceil
from modulefinder import ModuleFinder
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError

ROOT = Path(workflow.basedir)
sys.path.insert(0, str(ROOT))
shell.prefix(f"PATH={shlex.quote(str(Path(sys.executable).parent))}:$PATH; ")  # so that `python` is this one

from experiments.config import EXPERIMENTS, ConfigError, load, load_sweep, settings_file, to_overrides

FIGURES = {  # with the trials that each shows
    "histogram": ["combined"],
    "outliers": ["outliers"],
    "collinear": ["collinear"],
    "trajectory_length": ["trajectory_length"],
    "rotations": ["rotations"],
    "combined": ["combined"],
    "maa_vs_pas": ["maa_vs_pas_outliers", "maa_vs_pas_length", "maa_vs_pas_collinear"],
}
CAPTIONS = ["outliers", "combined", "maa_vs_pas_outliers", "maa_vs_pas_collinear"]  # with percentages
AXES = yaml.safe_load((ROOT / "studies/threshold_study/axes.yaml").read_text())["axes"]
OTHER_KEYS = {"n_jobs", "results_dir", "replicates", "scenarios", "benchmark", "more", *AXES}
SETTINGS = {key: value for key, value in config.items() if key not in OTHER_KEYS}  # of experiments
RESULTS = Path(str(config.get("results_dir", "results")))
THREADS = config.get("n_jobs", max(1, workflow.cores // len(EXPERIMENTS)))  # processes of an experiment
TRIALS = config.get("trials", 50)


def check_settings():
    """Refuse wrong settings, and other settings than the paper's in its folder."""
    for key in {"experiment", "name", "output"} & set(SETTINGS):
        raise ConfigError(f"setting {key!r} cannot be set: the workflow decides it")
    load(to_overrides({key: config[key] for key in ["n_jobs"] if key in config}))
    for name in EXPERIMENTS if SETTINGS else []:
        sweep = load_sweep(overrides(name))
        if RESULTS.resolve() == Path("results").resolve() and sweep != load_sweep([f"experiment={name}"]):
            raise ConfigError(
                f"{' '.join(to_overrides(SETTINGS))} changes what the paper's figures show; name a folder for "
                "such results, for example: --config results_dir=quick"
            )


def overrides(experiment):
    return to_overrides({"experiment": experiment, **SETTINGS})


def wanted(table, overrides):
    """Return the file of the settings that a table of trials should have."""
    try:
        return settings_file(RESULTS, table, [load_sweep(overrides)])
    except ConfigError as error:  # as in an experiment of your own; without a traceback
        raise SystemExit(f"snakemake: {error}") from None


# What draws figures imports alignscores.show, which trials do not.
OF_FIGURES = "comparison.comparison", "evaluation", "trajectories"


@cache
def code(*modules, leave_out=("comparison.comparison", "evaluation", "show", "trajectories")):
    """Return a digest of some modules of the project and of all that they import of it."""
    # alignscores imports these when they are asked for, which trials do not.
    finder = ModuleFinder([str(ROOT)], excludes=[f"alignscores.{name}" for name in leave_out])
    for module in modules:
        finder.import_hook(module)
    files = {Path(module.__file__) for module in finder.modules.values() if module.__file__}
    files |= {*(ROOT / "alignscores").rglob("*.[ch]")}
    return sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()


try:
    check_settings()
except ConfigError as error:
    raise WorkflowError(str(error)) from None


# Drawing and tables run where Snakemake was started, trials in jobs where there is a cluster.
localrules:
    figures,
    figure,
    captions,
    table1,


wildcard_constraints:
    experiment="|".join(glob_wildcards(ROOT / "configs/experiment/{name}.yaml").name),
    figure=r"\w+",


rule figures:
    default_target: True
    input:
        expand(RESULTS / "figures/{figure}.{ext}", figure=FIGURES, ext=["pdf", "png"]),
        RESULTS / "tables/method_comparison.md",
        RESULTS / "tables/captions.md",


# A row a trial, with a record of settings, seed, versions and commit. It runs again where the record
# differs from the settings that are wanted, and where the code that trials import has changed.
rule trials:
    input:
        lambda w: wanted(f"trials/{w.experiment}", overrides(w.experiment)),
    output:
        RESULTS / "trials/{experiment}.csv",
        RESULTS / "trials/{experiment}.json",
    params:
        overrides=lambda w: overrides(w.experiment),
        code=lambda w: code("experiments.run"),
    priority: 1
    threads: workflow.cores if THREADS == -1 else THREADS
    resources:  # twice the megabytes and nine times the minutes that were measured, and ten for slow nodes
        mem_mb=lambda w, threads: 600 + 300 * threads + TRIALS,
        runtime=lambda w, threads: 10 + ceil(14 * TRIALS / 60 / threads),
    log:
        RESULTS / "logs/trials/{experiment}.log",
    benchmark:
        RESULTS / "benchmarks/trials/{experiment}.tsv"
    shell:
        "python -m experiments.run {params.overrides:q} n_jobs={threads} output={output[0]:q}"
        " hydra.run.dir=. hydra.output_subdir=null > {log:q} 2>&1"


rule figure:
    input:
        lambda w: expand(RESULTS / "trials/{name}.csv", name=FIGURES[w.figure]),
    output:
        RESULTS / "figures/{figure}.pdf",
        report(RESULTS / "figures/{figure}.png", category="Figures", labels={"figure": "{figure}"}),
    wildcard_constraints:
        figure="|".join(FIGURES),
    params:
        draw="{figure}",
        code=lambda w: code("figures.__main__", leave_out=OF_FIGURES),
    log:
        RESULTS / "logs/figures/{figure}.log",
    benchmark:
        RESULTS / "benchmarks/figures/{figure}.tsv"
    shell:
        "python -m figures {params.draw} {input:q} --output {output:q} > {log:q} 2>&1"


rule captions:
    input:
        expand(RESULTS / "trials/{name}.csv", name=CAPTIONS),
    output:
        RESULTS / "tables/captions.csv",
        report(RESULTS / "tables/captions.md", category="Tables", labels={"table": "Captions"}),
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
        report(RESULTS / "tables/method_comparison.md", category="Tables", labels={"table": "Table 1"}),
    params:
        study="paper",
        code=lambda w: code("studies.__main__", "studies.paper"),
    log:
        RESULTS / "logs/answers/paper.log",
    benchmark:
        RESULTS / "benchmarks/answers/paper.tsv"
    shell:
        "python -m studies {params.study} {input:q} --output {output:q} --n_jobs {threads} > {log:q} 2>&1"


include: "workflow/studies.smk"
