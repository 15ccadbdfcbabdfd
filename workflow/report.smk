# Everything on one page.
ALL_FIGURES = [name for name in FIGURES if name not in ("beyond", "paths")]
ALL_FIGURES += [SCENARIO_STUDY, "paths"]


rule report:
    input:
        [path for path in Path(workflow.basedir, "report").iterdir() if path.is_file()],
        STUDY_CODE,
        CLAIMS_FILE,
        verdicts=VERDICTS[0],
        decisions=VERDICTS[1],
        table1=TABLE1[0],
        figures=expand(RESULTS / "figures" / "{figure}.png", figure=ALL_FIGURES),
        experiments=lambda wildcards: trials("trials", "csv"),
        replicates=lambda wildcards: trials("replicates", "csv"),
        thresholds=lambda wildcards: trials("trials/threshold_study", "csv"),
        registrations=lambda wildcards: trials("trials/registration_study", "csv"),
        scenarios=lambda wildcards: trials(f"trials/{SCENARIO_STUDY}", "csv"),
    output:
        RESULTS / "report.html",
    log:
        RESULTS / "logs" / "report.log",
    benchmark:
        RESULTS / "benchmarks" / "report.tsv"
    shell:
        "echo > {output}"
