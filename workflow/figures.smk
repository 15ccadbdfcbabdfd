# Each figure: the function that draws it, and the tables that it shows.
FIGURE = RESULTS / "figures" / "{figure}.{ext}"
PAPER_FIGURES = {
    "histogram": ("histogram", ["trials/combined"]),
    "outliers": ("outliers", ["trials/outliers"]),
    "collinear": ("collinear", ["trials/collinear"]),
    "trajectory_length": ("trajectory_length", ["trials/trajectory_length"]),
    "rotations": ("rotations", ["trials/rotations"]),
    "combined": ("combined", ["trials/combined"]),
    "maa_vs_pas": (
        "maa_vs_pas",
        ["trials/maa_vs_pas_outliers", "trials/maa_vs_pas_length", "trials/maa_vs_pas_collinear"],
    ),
}
STUDY_FIGURES = {
    "threshold_study": ("studies.threshold_study.figure:draw", ["tables/threshold_study"]),
    BEYOND: ("studies.beyond.figure:draw", [f"tables/{BEYOND}"]),
    "real": ("studies.real.figure:draw", ["tables/real", "tables/real_pairs", "tables/real_agreement"]),
}


rule figure:
    input:
        FIGURE_CODE,
        tables=lambda wildcards: [RESULTS / f"{table}.csv" for table in PAPER_FIGURES[wildcards.figure][1]],
    output:
        expand(FIGURE, ext=["pdf", "png"], allow_missing=True),
    wildcard_constraints:
        figure="|".join(PAPER_FIGURES),
    params:
        draw=lambda wildcards: PAPER_FIGURES[wildcards.figure][0],
    log:
        RESULTS / "logs" / "figures" / "{figure}.log",
    benchmark:
        RESULTS / "benchmarks" / "figures" / "{figure}.tsv"
    shell:
        "python -m figures {params.draw} {input.tables:q} --output {output:q} > {log:q} 2>&1"


use rule figure as study_figure with:
    input:
        FIGURE_CODE,
        lambda wildcards: code("studies", f"studies/{STUDY_FIGURES[wildcards.figure][0].split('.')[1]}"),
        tables=lambda wildcards: [RESULTS / f"{table}.csv" for table in STUDY_FIGURES[wildcards.figure][1]],
    wildcard_constraints:
        figure="|".join(STUDY_FIGURES),
    params:
        draw=lambda wildcards: STUDY_FIGURES[wildcards.figure][0],
