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
    tables = [rules.table1, rules.order, rules.verdicts, rules.scenarios, rules.maps]
    tables += [rules.frame_rates, rules.orders_today, rules.camera_errors]
    tables += [getattr(rules, f"parameters_{name}") for name in STUDIES]
    return [
        *(
            path
            for folder in FOLDERS
            for path in expand(rules.trials.benchmark, folder=folder, table=study(folder).tables)
        ),
        *(rule.benchmark for rule in tables),
        *expand(rules.run_times.benchmark, study=STUDIES),
        *expand(rules.figure.benchmark, figure=SHOWN),
    ]


@cache
def all_experiments():
    """The settings of the paper's experiments as those of one table."""
    return Table(tuple(sweep for name in EXPERIMENTS for sweep in resolved("trials", name).sweeps))


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
        table1=TABLE1[0],
        order=ORDER[0],
        figures=expand(RESULTS / "figures" / "{figure}.png", figure=SHOWN),
        experiments=lambda wildcards: tables("trials")["records"],
        replicates=lambda wildcards: tables("replicates")["records"],
        thresholds=study_tables("threshold")[:-1],
        threshold_times=expand(RUN_TIMES, study="threshold"),
        threshold_parts=lambda wildcards: tables("trials/threshold_study")["records"],
        registrations=study_tables("registration")[:-1],
        registration_times=expand(RUN_TIMES, study="registration"),
        registration_parts=lambda wildcards: tables("trials/registration_study")["records"],
        findings=SCENARIO_FINDINGS,
        scenarios=lambda wildcards: tables(f"trials/{SCENARIO_STUDY}")["records"],
        maps=THRESHOLD_MAPS[0],
        maps_parts=lambda wildcards: tables("trials/threshold_maps")["records"],
        frame_rates=FRAME_RATES[0],
        frame_rates_parts=lambda wildcards: tables("trials/frame_rate")["records"],
        today=ORDERS_TODAY[0],
        today_parts=lambda wildcards: tables("trials/today")["records"],
    output:
        RESULTS / "report.html",
    params:
        flags="",
        benchmarks=measured,
        settings=GIVEN,
    log:
        RESULTS / "logs" / "report.log",
    benchmark:
        RESULTS / "benchmarks" / "report.tsv"
    shell:
        "{sys.executable:q} -m report {params.flags}"
        " --verdicts {input.verdicts:q} --readings {input.readings:q} --table1 {input.table1:q} --order {input.order:q} --figures {input.figures:q}"
        " --experiments {input.experiments:q} --replicates {input.replicates:q}"
        " --thresholds {input.thresholds:q} --threshold-times {input.threshold_times:q}"
        " --threshold-parts {input.threshold_parts:q}"
        " --registrations {input.registrations:q} --registration-times {input.registration_times:q}"
        " --registration-parts {input.registration_parts:q}"
        " --findings {input.findings:q} --scenarios {input.scenarios:q}"
        " --maps {input.maps:q} --maps-parts {input.maps_parts:q}"
        " --frame-rates {input.frame_rates:q} --frame-rates-parts {input.frame_rates_parts:q}"
        " --today {input.today:q} --today-parts {input.today_parts:q}"
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
