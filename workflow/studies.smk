# What is asked of the trials: tables of findings.
VERDICTS = [RESULTS / "claims.csv", RESULTS / "tables" / "readings.csv"]
OWN_FRAME_RATES = RESULTS / "tables" / "frame_rate_trajectories.csv"
RUN_TIMES = RESULTS / "tables" / "{study}_study_time.csv"


def with_sentences(name):
    """The tables of a study, as its figure names them if it has one; and what they say in words."""
    tables = FIGURES.get(name, [f"tables/{name}"])
    return [*(RESULTS / f"{table}.csv" for table in tables), RESULTS / "tables" / f"{name}.md"]


# By the names of `python -m studies`: the folders of the trials, what is made, the file that says how.
FINDINGS = {
    "table1": (["trials"], with_sentences("method_comparison"), []),
    "order": (["trials", "trials/halves"], with_sentences("order"), []),
    **{
        name: ([f"trials/{name}_study"], with_sentences(f"{name}_study"), study_file(name))
        for name in STUDIES
    },
    "threshold_maps": (["trials/threshold_maps"], with_sentences("threshold_maps"), MAPS),
    "scenarios": ([f"trials/{SCENARIO_STUDY}"], [RESULTS / "tables" / f"{SCENARIO_STUDY}.csv"], []),
    "frame_rate": (["trials/frame_rate"], with_sentences("frame_rate"), []),
    "today": (["trials/today"], with_sentences("today"), []),
}


def made(name):
    """The files with the findings of a study."""
    return FINDINGS[name][1]


for name, (folders, files, how) in FINDINGS.items():

    rule:
        name:
            f"findings_{name}"
        input:
            STUDY_CODE,
            how,
            unpack(lambda wildcards, folders=folders: tables(*folders)),
            times=expand(RUN_TIMES, study=name) if name in STUDIES else [],
        output:
            files,
        localrule: True
        params:
            name=name,
            times=lambda wildcards, input: ["--times", *input.times] if input.times else [],
        log:
            RESULTS / "logs" / "tables" / f"{files[-1].stem}.log",
        benchmark:
            RESULTS / "benchmarks" / "tables" / f"{files[-1].stem}.tsv"
        shell:
            "{sys.executable:q} -m studies {params.name} {input.trials:q} {params.times:q}"
            " --output {output:q} > {log:q} 2>&1"


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


rule own_frame_rates:
    input:
        TRIAL_CODE,
        STUDY_CODE,
        code("alignscores/cli", "alignscores/trajectories", "alignscores/trajectories/files"),
        file=config.get("trajectories", []),
    output:
        OWN_FRAME_RATES,
    log:
        RESULTS / "logs" / "tables" / "frame_rate_trajectories.log",
    shell:
        "{sys.executable:q} -m studies.frame_rate {input.file:q} --output {output:q} > {log:q} 2>&1"
