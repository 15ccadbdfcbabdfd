# Everything on one page.

PAGE_CODE = code("report", ends=["*"])


rule report_page:
    input:
        PAGE_CODE,
        [study_code(plan) for plan in STUDIES.values()],
        code("studies/*", ends=["j2"]),
        # It finds what it shows in the folder of results, by convention; it is named here for Snakemake.
        [answers(plan) for plan in STUDIES.values()],
        expand(RESULTS / "figures" / "{figure}.png", figure=FIGURES),
        lambda wildcards: tables(*STUDIES)["records"],
    output:
        RESULTS / "report.html",
    localrule: True
    params:
        settings=GIVEN,
    log:
        RESULTS / "logs" / "report.log",
    shell:
        "{sys.executable:q} -m report {RESULTS:q} --settings {params.settings:q}"
        " --output {output:q} > {log:q} 2>&1"


rule report:
    input:
        rules.report_page.output,
        lambda wildcards: [*chain(*tables(*STUDIES).values())], # those that were lost, too
    localrule: True

