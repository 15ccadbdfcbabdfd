# Tables of trials, a row a trial, each with its record: settings, seed, versions and commit.
wildcard_constraints:
    experiment=r"\w+",
    table=r"\w+",
    study=r"\w+",
    number=r"\d+",


rule trials:
    input:
        TRIAL_CODE,
        ROOT / "configs" / "config.yaml",
        ROOT / "configs" / "experiment" / "{experiment}.yaml",
    output:
        RESULTS / "trials" / "{experiment}.csv",
        RESULTS / "trials" / "{experiment}.json",
    params:
        program="experiments.run",
        settings=lambda wildcards: to_overrides({"experiment": wildcards.experiment, **SETTINGS, **FOLDER}),
    priority: 1
    threads: THREADS
    resources:
        mem_mb=memory,
        runtime=minutes,
    log:
        RESULTS / "logs" / "trials" / "{experiment}.log",
    benchmark:
        RESULTS / "benchmarks" / "trials" / "{experiment}.tsv"
    shell:
        "python -m {params.program} {params.settings:q} n_jobs={threads} > {log:q} 2>&1"


use rule trials as study_trials with:
    input:
        TRIAL_CODE,
        ROOT / "configs" / "config.yaml",
        lambda wildcards: experiment_file(settings_of(wildcards)),
    output:
        RESULTS / "trials" / "{study}" / "{table}.csv",
        RESULTS / "trials" / "{study}" / "{table}.json",
    params:
        program="experiments.run",
        settings=lambda w: to_overrides({**settings_of(w), **FOLDER, "table": f"{w.study}/{w.table}"}),
    log:
        RESULTS / "logs" / "trials" / "{study}" / "{table}.log",
    benchmark:
        RESULTS / "benchmarks" / "{study}" / "{table}.tsv"


use rule trials as replicate with:
    input:
        TRIAL_CODE,
    output:
        RESULTS / "replicates" / "{number}.csv",
        RESULTS / "replicates" / "{number}.json",
    params:
        program="studies.claims",
        settings=lambda wildcards: [wildcards.number, *to_overrides({**SETTINGS, **FOLDER})],
        needed=lambda wildcards: digest_of_replicate(int(wildcards.number)),
    log:
        RESULTS / "logs" / "replicates" / "{number}.log",
    benchmark:
        RESULTS / "benchmarks" / "replicates" / "{number}.tsv"
