# One figure a module, drawn from the tables that `figures.FIGURES` names.
FIGURE = RESULTS / "figures" / "{figure}.{ext}"
OF_SCENARIOS = {SCENARIO_STUDY: (f"tables/{SCENARIO_STUDY}",)}


def drawn_from(wildcards):
    return [f"{RESULTS}/{table}.csv" for table in {**FIGURES, **OF_SCENARIOS}[wildcards.figure]]


def records(wildcards):
    """What the tables of trials rest on; other tables have no record."""
    names = [table for table in FIGURES.get(wildcards.figure, ()) if table.startswith("trials/")]
    return [f"{RESULTS}/{name}.json" for name in names]


wildcard_constraints:
    figure="|".join([*FIGURES, SCENARIO_STUDY]),


rule figure:
    input:
        TRIAL_CODE,
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
