# From the Hydra configs to the figures of the paper:
#   snakemake figures                         the paper's figures and tables
#   snakemake figures --config trials=5       a quick look; any key of configs/ can be set
#   snakemake results/figures/outliers.pdf    one figure and what it needs
#   snakemake claims                          which of the paper's claims hold, from 20 replicates
#   snakemake head_to_head                    which metric orders neighbouring levels best
#   snakemake threshold_study                 what the paper's thresholds cost and gain
#   snakemake threshold_study --config tas_max_threshold=[0.5,1,1.5]    your own values
#   snakemake beyond                          what the paper leaves out: paths, errors, outliers
#   snakemake beyond --config scenarios=my.yaml    a study of your own (docs/how-to/parameter-study.md)
#   snakemake real --config benchmark=my.yaml    which metric distinguishes your own systems
#   snakemake report                          all of it on one page, results/report.html
include: "workflow/common.smk"
include: "workflow/trials.smk"
include: "workflow/answers.smk"
include: "workflow/figures.smk"


# Everything else is a job where there is a cluster.
localrules:
    report,
    table1,
    verdicts,
    orders,
    thresholds,
    scenarios,
    own_runs,
    real_answers,
    figure,
    study_figure,


rule figures:
    default_target: True
    input:
        expand(FIGURE, figure=PAPER_FIGURES, ext=["pdf", "png"]),
        rules.table1.output,


rule claims:
    input:
        rules.verdicts.output,


rule head_to_head:
    input:
        rules.orders.output,


rule threshold_study:
    input:
        rules.thresholds.output,
        expand(FIGURE, figure="threshold_study", ext=["pdf", "png"]),


rule beyond:
    input:
        rules.scenarios.output,
        expand(FIGURE, figure=BEYOND, ext=["pdf", "png"]),


rule real:
    input:
        rules.real_answers.output,
        expand(FIGURE, figure="real", ext=["pdf", "png"]),


rule report:
    input:
        code("report", "report", ends=["py", "css", "j2"]),
        rules.figures.input,
        rules.claims.input,
        rules.head_to_head.input,
        rules.threshold_study.input,
        rules.beyond.input,
        rules.real.input if "benchmark" in config else [],
    output:
        RESULTS / "report.html",
    params:
        folder=RESULTS,
        settings=CONFIG,
    log:
        RESULTS / "logs" / "report.log",
    shell:
        "python -m report {params.folder:q} --settings {params.settings:q} --output {output:q} > {log:q} 2>&1"
