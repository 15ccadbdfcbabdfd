"""Where results come from is told: the command, the machines, the run times."""

import json


def test_provenance_has_the_command_and_no_place(page, original):
    text = page.id("provenance").text
    assert "git checkout c0ffee" in text
    assert "snakemake report --config trials=7 'tas_quantile=[0.5,0.75]'" in text
    assert str(original.folder) not in page.html
    assert "results_dir" not in page.html
    assert "numpy 2.4.6" in text
    assert "Tables" not in text  # all of them from one machine


def test_without_settings_the_command_has_none(results):
    page = results.page()
    (code,) = page.within(page.id("provenance"), "pre")
    assert code.text.endswith(".venv/bin/snakemake report")


def test_run_times_are_summed_over_the_jobs_of_a_folder(results):
    benchmark = "s\tcpu_time\tmax_rss\n4.0\t2.5\t90.0\n"
    results.write("benchmarks", "benchmarks/figures/paths.tsv", benchmark)
    results.write("benchmarks", "benchmarks/figures/damaged.tsv", "s\n1.0\n")
    page = results.page()
    rows = {}
    for row in page.within(page.id("provenance"), "tr"):
        (header, *_) = page.within(row, "th")
        rows[header.text] = page.cells(row)
    assert rows["replicates"] == ["3", "2 min 33 s", "52.0 s", "–", "100 MB"]
    assert rows["figures"] == ["1", "4.0 s", "4.0 s", "2.5 s", "90 MB"]
    assert rows["all"] == ["4", "2 min 37 s", "52.0 s", "2.5 s", "100 MB"]
    assert "tables" not in rows


def test_what_was_made_elsewhere_is_told_apart(results):
    path = results.folder / "replicates" / "2.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"git": {"commit": "bad1dea", "dirty": True}}))
    del results.files["benchmarks"]
    text = results.page().id("provenance").text
    assert "git checkout" not in text
    assert "replicates/2 Commit bad1dea, with changes that are not committed" in text
    assert "trials/ (8), replicates/0, replicates/1, threshold_study/ (4), " in text
    assert "Not recorded" in text
