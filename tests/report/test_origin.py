"""The provenance: the command, the machines, the run times."""

import json
import shutil

from report.origin import command


def test_provenance_has_the_command_and_no_place(page, original):
    text = page.id("provenance").text
    assert "snakemake report --config trials=7 replicates=3" in text
    assert page.html.count(str(original.folder)) == 0
    assert page.html.count("results_dir") == 0
    assert "numpy " in text
    assert "Tables" not in text  # all of them from one machine


def test_the_command_has_the_settings_and_no_folder():
    given = command(["trials=5", "sigma_t=[0.05]", "scenarios=/home/me/mine.yaml"])
    assert given == "snakemake report --config trials=5 'sigma_t=[0.05]' scenarios=mine.yaml"


def test_run_times_are_summed_over_the_jobs_of_a_target(results):
    """Snakemake of another version measures other things, with - for what it could not."""
    results.write("benchmarks/figures/paths.tsv", "s\tcpu_time\tmax_rss\n4.0\t2.5\t90.0\n")
    results.write("benchmarks/trials/beyond/bias.tsv", "max_rss\ts\n-\t4.0\n")
    results.write("benchmarks/figures/another.tsv", "s\n1\n")  # of no study
    page = results.page("--machine", "2 cores of a kind")
    rows = {}
    for row in page.within(page.id("provenance"), "tr"):
        rows[page.within(row, "th")[0].text] = page.cells(row)
    assert rows["claims"] == ["3", "2 min 33 s", "52.0 s", "–", "100 MB"]
    assert rows["beyond"] == ["2", "8.0 s", "4.0 s", "2.5 s", "90 MB"]
    assert rows["all"] == ["5", "2 min 41 s", "52.0 s", "2.5 s", "100 MB"]
    assert "on 2 cores of a kind" in page.id("provenance").text


def test_tables_of_another_origin_are_named(results):
    path = results.folder / "replicates" / "2.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"git": {"commit": "bad1dea", "dirty": True}}))
    shutil.rmtree(results.folder / "benchmarks")
    text = results.page().id("provenance").text
    assert "git checkout" not in text
    assert "claims/2 Commit bad1dea, with changes that are not committed" in text
    assert "Not recorded" in text
