# One figure a module, drawn from the tables that `figures.FIGURES` names.
FIGURE = RESULTS / "figures" / "{figure}.{ext}"
OF_SCENARIOS = {SCENARIO_STUDY: (f"tables/{SCENARIO_STUDY}",)}


def drawn_from(wildcards):
    return [f"{RESULTS}/{table}.csv" for table in {**FIGURES, **OF_SCENARIOS}[wildcards.figure]]


def records(wildcards):
    of_trials = PAPER_FIGURES.get(wildcards.figure, ())
    return [f"{RESULTS}/trials/{name}.json" for name in of_trials]


wildcard_constraints:
    figure="|".join([*FIGURES, SCENARIO_STUDY]),


rule figure:
    input:
        TRIAL_CODE,
        STUDY_CODE,
        FIGURE_CODE,
        records,
        tables=drawn_from,
    output:
        pdf=RESULTS / "figures" / "{figure}.pdf",
        png=RESULTS / "figures" / "{figure}.png",
    params:
        module=lambda wildcards: wildcards.figure if wildcards.figure in FIGURES else "beyond",
        path=str(RESULTS / "figures" / "{figure}"),
    log:
        RESULTS / "logs" / "figures" / "{figure}.log",
    benchmark:
        RESULTS / "benchmarks" / "figures" / "{figure}.tsv"
    shell:
        "{sys.executable:q} -m figures {params.module} {input.tables:q} --output {params.path:q}"
        " > {log:q} 2>&1"
