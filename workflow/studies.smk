# From the description of each study: its answers, its figures, and a target of its name.
FIGURE = RESULTS / "figures" / "{figure}.{ext}"
NEEDS_OWN_FILE = "snakemake: {0.name} needs --config {0.own.key}=FILE"
FIGURES = {name: (plan, figure) for plan in STUDIES.values() for name, figure in plan.figures.items()}


def answers(plan):
    return [RESULTS / name for name in plan.answers]


def own_tables(plan):
    """What is made of people's own files."""
    return expand("{folder}/own/{part}.csv", folder=RESULTS / plan.called, part=plan.sources)


def study_code(plan):
    """What its answers rest on beside the trials."""
    return [*code("studies", f"studies/{plan.study.name}"), *map(str, plan.study.files)]


for plan in STUDIES.values():

    rule:
        name:
            f"answers_{plan.study.name}"
        input:
            study_code(plan),
            code("studies/paper") if plan.study.name == "claims" else [],
            unpack(lambda wildcards, plan=plan: tables(*plan.study.beside, plan.study.name)),
            own=lambda wildcards, plan=plan: or_end(own_tables, plan),
        output:
            answers(plan),
        localrule: True
        params:
            name=plan.study.name,
        threads: CORES if plan.study.is_parallel else 1
        log:
            RESULTS / "logs" / "answers" / f"{plan.called}.log",
        benchmark:
            RESULTS / "benchmarks" / "answers" / f"{plan.called}.tsv"
        shell:
            "{sys.executable:q} -m studies {params.name} {input.trials:q}"
            " --own {input.own:q} --output {output:q} --n_jobs {threads} > {log:q} 2>&1"

    rule:
        name:
            plan.study.name
        input:
            answers(plan),
            expand(FIGURE, figure=plan.figures, ext=["pdf", "png"]),
            lambda wildcards, plan=plan: [*chain(*tables(plan.study.name).values())], # those that were lost, too
        localrule: True


def drawn_from(wildcards):
    return [f"{RESULTS}/{table}.csv" for table in FIGURES[wildcards.figure][1].tables]


def drawn_by(wildcards):
    """The code of a figure, and the records of the trials that it shows; other tables have none."""
    plan, figure = FIGURES[wildcards.figure]
    records = [f"{RESULTS}/{table}.json" for table in figure.tables if table.startswith("trials/")]
    return [*(study_code(plan) if plan.study.name != "paper" else []), *records]


for plan in [plan for plan in STUDIES.values() if plan.study.own]:

    rule:
        name:
            f"own_{plan.study.name}"
        input:
            TRIAL_CODE,
            study_code(plan),
            code("alignscores/comparison", "alignscores/evaluation", "alignscores/trajectories"),
            code("alignscores/trajectories/files"),
            lambda wildcards, plan=plan: or_end(lambda: plan.sources[wildcards.part]),
            config[plan.study.own.key],
        output:
            RESULTS / plan.called / "own" / "{part}.csv",
        localrule: True
        params:
            settings=plan.given,
            name=plan.study.name,
        wildcard_constraints:
            part="[^/]+",
        log:
            RESULTS / "logs" / plan.called / "{part}.log",
        benchmark:
            RESULTS / "benchmarks" / plan.called / "{part}.tsv"
        shell:
            "{sys.executable:q} -m studies {params.name} --part {wildcards.part:q}"
            " --settings {params.settings:q} --output {output:q} > {log:q} 2>&1"


for study in [study for study in found() if study.name not in STUDIES]:

    rule:
        name:
            study.name
        params:
            lambda wildcards, study=study: sys.exit(NEEDS_OWN_FILE.format(study)),
        localrule: True


wildcard_constraints:
    figure="|".join(FIGURES),


rule figure:
    input:
        TRIAL_CODE,
        FIGURE_CODE,
        drawn_by,
        tables=drawn_from,
    output:
        expand(FIGURE, ext=["pdf", "png"], allow_missing=True),
    localrule: True
    params:
        draw=lambda wildcards: FIGURES[wildcards.figure][1].draw,
    log:
        RESULTS / "logs" / "figures" / "{figure}.log",
    benchmark:
        RESULTS / "benchmarks" / "figures" / "{figure}.tsv"
    shell:
        "{sys.executable:q} -m figures {params.draw} {input.tables:q} "
        "--output {RESULTS:q}/figures/{wildcards.figure} > {log:q} 2>&1"

