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
        settings=[*SETTINGS, *FOLDER],
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
        "python -m experiments.run experiment={wildcards.experiment} {params.settings:q}"
        " n_jobs={threads} > {log:q} 2>&1"


rule study_trials:
    input:
        TRIAL_CODE,
    output:
        csv=RESULTS / "trials" / "{study}" / "{table}.csv",
        record=RESULTS / "trials" / "{study}" / "{table}.json",
    params:
        study=lambda wildcards: study_of(wildcards.study),
        table="{table}",
        settings=lambda wildcards: STUDIES[study_of(wildcards.study)].overrides,
        digest=lambda wildcards: STUDIES[study_of(wildcards.study)].tables[wildcards.table].digest,
    priority: 1
    threads: THREADS
    resources:
        mem_mb=memory,
        runtime=minutes,
    log:
        RESULTS / "logs" / "trials" / "{study}" / "{table}.log",
    benchmark:
        RESULTS / "benchmarks" / "{study}" / "{table}.tsv"
    shell:
        "python -m studies {params.study} --trials {params.table} --settings {params.settings:q}"
        " --output {output.csv:q} --n_jobs {threads} > {log:q} 2>&1"


use rule study_trials as replicate with:
    output:
        csv=RESULTS / "replicates" / "{number}.csv",
        record=RESULTS / "replicates" / "{number}.json",
    params:
        study="claims",
        table="{number}",
        # One more replicate changes no other.
        settings=lambda wildcards: [*SETTINGS, f"replicates={max(2, int(wildcards.number) + 1)}"],
        digest=lambda wildcards: STUDIES["claims"].tables[wildcards.number].digest,
    log:
        RESULTS / "logs" / "replicates" / "{number}.log",
    benchmark:
        RESULTS / "benchmarks" / "replicates" / "{number}.tsv"
