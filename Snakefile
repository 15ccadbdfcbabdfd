# From the Hydra configs to the figures of the paper:
#   snakemake figures                         the paper's figures and tables
#   snakemake figures --config trials=5       a quick look; any key of configs/ can be set
#   snakemake results/figures/outliers.pdf    one figure and what it needs
#   snakemake claims                          which of the paper's claims hold, from 20 replicates
#   snakemake head_to_head                    which metric orders neighbouring levels best
#   snakemake threshold_study                 what the paper's thresholds cost and gain
#   snakemake threshold_study --config tas_max_threshold=[0.5,1,1.5]    your own values
#   snakemake registration_study              the paper's registration and the refined one
#   snakemake beyond                          what the paper leaves out: paths, errors, outliers
#   snakemake beyond --config scenarios=my.yaml    a study of your own (docs/how-to/parameter-study.md)
#   snakemake frame_rate                      what the frame rate does to each metric
#   snakemake frame_rate --config trajectories=my.yaml    to your own trajectories, too
#   snakemake today                           today's protocols beside the new scores
#   snakemake report                          all of it on one page, results/report.html
#   snakemake crate                           and a description of the results for archives (RO-Crate)
#   snakemake explorer                        a page to play with: the scores at any threshold
#   snakemake article                         the replication as an article, results/article.html
import sys

sys.path.insert(0, workflow.basedir)

include: "workflow/settings.smk"
include: "workflow/trials.smk"
include: "workflow/studies.smk"
include: "workflow/figures.smk"
include: "workflow/report.smk"


localrules:  # seconds each: not worth a job
    figures,
    head_to_head,
    claims,
    threshold_study,
    registration_study,
    beyond,
    frame_rate,
    today,
    figure,
    verdicts,
    own_frame_rates,
    explorer,
    report,
    crate,
    article,
    article_page,
    article_pdf,


rule figures:
    default_target: True
    input:
        expand(FIGURE, figure=PAPER_FIGURES, ext=["pdf", "png"]),
        made("table1"),


rule head_to_head:
    input:
        made("order"),


rule claims:
    input:
        VERDICTS,


rule threshold_study:
    input:
        made("threshold"),
        made("threshold_maps"),
        expand(FIGURE, figure=["threshold_study", "threshold_maps"], ext=["pdf", "png"]),


rule registration_study:
    input:
        made("registration"),
        expand(FIGURE, figure="registration_study", ext=["pdf", "png"]),


rule beyond:
    input:
        made("scenarios"),
        expand(FIGURE, figure=[SCENARIO_STUDY, "paths"], ext=["pdf", "png"]),


rule frame_rate:
    input:
        made("frame_rate"),
        OWN_FRAME_RATES if "trajectories" in config else [],
        expand(FIGURE, figure="frame_rate", ext=["pdf", "png"]),


rule today:
    input:
        made("today"),
        expand(FIGURE, figure="today", ext=["pdf", "png"]),


rule article:
    input:
        ARTICLE,


onstart:
    if LIBRARY is None:
        print(NOT_COMPILED, file=sys.stderr)


onsuccess:
    print(f"results in {RESULTS}/")
