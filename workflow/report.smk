# Everything on one page, one to play with, and the article, which is made of the same.
CAMERA_ERRORS = [RESULTS / "tables" / f"camera_errors.{ext}" for ext in ("npz", "json")]
EXPLORER = RESULTS / "explorer.html"
PAGE_CODE = [
    path
    for folder in ("report", "alignscores/explorer")
    for path in sorted(Path(workflow.basedir, folder).iterdir())
    if path.is_file()
]
ARTICLE = [RESULTS / "article.html", *([RESULTS / "article.pdf"] if browser() else [])]
GIVEN = [  # to repeat it
    *chosen(key for key in config if key not in (*EXECUTION, "scenarios")),
    *(to_overrides({"scenarios": SCENARIO_FILE.name}) if "scenarios" in config else []),
]
SHOWN = [SCENARIO_STUDY if name == "beyond" else name for name in FIGURES]


def measured(wildcards):
    """Where Snakemake writes what it measured of the jobs that made the inputs."""
    return [
        *(
            path
            for folder in FOLDERS
            for path in expand(rules.trials.benchmark, folder=folder, table=study(folder).tables)
        ),
        *(rule.benchmark for rule in (rules.verdicts, rules.camera_errors)),
        *(RESULTS / "benchmarks" / "tables" / f"{made(name)[-1].stem}.tsv" for name in FINDINGS),
        *expand(rules.run_times.benchmark, study=STUDIES),
        *expand(rules.figure.benchmark, figure=SHOWN),
    ]


def as_options(wildcards, input):
    """The inputs that have a name, as options of `python -m report`."""
    named = {name: [files] if isinstance(files, str) else files for name, files in input.items()}
    return [word for name, files in named.items() for word in (f"--{name}", *files)]


@cache
def all_experiments():
    """The settings of the paper's experiments as those of one table; each has scores."""
    sweeps = [sweep for name in EXPERIMENTS for sweep in resolved("trials", name).sweeps]
    for sweep in sweeps:
        or_end(errors_of_scores, sweep)
    return Table(tuple(sweeps))


rule camera_errors:
    input:
        TRIAL_CODE,
    output:
        CAMERA_ERRORS,
    params:
        digest=lambda wildcards: all_experiments().digest,
        table=lambda wildcards: all_experiments(),
    threads: lambda wildcards: share_of(1)
    resources:
        mem_mb=900,
        runtime=20,
    log:
        RESULTS / "logs" / "tables" / "camera_errors.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "camera_errors.tsv"
    shell:
        "{sys.executable:q} -m experiments.camera_errors --sweeps {params.table.json:q}"
        " --output {output[0]:q} {EXECUTED:q} n_jobs={threads} > {log:q} 2>&1"


rule explorer:
    input:
        PAGE_CODE,
        TRIAL_CODE,
        FIGURE_CODE,
        CAMERA_ERRORS[1],
        errors=CAMERA_ERRORS[0],
    output:
        EXPLORER,
    log:
        RESULTS / "logs" / "explorer.log",
    shell:
        "{sys.executable:q} -m report.explorer {input.errors:q} --output {output:q} > {log:q} 2>&1"


rule report:
    input:
        EXPLORER,
        PAGE_CODE,
        sorted(Path(workflow.basedir, "docs", "article").glob("article.*")),
        STUDY_CODE,
        CLAIMS_FILE,
        [study_file(name) for name in STUDIES],
        verdicts=VERDICTS[0],
        readings=VERDICTS[1],
        table1=made("table1")[0],
        order=made("order")[0],
        order_parts=lambda wildcards: tables("trials/halves")["records"],
        figures=expand(RESULTS / "figures" / "{figure}.png", figure=SHOWN),
        experiments=lambda wildcards: tables("trials")["records"],
        replicates=lambda wildcards: tables("replicates")["records"],
        thresholds=made("threshold")[:-1],
        threshold_times=expand(RUN_TIMES, study="threshold"),
        threshold_parts=lambda wildcards: tables("trials/threshold_study")["records"],
        registrations=made("registration")[:-1],
        registration_times=expand(RUN_TIMES, study="registration"),
        registration_parts=lambda wildcards: tables("trials/registration_study")["records"],
        findings=made("scenarios"),
        scenarios=lambda wildcards: tables(f"trials/{SCENARIO_STUDY}")["records"],
        maps=made("threshold_maps")[0],
        maps_parts=lambda wildcards: tables("trials/threshold_maps")["records"],
        frame_rates=made("frame_rate")[0],
        frame_rates_parts=lambda wildcards: tables("trials/frame_rate")["records"],
        today=made("today")[0],
        today_parts=lambda wildcards: tables("trials/today")["records"],
    output:
        RESULTS / "report.html",
    params:
        flags="",
        files=as_options,
        benchmarks=measured,
        settings=GIVEN,
    log:
        RESULTS / "logs" / "report.log",
    benchmark:
        RESULTS / "benchmarks" / "report.tsv"
    shell:
        "{sys.executable:q} -m report {params.flags} {params.files:q}"
        " --benchmarks {params.benchmarks:q} --settings {params.settings:q} --output {output:q}"
        " > {log:q} 2>&1"


rule crate:
    input:
        rules.report.output,
        expand(FIGURE, figure=SHOWN, ext=["pdf", "png"]),
    output:
        RESULTS / "ro-crate-metadata.json",
    shell:
        "{sys.executable:q} -m report.crate {RESULTS:q}"


use rule report as article_page with:
    output:
        ARTICLE[0],
    params:
        flags="--article",
        files=as_options,
        benchmarks=measured,
        settings=GIVEN,
    log:
        RESULTS / "logs" / "article.log",
    benchmark:
        RESULTS / "benchmarks" / "article.tsv"


rule article_pdf:
    input:
        ARTICLE[0],
    output:
        RESULTS / "article.pdf",
    log:
        RESULTS / "logs" / "article_pdf.log",
    shell:
        "{sys.executable:q} -m report.pdf {input:q} --output {output:q} > {log:q} 2>&1"
