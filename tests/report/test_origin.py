"""Where results come from is told: the command, the machines, the run times."""

import json
import shutil
from types import SimpleNamespace

import pandas as pd
import pytest

from report.origin import command, machines, runtimes, time_of
from studies.claims.claims import load_claims


def test_provenance_has_the_command_and_no_place(page, original):
    text = page.id("provenance").text
    assert "git checkout c0ffee" in text
    assert "snakemake report --config trials=7 replicates=3" in text
    assert page.html.count(str(original.folder)) == 0
    assert page.html.count("results_dir") == 0
    assert "numpy 2.4.6" in text
    assert "Tables" not in text  # all of them from one machine


def test_the_command_has_the_settings_and_no_folder():
    assert command([]) == "snakemake report"
    for name in ("mine.yaml", "mine.yml"):
        given = command(["trials=5", "sigma_t=[0.05]", f"scenarios=/home/me/{name}"])
        assert given == f"snakemake report --config trials=5 'sigma_t=[0.05]' scenarios={name}"


def test_run_times_are_summed_over_the_jobs_of_a_target(results):
    benchmark = "s\tcpu_time\tmax_rss\n4.0\t2.5\t90.0\n"
    results.write("benchmarks/figures/paths.tsv", benchmark)
    results.write("benchmarks/trials/beyond/bias.tsv", benchmark)
    results.write("benchmarks/trials/outliers.tsv", benchmark)
    results.write("benchmarks/figures/another.tsv", benchmark)
    page = results.page("--machine", "2 cores of a kind")
    rows = {}
    for row in page.within(page.id("provenance"), "tr"):
        (header, *_) = page.within(row, "th")
        rows[header.text] = page.cells(row)
    assert rows["claims"] == ["3", "2 min 33 s", "52.0 s", "–", "100 MB"]
    assert rows["beyond"] == ["2", "8.0 s", "4.0 s", "5.0 s", "90 MB"]
    assert rows["all"] == ["6", "2 min 45 s", "52.0 s", "7.5 s", "100 MB"]
    named = [name for name in rows if name in ("claims", "beyond", "all")]
    assert named == ["claims", "beyond", "all"]  # the studies in their order
    assert rows["outliers"][-2:] == [str(n_claims("outliers")), "4.0 s"]
    assert rows["collinear"][-2:] == [str(n_claims("collinear")), "–"]
    assert "figures" not in rows
    assert "on 2 cores of a kind" in page.id("provenance").text


def n_claims(experiment):
    return sum(claim.experiment == experiment for claim in load_claims().claims.values())


def test_what_was_made_elsewhere_is_told_apart(results):
    path = results.folder / "replicates" / "2.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"git": {"commit": "bad1dea", "dirty": True}}))
    shutil.rmtree(results.folder / "benchmarks")
    text = results.page().id("provenance").text
    assert "git checkout" not in text
    assert "claims/2 Commit bad1dea, with changes that are not committed" in text
    assert "paper (8), claims/0, claims/1, head_to_head (5), " in text
    assert "Not recorded" in text


def test_tables_of_one_origin_are_together():
    """A study is one where its tables are; the order in which origins are told changes nothing."""
    here, there = {"python": "3.11", "platform": "Linux"}, {"platform": "macOS", "python": "3.11"}
    turned = dict(reversed(here.items()))
    studies = {
        "paper": {"outliers": here, "length": turned},
        "claims": {"0": here, "1": there},
        "beyond": {"bias": there},
    }
    records = {
        study: {table: SimpleNamespace(origin=origin) for table, origin in tables.items()}
        for study, tables in studies.items()
    }
    assert machines(records) == [
        {"tables": ["paper (2)", "claims/0"], "origin": here},
        {"tables": ["claims/1", "beyond (1)"], "origin": there},
    ]


def jobs(*rows):
    return pd.DataFrame(rows, columns=["target", "job", "s", "cpu_time", "max_rss"])


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.0, "0.0 s"),
        (59.94, "59.9 s"),
        (59.95, "1 min 00 s"),
        (61.4, "1 min 01 s"),
        (3599.4, "59 min 59 s"),
        (3599.5, "1 h 00 min 00 s"),
        (7384.0, "2 h 03 min 04 s"),
    ],
)
def test_durations(seconds, words):
    table = jobs(("paper", "a", seconds, 1.0, 1.0), ("paper", "b", 5.0, 1.0, 1.0))
    assert time_of(table, "a") == words
    assert time_of(table, "c") == "–"


def test_run_times_of_targets_and_of_all():
    nan = float("nan")
    table = jobs(
        *(("b", "x", 3.0, 1.5, nan), ("a", "y", 70.0, nan, 99.6), ("b", "z", 4.0, 2.0, nan)),
        ("c", "x", nan, nan, 5.0),
    )
    words = "Jobs", "Time", "Longest job", "Processor time", "Largest memory"
    assert [(name, list(row.items())) for name, row in runtimes(table).items()] == [
        (name, list(zip(words, numbers, strict=True)))
        for name, numbers in (
            ("b", ("2", "7.0 s", "4.0 s", "3.5 s", "–")),
            ("a", ("1", "1 min 10 s", "1 min 10 s", "–", "100 MB")),
            ("c", ("1", "–", "–", "–", "5 MB")),
            ("all", ("4", "1 min 17 s", "1 min 10 s", "3.5 s", "100 MB")),
        )
    ]
    assert runtimes(jobs()) == {}
