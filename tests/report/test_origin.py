"""The provenance: the command and the machines."""

import json

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


def test_tables_of_another_origin_are_named(results):
    path = results.folder / "replicates" / "2.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"git": {"commit": "bad1dea", "dirty": True}}))
    text = results.page().id("provenance").text
    assert "git checkout" not in text
    assert "claims/2 Commit bad1dea, with changes that are not committed" in text
