# Everything on one page, one to play with, and the article, which is made of the same.
import os
import platform

PAGE_CODE = code("report", "alignscores/explorer", ends=["*"])


def machine():
    """The processor and the number of its cores, in words; run times are those of this machine."""
    information = Path("/proc/cpuinfo")  # of Linux
    lines = information.read_text().splitlines() if information.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{os.cpu_count()} cores of {models[0] if models else platform.machine()}"


@cache
def all_experiments():
    """The settings of the paper's experiments as those of one table; each has scores."""
    sweeps = [sweep for name in EXPERIMENTS for sweep in resolved("trials", name).sweeps]
    for sweep in sweeps:
        or_end(errors_of_scores, sweep)
    return Table(tuple(sweeps))


rule camera_errors:
    input:
        TRIAL_CODE,
    output:
        errors=RESULTS / "tables" / "camera_errors.npz",
        record=RESULTS / "tables" / "camera_errors.json",
    params:
        digest=lambda wildcards: all_experiments().digest,
        table=lambda wildcards: all_experiments(),
    threads: lambda wildcards: share_of(1)
    resources:
        mem_mb=900,
        runtime=20,
    log:
        RESULTS / "logs" / "tables" / "camera_errors.log",
    benchmark:
        RESULTS / "benchmarks" / "explorer" / "camera_errors.tsv"
    shell:
        "{sys.executable:q} -m experiments.camera_errors --sweeps {params.table.json:q}"
        " --output {output.errors:q} {EXECUTED:q} n_jobs={threads} > {log:q} 2>&1"


rule explorer:
    input:
        PAGE_CODE,
        TRIAL_CODE,
        FIGURE_CODE,
        rules.camera_errors.output.record,
        errors=rules.camera_errors.output.errors,
    output:
        RESULTS / "explorer.html",
    localrule: True
    log:
        RESULTS / "logs" / "explorer.log",
    shell:
        "{sys.executable:q} -m report.explorer {input.errors:q} --output {output:q} > {log:q} 2>&1"


# Both find what they show in the folder of results, by convention; it is named here for Snakemake.
for page, flags in (("report", []), ("article", ["--article"])):

    rule:
        name:
            f"{page}_page"
        input:
            rules.explorer.output,
            PAGE_CODE,
            code("docs/article", ends=["*"]),
            [study_code(plan) for plan in STUDIES.values()],
            code("studies/*", ends=["j2"]),
            [answers(plan) + times(plan) for plan in STUDIES.values()],
            expand(RESULTS / "figures" / "{figure}.png", figure=FIGURES),
            lambda wildcards: tables(*STUDIES)["records"],
        output:
            RESULTS / f"{page}.html",
        localrule: True
        params:
            settings=GIVEN,
            machine=machine(),
            flags=flags,
        log:
            RESULTS / "logs" / f"{page}.log",
        shell:
            "{sys.executable:q} -m report {RESULTS:q} {params.flags} --settings {params.settings:q}"
            " --machine {params.machine:q} --output {output:q} > {log:q} 2>&1"

    rule:
        name:
            page
        input:
            RESULTS / f"{page}.html",
            lambda wildcards: [*chain(*tables(*STUDIES).values())], # those that were lost, too
        localrule: True


rule crate:
    input:
        RESULTS / "report.html",
        expand(FIGURE, figure=FIGURES, ext=["pdf", "png"]),
    output:
        RESULTS / "ro-crate-metadata.json",
    localrule: True
    log:
        RESULTS / "logs" / "crate.log",
    shell:
        "{sys.executable:q} -m report.crate {RESULTS:q} > {log:q} 2>&1"
