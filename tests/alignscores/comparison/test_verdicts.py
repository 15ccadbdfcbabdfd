"""Verdicts and tables: of scores that are given, and by the command."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from io import StringIO

import numpy as np
import pytest

from alignscores.comparison.benchmark import Run
from alignscores.comparison.runs import COLUMNS, Outcome
from alignscores.comparison.summary import summarise
from alignscores.comparison.tables import as_text, tables
from alignscores.comparison.verdicts import verdict
from alignscores.io import FORMATS
from alignscores.texts import text_width

RNG = np.random.default_rng(0)
GOOD, BAD = (0.7 + 0.01 * RNG.random(10)).tolist(), (0.5 + 0.01 * RNG.random(10)).tolist()
MIXED = np.linspace(0.3, 0.9, 10).tolist()


def summed_up(systems, **options):
    """{system: {sequence: scores, None for a failed run}} -> their summary."""
    runs = []
    for system, sequences in systems.items():
        for sequence, scores in sequences.items():
            for number, score in enumerate(scores):
                run = Run(sequence, system, str(number), f"{system}{number}.txt")
                values = dict.fromkeys(COLUMNS, score)
                known = Outcome(values, n=10, unit=0.5, lost=0.25)
                runs.append((run, Outcome({}, error="lost") if score is None else known))
    return summarise(runs, [], FORMATS["tum"], **options)


def said(systems, by="PAS", **options):
    """Return the verdict as one text."""
    return " ".join(verdict(summed_up(systems, **options), by))


def on(sequences, scores):
    return {f"s{number}": scores for number in range(sequences)}


def ranks(systems, by="PAS"):
    summary = summed_up(systems)
    return {system: summary.entries[system, None].ranks[by] for system in systems}


def test_a_system_is_ahead_of_another():
    text = said({"b": on(1, BAD), "a": on(1, GOOD)})
    start = "a is ahead of b: it wins 100 % of the run pairs on 1 sequence (p < 0.001), mean PAS "
    assert text.startswith(start)
    assert re.fullmatch(r"\+0\.\d{3} \(0\.\d{3} to 0\.\d{3}\)\.", text.removeprefix(start))


def test_where_none_is_ahead_the_number_of_runs_is_told():
    text = said({"a": on(1, MIXED), "b": on(1, MIXED)})
    assert text.startswith("a and b are not distinguishable: a wins 50 % of the run pairs")
    assert text.endswith("in four of five cases takes more than 50 runs each.")
    few = said({"a": on(1, GOOD[:3]), "b": on(1, BAD[:3])})
    assert few == (
        "a, b: too few runs to be tested. a and b, 3 runs each: to find a difference like this in "
        "four of five cases takes 4 runs each."
    )


def test_single_runs_silence_nobody():
    """Nor do they stand among the ranks; what is said of others stays the same."""
    pair = {"a": on(4, GOOD), "b": on(4, BAD)}
    alone = {"c": on(4, [0.9]), "d": on(4, [0.1])}
    assert (
        said(pair | alone)
        == f"{said(pair)} c, d: one run on each of 4 sequences, too few to be tested."
    )
    assert ranks(pair | alone) == {"a": (1, 1), "b": (2, 2), "c": None, "d": None}


def test_single_runs_are_compared_on_six_sequences():
    six = {"a": {f"s{k}": [0.5 + 0.01 * k] for k in range(6)}, "b": on(6, [0.4])}
    assert said(six).startswith("a is ahead of b: it wins 100 % of the run pairs on 6 sequences (")
    assert "On sequences like these, a is ahead (p = 0.031)." in said(six)
    five = {name: {s: own[s] for s in list(own)[:5]} for name, own in six.items()}
    assert said(five) == "a, b: one run on each of 5 sequences, too few to be tested."


def test_what_holds_on_these_sequences_may_not_hold_on_others():
    mixed = {f"s{k}": GOOD if k < 4 else BAD for k in range(6)}
    text = said({"a": mixed, "b": {s: [0.6 + x / 100 for x in GOOD] for s in mixed}})
    assert text.startswith("a is ahead of b: it wins 67 %")
    assert "On sequences like these, they are not distinguishable (p = " in text


def test_failures_lose():
    """Also where a system that fails has the better runs otherwise."""
    text = said({"a": on(1, [*GOOD[:2], *[None] * 8]), "b": on(1, BAD)})
    assert text.startswith("b is ahead of a: it wins 80 % of the run pairs on 1 sequence (p = ")
    of_errors = said({"a": on(1, [*BAD[:2], *[None] * 8]), "b": on(1, GOOD)}, "half_distance")
    assert of_errors.startswith("b is ahead of a: it wins 80 %")
    assert "mean" not in of_errors  # it is infinite


def test_an_interval_stands_next_to_a_significant_difference_alone():
    """Near 5 % that of the means may leave out 0 where the test of ranks does not reject."""
    a = [0.499, 0.510, 0.663, 0.561, 0.661, 0.440, 0.594, 0.520, 0.528, 0.652]
    b = [0.367, 0.530, 0.532, 0.392, 0.569, 0.531, 0.427, 0.418, 0.437, 0.571]
    text = said({"a": on(1, a), "b": on(1, b)})
    assert "not distinguishable: a wins 73 % of the run pairs on 1 sequence (p = 0.089)" in text
    assert "mean PAS +0.085." in text


def test_who_leaves_out_hard_sequences_does_not_lead():
    """Though the mean over the others is the largest."""
    easy, hard = {"s0": GOOD}, {"s1": [x - 0.4 for x in GOOD]}
    systems = {"leaves out": easy, "complete": {"s0": [x + 0.02 for x in GOOD]} | hard}
    systems |= {"single": {"s0": [0.99]}}
    assert summed_up(systems).ranked("PAS") == ["complete", "leaves out", "single"]


def test_runs_of_the_same_name_can_be_paired():
    """Where runs scatter by what they share, as scenes or seeds."""
    hard = np.linspace(0.2, 0.8, 8)
    systems = {"a": on(1, (hard + 0.02).tolist()), "b": on(1, hard.tolist())}
    assert said(systems).startswith("a and b are not distinguishable")
    assert said(systems, paired=True).startswith("a is ahead of b: it wins 100 %")


def test_twelve_systems_on_two_sequences_fit_a_terminal():
    systems = {f"system_{k:02d}": on(2, [x - 0.02 * k for x in GOOD]) for k in range(12)}
    shown = "\n".join(map(as_text, tables(summed_up(systems), "PAS")))
    assert max(map(text_width, shown.splitlines())) <= 100
    assert len(shown.splitlines()) == 13 + 14


def test_without_rotations_the_verdict_says_by_what_to_compare(patterns, run):
    words = *patterns, "--ref_columns", "t x y z"
    assert run(*words)[1].startswith("no run has a PAS, which takes rotations; --by TAS compares")
    assert run(*words, "--by", "TAS")[1].startswith("a_b is ahead of c")


def test_the_command_begins_with_the_verdict(patterns, run):
    code, out, _ = run(*patterns)
    verdict, overall, by_sequence, legend = out.rstrip().split("\n\n")
    assert code == 1  # a run is missing
    assert verdict.startswith("a_b is ahead of c: it wins 100 % of the run pairs on 2 sequences (p")
    rows = [re.split(r"\s{2,}", line) for line in overall.splitlines()]
    assert [(row[0], row[1], row[-2]) for row in rows] == [
        ("system", "rank", "failed runs"),
        ("a_b", "1", "0/6 (0-46 %)"),
        ("c", "2", "1/6 (0-64 %)"),
    ]
    assert "†1" in by_sequence
    assert by_sequence.splitlines()[-1].startswith("d [m] ")
    assert len(legend.splitlines()) == 2
    assert run(*patterns, "--verbose")[1].startswith(out.rstrip())


def test_csv_and_json_have_the_same_rows(patterns, run):
    rows = list(csv.DictReader(StringIO(run(*patterns, "--csv")[1])))
    entries = json.loads(run(*patterns, "--json")[1])["systems"]
    assert [list(row) for row in rows] == [list(entry) for entry in entries]
    assert [float(row["PAS"]) for row in rows] == [entry["PAS"] for entry in entries]
    (c,) = (entry for entry in entries if (entry["system"], entry["sequence"]) == ("c", None))
    assert (c["runs"], c["failed_runs"], c["PAS_rank_best"]) == (6, 1, 2)
    assert c["PAS"] < c["PAS_scored"]
    assert (c["half_distance"], c["half_distance_scored"] > 0) == (None, True)


def test_markdown_has_verdict_and_tables(patterns, run, tmp_path):
    run(*patterns, "--markdown", "report.md")
    text = (tmp_path / "report.md").read_text()
    assert text.startswith(r"a_b is ahead of c: it wins 100 %")
    assert "| a_b | 1 | " in text
    assert re.search(r"\| \*\*0\.\d{4}\*\* \|", text)
    assert "†1" in text
    assert run(*patterns, "--markdown", "-")[1] == text


def test_why_scores_are_low_is_told_with_verbose(benchmark_of, run):
    patterns = benchmark_of({"a": (0.5, 10.0, 1, 0.5)}, ["car"], runs=2)
    assert " of the time lost, " not in run(*patterns)[2]
    reason = re.search(r"run 0: (PAS .*)\n", told := run(*patterns, "--verbose")[2])[1]
    assert reason in json.loads(run(*patterns, "--json")[1])["results"][0]["notes"]
    assert re.search(r"note: car, a, run 0: PAS 0\.\d\d: 4\d% of the time lost, ", told)


@pytest.mark.skipif(os.name != "posix", reason="no limit of what is written")
@pytest.mark.parametrize("option", ["--html", "--markdown"])
def test_on_a_full_disk_the_table_is_printed(patterns, run, tmp_path, option):
    """A limit of the size of files stands for it."""
    *command, expected = sys.executable, "-m", "alignscores", "compare", run(*patterns)[1]
    limited = ["bash", "-c", 'ulimit -f 0; exec "$@"', "bash"]
    arguments = *limited, *command, *patterns, option, "saved.html"
    done = subprocess.run(arguments, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (1, expected)
    assert "error: saved.html: cannot be written (File too large)\n" in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"car", "helix"}


def test_where_a_system_was_not_tried_the_tables_say_so(patterns, run, tmp_path):
    shutil.rmtree(tmp_path / "car/c")
    out = run(*patterns)[1]
    assert out.startswith("a_b, c: too few runs to be tested.")
    assert re.search(r"^c .* 1/2 ", out, flags=re.M)
    assert re.search(r"^c +not tried ", out, flags=re.M)
