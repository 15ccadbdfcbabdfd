# Trials of all studies: a table each, with the record of what it rests on beside it.
from math import ceil, gcd


def most_trials(wildcards):
    return max(sweep.trials for sweep in table(wildcards).sweeps)


def effort(wildcards):
    """Longest first, so that no core is idle at the end; and all before figures."""
    return sum(sweep.trials * len(cells(sweep)) * len(sweep.metrics) for sweep in table(wildcards).sweeps)


def share_of(tables):
    """Share the cores among tables that are made side by side, so that none is idle at the end."""
    if "n_jobs" not in config:
        # Of many tables one each: the last are short, and starting another process takes longer.
        return 1 if tables > 2 * CORES else CORES // gcd(CORES, tables)
    return CORES if config["n_jobs"] == -1 else config["n_jobs"]


def table(wildcards):
    return resolved(wildcards.folder, wildcards.table)


def refuse_other_tables(dag):
    """Snakemake knows the settings of the tables that it made: others, or changed ones, are not taken for these."""
    for job in dag.jobs:
        if job.rule.name == "trials" and not dag.needrun(job):
            or_end(check_sweeps, Path(job.output.csv), table(job.wildcards).sweeps)


wildcard_constraints:
    folder="|".join(FOLDERS),
    table=r"\w+",


rule trials:
    input:
        TRIAL_CODE,
    output:
        csv=RESULTS / "{folder}" / "{table}.csv",
        record=RESULTS / "{folder}" / "{table}.json",
    params:
        # Snakemake compares the digest; the settings themselves would fill the screen.
        digest=lambda wildcards: table(wildcards).digest,
        table=lambda wildcards: table(wildcards),
    priority: effort
    threads: lambda wildcards: share_of(len(planned(wildcards.folder)))
    resources:
        # What a cluster is asked for. Measured (docs/how-to/cluster.md): a process takes 140 MB, as does each of
        # the two Snakemakes beside it; a replicate of all claims takes 0.7 s for each trial of a cell, one of
        # those with all readings 1.5 s.
        # Twice that, and a megabyte for each trial of a cell: rows are held until they are written.
        mem_mb=lambda wildcards, threads: 600 + 300 * threads + most_trials(wildcards),
        # Nine times that, and ten minutes for nodes and file systems that are slow to start.
        runtime=lambda wildcards, threads: 10 + ceil(14 * most_trials(wildcards) / 60 / threads),
    log:
        RESULTS / "logs" / "{folder}" / "{table}.log",
    benchmark:
        RESULTS / "benchmarks" / "{folder}" / "{table}.tsv"
    shell:
        "{sys.executable:q} -m experiments.run --sweeps {params.table.json:q} --table {output.csv:q}"
        " {EXECUTED:q} n_jobs={threads} > {log:q} 2>&1"
