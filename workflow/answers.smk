# What each study answers: tables, computed from tables of trials.
rule table1:
    input:
        code("studies", "studies/paper"),
        trials=PAPER_TRIALS,
    output:
        RESULTS / "tables" / "method_comparison.csv",
        RESULTS / "tables" / "method_comparison.md",
    params:
        study="paper",
    log:
        RESULTS / "logs" / "answers" / "paper.log",
    benchmark:
        RESULTS / "benchmarks" / "answers" / "paper.tsv"
    shell:
        "python -m studies {params.study} {input.trials:q} --output {output:q} --n_jobs {threads} > {log:q} 2>&1"


use rule table1 as verdicts with:
    input:
        code("studies", "studies/claims", "studies/paper"),
        ROOT / "configs" / "claims.yaml",
        trials=lambda wildcards: [RESULTS / "replicates" / f"{n}.csv" for n in range(len(sweeps_of_replicates()))],
    output:
        RESULTS / "claims.csv",
        RESULTS / "tables" / "readings.csv",
        RESULTS / "tables" / "criteria.csv",
    params:
        study="claims",
    threads: workflow.cores
    log:
        RESULTS / "logs" / "answers" / "claims.log",
    benchmark:
        RESULTS / "benchmarks" / "answers" / "claims.tsv"


use rule table1 as orders with:
    input:
        code("studies", "studies/head_to_head"),
        trials=lambda wildcards: [*PAPER_TRIALS, *trials_of("head_to_head")],
    output:
        RESULTS / "tables" / "head_to_head.csv",
    params:
        study="head_to_head",
    log:
        RESULTS / "logs" / "answers" / "head_to_head.log",
    benchmark:
        RESULTS / "benchmarks" / "answers" / "head_to_head.tsv"


use rule table1 as thresholds with:
    input:
        code("studies", "studies/threshold_study"),
        ROOT / "studies" / "threshold_study" / "axes.yaml",
        trials=lambda wildcards: trials_of("threshold_study"),
    output:
        RESULTS / "tables" / "threshold_study.csv",
    params:
        study="threshold_study",
    log:
        RESULTS / "logs" / "answers" / "threshold_study.log",
    benchmark:
        RESULTS / "benchmarks" / "answers" / "threshold_study.tsv"


use rule table1 as scenarios with:
    input:
        code("studies", "studies/beyond"),
        trials=lambda wildcards: trials_of("beyond"),
    output:
        RESULTS / "tables" / f"{BEYOND}.csv",
    params:
        study="beyond",
    log:
        RESULTS / "logs" / "answers" / f"{BEYOND}.log",
    benchmark:
        RESULTS / "benchmarks" / "answers" / f"{BEYOND}.tsv"


rule own_runs:
    input:
        code("studies", "studies/real"),
        code("alignscores/comparison", "alignscores/evaluation", "alignscores/trajectories"),
        code("alignscores/trajectories/files"),
        benchmark=config.get("benchmark", []),
        runs=lambda wildcards: own_runs()[wildcards.sequence],
    output:
        RESULTS / "real" / "own" / "{sequence}.csv",
    params:
        more=MORE,
    log:
        RESULTS / "logs" / "real" / "{sequence}.log",
    benchmark:
        RESULTS / "benchmarks" / "real" / "{sequence}.tsv"
    shell:
        "python -m studies.real --benchmark {input.benchmark:q} --sequence {wildcards.sequence:q}"
        " --more={params.more:q} --output {output:q} > {log:q} 2>&1"


rule real_answers:
    input:
        code("studies", "studies/real"),
        own=lambda wildcards: [RESULTS / "real" / "own" / f"{part}.csv" for part in own_runs()],
    output:
        RESULTS / "tables" / "real.csv",
        RESULTS / "tables" / "real_pairs.csv",
        RESULTS / "tables" / "real_agreement.csv",
    log:
        RESULTS / "logs" / "answers" / "real.log",
    shell:
        "python -m studies.real {input.own:q} --output {output:q} > {log:q} 2>&1"
