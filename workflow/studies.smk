# What the studies ask of the paper's trials and of others.
#   snakemake claims                          which of the paper's claims hold, from 20 replicates
#   snakemake head_to_head                    which metric orders neighbouring levels best
#   snakemake threshold_study                 what the paper's thresholds cost and gain
#   snakemake threshold_study --config tas_max_threshold=[0.5,1,1.5] results_dir=own    your own values
#   snakemake beyond                          what the paper leaves out: paths, errors, outliers
#   snakemake beyond --config scenarios=my.yaml    a study of your own (docs/how-to/parameter-study.md)
#   snakemake real --config benchmark=my.yaml      which metric distinguishes your own systems
#   snakemake report                          all of it on one page, results/report.html
from functools import wraps

from studies.beyond import SCENARIOS, study_name
from studies.claims.claims import load_claims
from studies.claims.plan import replicates
from studies.real.scores import read_benchmark, sources
from studies.study import find_studies


def in_one_sentence(function):
    """Cache what a function returns; end with one sentence where settings are wrong."""

    @wraps(function)
    @cache
    def call(*arguments):
        try:
            return function(*arguments)
        except ConfigError as error:
            raise SystemExit(f"snakemake: {error}") from None

    return call


STUDIES = find_studies()
CONFIG = to_overrides({key: value for key, value in config.items() if key not in ["n_jobs", "results_dir"]})
MORE = ",".join(config["more"]) if isinstance(config.get("more"), list) else config.get("more", "")
BEYOND = in_one_sentence(study_name)(Path(config.get("scenarios", SCENARIOS)))
STUDY_FIGURES = {  # the function that draws it, and the tables that it shows
    "threshold_study": ("studies.threshold_study.figure:draw", ["threshold_study"]),
    BEYOND: ("studies.beyond.figure:draw", [BEYOND]),
    "real": ("studies.real.figure:draw", ["real", "real_pairs", "real_agreement"]),
}


@in_one_sentence
def tables_of(study):
    """Return the settings of each table of trials of a study."""
    own = {key: config[key] for key in STUDIES[study].keys if key in config}
    return STUDIES[study].plan({**SETTINGS, **own})


if AXES.keys() & config.keys():
    tables_of("threshold_study")  # wrong values end here, whatever the target


def trials_of(study):
    """Return the tables of trials of a study."""
    folder = BEYOND if study == "beyond" else study
    return [RESULTS / "trials" / folder / f"{name}.csv" for name in tables_of(study)]


def overrides_of(wildcards):
    """Return the settings of a table of trials of a study."""
    study = "beyond" if wildcards.study == BEYOND else wildcards.study
    return to_overrides(tables_of(study)[wildcards.table])


@in_one_sentence
def sweeps_of_replicates():
    """Return the sweeps of each replicate study."""
    claims = load_claims(config.get("replicates"))
    return replicates(claims, to_overrides(SETTINGS), range(claims.replicates))


@in_one_sentence
def own_runs():
    """Return the sequences of your own benchmark, each with the files of its runs."""
    if "benchmark" not in config:
        raise ConfigError("real needs --config benchmark=FILE")
    benchmark = read_benchmark(Path(config["benchmark"]))
    return {sequence: sources(benchmark, sequence) for sequence in benchmark.references}


localrules:
    report,
    verdicts,
    orders,
    thresholds,
    scenarios,
    own_runs,
    real_answers,
    study_figure,


wildcard_constraints:
    table=r"\w+",
    study=r"\w+",
    number=r"\d+",


rule claims:
    input:
        RESULTS / "claims.csv",


rule head_to_head:
    input:
        RESULTS / "tables/head_to_head.csv",


rule threshold_study:
    input:
        RESULTS / "tables/threshold_study.csv",
        expand(RESULTS / "figures/threshold_study.{ext}", ext=["pdf", "png"]),


rule beyond:
    input:
        RESULTS / "tables" / f"{BEYOND}.csv",
        expand(RESULTS / "figures/{figure}.{ext}", figure=BEYOND, ext=["pdf", "png"]),


rule real:
    input:
        RESULTS / "tables/real.csv",
        expand(RESULTS / "figures/real.{ext}", ext=["pdf", "png"]),


rule report:
    input:
        ROOT / "report/page.css",
        ROOT / "report/page.html.j2",
        rules.figures.input,
        rules.claims.input,
        rules.head_to_head.input,
        rules.threshold_study.input,
        rules.beyond.input,
        rules.real.input if "benchmark" in config else [],
    output:
        RESULTS / "report.html",
    params:
        folder=RESULTS,
        settings=CONFIG,
        code=lambda w: code("report.__main__"),
    log:
        RESULTS / "logs/report.log",
    shell:
        "python -m report {params.folder:q} --settings {params.settings:q} --output {output:q} > {log:q} 2>&1"


use rule trials as study_trials with:
    input:
        lambda w: wanted(f"trials/{w.study}/{w.table}", overrides_of(w)),
    output:
        RESULTS / "trials/{study}/{table}.csv",
        RESULTS / "trials/{study}/{table}.json",
    params:
        overrides=overrides_of,
        code=lambda w: code("experiments.run"),
    log:
        RESULTS / "logs/trials/{study}/{table}.log",
    benchmark:
        RESULTS / "benchmarks/{study}/{table}.tsv"


rule replicate:
    input:
        lambda w: settings_file(RESULTS, f"replicates/{w.number}", sweeps_of_replicates()[int(w.number)]),
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
        lambda w: [RESULTS / f"replicates/{n}.csv" for n in range(len(sweeps_of_replicates()))],
    output:
        report(RESULTS / "claims.csv", category="Tables", labels={"table": "Claims"}),
        RESULTS / "tables/readings.csv",
        RESULTS / "tables/criteria.csv",
    params:
        study="claims",
        claims=sha256((ROOT / "configs/claims.yaml").read_bytes()).hexdigest(),
        code=lambda w: code("studies.__main__", "studies.claims"),
    threads: workflow.cores
    log:
        RESULTS / "logs/answers/claims.log",
    benchmark:
        RESULTS / "benchmarks/answers/claims.tsv"


use rule table1 as orders with:
    input:
        rules.table1.input,
        lambda w: trials_of("head_to_head"),
    output:
        report(RESULTS / "tables/head_to_head.csv", category="Tables", labels={"table": "Head to head"}),
    params:
        study="head_to_head",
        code=lambda w: code("studies.__main__", "studies.head_to_head"),
    log:
        RESULTS / "logs/answers/head_to_head.log",
    benchmark:
        RESULTS / "benchmarks/answers/head_to_head.tsv"


use rule table1 as thresholds with:
    input:
        lambda w: trials_of("threshold_study"),
    output:
        RESULTS / "tables/threshold_study.csv",
    params:
        study="threshold_study",
        code=lambda w: code("studies.__main__", "studies.threshold_study"),
    log:
        RESULTS / "logs/answers/threshold_study.log",
    benchmark:
        RESULTS / "benchmarks/answers/threshold_study.tsv"


use rule table1 as scenarios with:
    input:
        lambda w: trials_of("beyond"),
    output:
        RESULTS / "tables" / f"{BEYOND}.csv",
    params:
        study="beyond",
        code=lambda w: code("studies.__main__", "studies.beyond"),
    log:
        RESULTS / "logs/answers" / f"{BEYOND}.log",
    benchmark:
        RESULTS / "benchmarks/answers" / f"{BEYOND}.tsv"


rule own_runs:
    input:
        benchmark=config.get("benchmark", []),
        runs=lambda w: own_runs()[w.sequence],
    output:
        RESULTS / "real/own/{sequence}.csv",
    params:
        more=MORE,
        code=lambda w: code("studies.real.__main__", leave_out=()),
    log:
        RESULTS / "logs/real/{sequence}.log",
    benchmark:
        RESULTS / "benchmarks/real/{sequence}.tsv"
    shell:
        "python -m studies.real --benchmark {input.benchmark:q} --sequence {wildcards.sequence:q}"
        " --more={params.more:q} --output {output:q} > {log:q} 2>&1"


rule real_answers:
    input:
        lambda w: [RESULTS / f"real/own/{part}.csv" for part in own_runs()],
    output:
        RESULTS / "tables/real.csv",
        RESULTS / "tables/real_pairs.csv",
        RESULTS / "tables/real_agreement.csv",
    params:
        code=lambda w: code("studies.real.__main__"),
    log:
        RESULTS / "logs/answers/real.log",
    shell:
        "python -m studies.real {input:q} --output {output:q} > {log:q} 2>&1"


use rule figure as study_figure with:
    input:
        lambda w: [RESULTS / f"tables/{table}.csv" for table in STUDY_FIGURES[w.figure][1]],
    output:
        RESULTS / "figures/{figure}.pdf",
        report(RESULTS / "figures/{figure}.png", category="Studies", labels={"figure": "{figure}"}),
    wildcard_constraints:
        figure="|".join(STUDY_FIGURES),
    params:
        draw=lambda w: STUDY_FIGURES[w.figure][0],
        code=lambda w: code("figures.__main__", STUDY_FIGURES[w.figure][0].split(":")[0], leave_out=OF_FIGURES),
