# What is asked of the trials: tables of findings.
TABLE1 = [RESULTS / "tables" / f"method_comparison.{ext}" for ext in ("csv", "md")]
ORDER = [RESULTS / "tables" / f"order.{ext}" for ext in ("csv", "md")]
VERDICTS = [RESULTS / "claims.csv", RESULTS / "tables" / "readings.csv"]
SCENARIO_FINDINGS = RESULTS / "tables" / f"{SCENARIO_STUDY}.csv"
FRAME_RATES = [RESULTS / "tables" / f"frame_rate.{ext}" for ext in ("csv", "md")]
THRESHOLD_MAPS = [RESULTS / "tables" / f"threshold_maps.{ext}" for ext in ("csv", "md")]
OWN_FRAME_RATES = RESULTS / "tables" / "frame_rate_trajectories.csv"
ORDERS_TODAY = [RESULTS / "tables" / f"today.{ext}" for ext in ("csv", "md")]
RUN_TIMES = RESULTS / "tables" / "{study}_study_time.csv"


def study_tables(name):
    """The tables of a parameter study, and what they say in sentences."""
    tables = [RESULTS / f"{table}.csv" for table in FIGURES[f"{name}_study"]]
    return [*tables, RESULTS / "tables" / f"{name}_study.md"]


rule table1:
    input:
        TRIAL_CODE,
        STUDY_CODE,
        unpack(lambda wildcards: tables("trials")),
    output:
        TABLE1,
    log:
        RESULTS / "logs" / "tables" / "table1.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "table1.tsv"
    shell:
        "{sys.executable:q} -m studies table1 {input.trials:q} --output {output:q} > {log:q} 2>&1"


rule order:
    input:
        TRIAL_CODE,
        STUDY_CODE,
        unpack(lambda wildcards: tables("trials", "trials/halves")),
    output:
        ORDER,
    log:
        RESULTS / "logs" / "tables" / "order.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "order.tsv"
    shell:
        "{sys.executable:q} -m studies order {input.trials:q} --output {output:q} > {log:q} 2>&1"


rule verdicts:
    input:
        CLAIMS_FILE,
        STUDY_CODE,
        unpack(lambda wildcards: tables("replicates")),
    output:
        VERDICTS,
    threads: CORES
    log:
        RESULTS / "logs" / "tables" / "verdicts.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "verdicts.tsv"
    shell:
        "{sys.executable:q} -m studies claims {input.trials:q} --output {output:q}"
        " --n_jobs {threads} > {log:q} 2>&1"


rule run_times:
    input:
        TRIAL_CODE,
        code("studies/parameters"),
        unpack(lambda wildcards: tables(f"trials/{wildcards.study}_study")),
        file=lambda wildcards: study_file(wildcards.study),
    output:
        RUN_TIMES,
    threads: CORES # nothing beside it
    resources:
        mem_mb=600,
        runtime=20,
    log:
        RESULTS / "logs" / "tables" / "{study}_study_time.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "{study}_study_time.tsv"
    shell:
        "{sys.executable:q} -m studies {wildcards.study}_time {input.trials:q} --output {output:q}"
        " > {log:q} 2>&1"


for name in STUDIES:

    rule:
        name:
            f"parameters_{name}"
        input:
            STUDY_CODE,
            unpack(lambda wildcards, name=name: tables(f"trials/{name}_study")),
            file=study_file(name),
            times=expand(RUN_TIMES, study=name),
        output:
            study_tables(name),
        params:
            study=name,
        log:
            RESULTS / "logs" / "tables" / f"{name}_study.log",
        benchmark:
            RESULTS / "benchmarks" / "tables" / f"{name}_study.tsv"
        shell:
            "{sys.executable:q} -m studies {params.study} {input.trials:q}"
            " --times {input.times:q} --output {output:q} > {log:q} 2>&1"


rule scenarios:
    input:
        STUDY_CODE,
        unpack(lambda wildcards: tables(f"trials/{SCENARIO_STUDY}")),
    output:
        SCENARIO_FINDINGS,
    log:
        RESULTS / "logs" / "tables" / f"{SCENARIO_STUDY}.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / f"{SCENARIO_STUDY}.tsv"
    shell:
        "{sys.executable:q} -m studies scenarios {input.trials:q} --output {output:q} > {log:q} 2>&1"


rule maps:
    input:
        STUDY_CODE,
        unpack(lambda wildcards: tables("trials/threshold_maps")),
        file=MAPS,
    output:
        THRESHOLD_MAPS,
    log:
        RESULTS / "logs" / "tables" / "threshold_maps.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "threshold_maps.tsv"
    shell:
        "{sys.executable:q} -m studies threshold_maps {input.trials:q} --output {output:q}"
        " > {log:q} 2>&1"


rule frame_rates:
    input:
        STUDY_CODE,
        unpack(lambda wildcards: tables("trials/frame_rate")),
        file=FRAME_RATE,
    output:
        FRAME_RATES,
    log:
        RESULTS / "logs" / "tables" / "frame_rate.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "frame_rate.tsv"
    shell:
        "{sys.executable:q} -m studies frame_rate {input.trials:q} --output {output:q} > {log:q} 2>&1"


rule orders_today:
    input:
        STUDY_CODE,
        unpack(lambda wildcards: tables("trials/today")),
        file=TODAY,
    output:
        ORDERS_TODAY,
    log:
        RESULTS / "logs" / "tables" / "today.log",
    benchmark:
        RESULTS / "benchmarks" / "tables" / "today.tsv"
    shell:
        "{sys.executable:q} -m studies today {input.trials:q} --output {output:q} > {log:q} 2>&1"


rule own_frame_rates:
    input:
        TRIAL_CODE,
        STUDY_CODE,
        code("alignscores/cli", "alignscores/trajectories"),
        file=config.get("trajectories", []),
    output:
        OWN_FRAME_RATES,
    log:
        RESULTS / "logs" / "tables" / "frame_rate_trajectories.log",
    shell:
        "{sys.executable:q} -m studies.frame_rate {input.file:q} --output {output:q} > {log:q} 2>&1"
