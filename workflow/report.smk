# Everything on one page.
import os
import platform

PAGE_CODE = code("report", "alignscores/explorer", ends=["*"])


def machine():
    """The processor and the number of its cores, in words; run times are those of this machine."""
    information = Path("/proc/cpuinfo")  # of Linux
    lines = information.read_text().splitlines() if information.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{os.cpu_count()} cores of {models[0] if models else platform.machine()}"


rule report_page:
    input:
        PAGE_CODE,
        [study_code(plan) for plan in STUDIES.values()],
        code("studies/*", ends=["j2"]),
        # It finds what it shows in the folder of results, by convention; it is named here for Snakemake.
        [answers(plan) + times(plan) for plan in STUDIES.values()],
        expand(RESULTS / "figures" / "{figure}.png", figure=FIGURES),
        lambda wildcards: tables(*STUDIES)["records"],
    output:
        RESULTS / "report.html",
    localrule: True
    params:
        settings=GIVEN,
        machine=machine(),
    log:
        RESULTS / "logs" / "report.log",
    shell:
        "{sys.executable:q} -m report {RESULTS:q} --settings {params.settings:q}"
        " --machine {params.machine:q} --output {output:q} > {log:q} 2>&1"


rule report:
    input:
        rules.report_page.output,
        lambda wildcards: [*chain(*tables(*STUDIES).values())], # those that were lost, too
    localrule: True

