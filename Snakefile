# From the Hydra configs to the figures of the paper:
#   snakemake figures                         the paper's figures and tables
#   snakemake figures --config trials=5       a quick look; any key of configs/ can be set
#   snakemake results/figures/outliers.pdf    one figure and what it needs
#   snakemake claims                          which of the paper's claims hold, from 20 replicates
# Each study in studies/ is a target:
#   snakemake head_to_head                    which metric orders neighbouring levels best
#   snakemake threshold_study                 what the paper's thresholds cost and gain
#   snakemake threshold_study --config tas_max_threshold=[0.5,1,1.5]    your own values
#   snakemake beyond                          what the paper leaves out: paths, errors, outliers
#   snakemake beyond --config scenarios=my.yaml    a study of your own (docs/how-to/parameter-study.md)
#   snakemake real --config benchmark=my.yaml    which metric tells your own systems apart
# And all of them:
#   snakemake report                          all of it on one page, results/report.html
import sys

sys.path.insert(0, workflow.basedir)

include: "workflow/settings.smk"
include: "workflow/trials.smk"
include: "workflow/studies.smk"
include: "workflow/report.smk"


rule figures:
    default_target: True
    input:
        rules.paper.input,
    localrule: True


onstart:
    refuse_other_tables(workflow.dag)
    # To start no more than so many jobs a second, Snakemake 9 looks at all inputs of the ready jobs again and again,
    # soon all the time, and does not end before the last look. The numbers of cores and jobs are limit enough.
    workflow.scheduler.job_rate_limiter = None


onsuccess:
    print(f"results in {RESULTS}/")
