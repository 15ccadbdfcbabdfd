"""Verdicts and tables: of tables of runs that are given, and by the command."""

import json
import os
import re
import shutil
from io import StringIO

import numpy as np
import pandas as pd
import pytest

from alignscores import compare
from alignscores.texts import text_width

RNG = np.random.default_rng(0)
GOOD, BAD = (0.7 + 0.01 * RNG.random(10)).tolist(), (0.5 + 0.01 * RNG.random(10)).tolist()
MIXED = np.linspace(0.3, 0.9, 10).tolist()


def table(systems, by="PAS"):
    """{system: {sequence: scores, None for a failed run}} -> a table of runs."""
    rows = [
        {"system": system, "sequence": sequence, "run": number, by: score}
        for system, sequences in systems.items()
        for sequence, scores in sequences.items()
        for number, score in enumerate(scores)
    ]
    return pd.DataFrame(rows)


def verdict_of(systems, by="PAS", **options):
    """Return the verdict as one text."""
    return " ".join(compare(table(systems, by), by=by, **options).verdict)


def on(sequences, scores):
    return {f"s{number}": scores for number in range(sequences)}


def ranks(systems):
    overall = compare(table(systems)).overall
    best, worst = (overall[f"rank_{end}"].tolist() for end in ("best", "worst"))
    return dict(zip(overall["system"], zip(best, worst, strict=True), strict=True))


def test_a_system_is_ahead_of_another():
    text = verdict_of({"b": on(1, BAD), "a": on(1, GOOD)})
    start = "a is ahead of b: it wins 100 % of the run pairs on 1 sequence (p < 0.001), mean PAS "
    assert text.startswith(start)
    assert re.fullmatch(r"\+0\.\d{3} \(0\.\d{3} to 0\.\d{3}\)\.", text.removeprefix(start))


def test_ten_systems_that_never_overlap_have_ten_ranks():
    """Neighbours have p = 0.008; a correction for any error would find no difference."""
    ten = {f"s{k}": on(1, [1 - 0.1 * k + 0.01 * n for n in range(5)]) for k in range(10)}
    assert [best for best, _ in ranks(ten).values()] == list(range(1, 11))
    text = verdict_of(ten)
    assert "45 of 45 pairs of systems differ significantly; at most 5 %" in text
    assert "(p = 0.0079, adjusted for 45 pairs 0.0079)" in text


def test_a_third_system_does_not_silence_two():
    rng = np.random.default_rng(1)
    systems = {"a": 0.9, "b": 0.8, "c": 0.5}
    single = {
        a: {f"s{k}": [x + 0.001 * rng.random()] for k in range(6)} for a, x in systems.items()
    }
    assert verdict_of(single).startswith(
        "a is ahead of b: it wins 100 % of the run pairs on 6 sequences"
    )


def test_so_few_runs_are_said_to_be_too_few_and_how_many_are_needed():
    text = verdict_of({"a": on(1, GOOD[:3]), "b": on(1, BAD[:8])})
    assert text == (
        "a has the highest mean PAS (0.7032, 1 sequence), but too few runs for a test. "
        "a and b: with 3 and 8 runs on 1 sequence no result could be significant; "
        "5 runs each are needed."
    )
    # Among many pairs without a difference five runs are too few, too.
    ten_systems = {f"s{k}": on(1, [0.1 * n + 0.001 * k for n in range(5)]) for k in range(10)}
    text = verdict_of(ten_systems)
    assert "with 5 runs each on 1 sequence no result could be significant; 7 runs each are" in text
    pairs = compare(table({"a": on(1, GOOD[:3]), "b": on(1, BAD[:8])})).pairs
    assert pairs["p_raw"].iloc[0] == pytest.approx(2 / 165)
    assert pairs["p"].isna().all()


def test_single_runs_are_compared_on_six_sequences():
    six = {"a": {f"s{k}": [0.5 + 0.01 * k] for k in range(6)}, "b": on(6, [0.4])}
    assert verdict_of(six).startswith(
        "a is ahead of b: it wins 100 % of the run pairs on 6 sequences ("
    )
    assert "On sequences like these, a is ahead (p = 0.031)." in verdict_of(six)
    five = {name: {s: runs[s] for s in list(runs)[:5]} for name, runs in six.items()}
    assert verdict_of(five) == (
        "a has the highest mean PAS (0.52, 5 sequences), but too few runs for a test. "
        "a and b: with single runs on 5 sequences no result could be significant; "
        "6 sequences are needed."
    )


def test_what_holds_on_these_sequences_may_not_hold_on_others():
    mixed = {f"s{k}": GOOD if k < 4 else BAD for k in range(6)}
    text = verdict_of({"a": mixed, "b": {s: [0.6 + x / 100 for x in GOOD] for s in mixed}})
    assert text.startswith("a is ahead of b: it wins 67 %")
    assert "On sequences like these, they are not distinguishable (p = " in text


def test_failures_lose():
    """Also where a system that fails has the better runs otherwise."""
    text = verdict_of({"a": on(1, [GOOD[0], *[None] * 9]), "b": on(1, BAD)})
    assert text.startswith("b is ahead of a: it wins 90 % of the run pairs on 1 sequence (p = ")
    of_errors = verdict_of({"a": on(1, [BAD[0], *[None] * 9]), "b": on(1, GOOD)}, "half_distance")
    assert of_errors.startswith("b is ahead of a: it wins 90 %")
    assert "mean" not in of_errors  # it is infinite


def test_a_mean_that_is_worse_though_more_runs_are_won_is_named(run, tmp_path):
    """As by a failed run; also where the other system has the best mean of a table."""
    systems = {"a": on(2, [*GOOD[:9], None])} | {
        name: on(2, [score - step for score in GOOD])
        for name, step in (("b", 0.03), ("c", 0.04), ("d", 0.3))
    }
    table(systems).to_csv(tmp_path / "runs.csv", index=False)
    text = run("runs.csv", "-o", "out")[1]
    contrast = "though its mean is worse"
    first = " ".join(text.split("\n\n")[0].split())
    assert re.match(rf"a is ahead of b: it wins 90 % [^:]*\), {contrast}: PAS -0\.0\d+ \(-0", first)
    assert f"\na is ahead of c, {contrast}.\n" in text
    assert "\na is ahead of d.\n" in text
    assert f", {contrast}: PAS" in (tmp_path / "out/comparison.md").read_text()
    latex = (tmp_path / "out/comparison.tex").read_text()
    assert re.search(r"\na & 0\.63\d .*\$\^\{>\}\$ \\\\\nb & \\textbf\{0\.67", latex)
    assert r"{>}$\,significantly ahead of the best mean in pairs of runs" in latex
    errors = {"a": on(1, [1 + x for x in GOOD[:9]] + [50.0]), "b": on(1, [2 + x for x in GOOD])}
    assert f"{contrast}: half_distance +3.8" in verdict_of(errors, "half_distance")


def test_a_value_that_a_system_has_elsewhere_counts_as_the_worst():
    """So that writing no rotations, or nothing, where a run is bad gains nothing."""
    runs = table({"a": {"s": [0.9, None, None, None], "t": [None] * 4}, "b": on(2, [0.2] * 4)})
    runs = runs.replace("t", "s1").replace("s", "s0")
    failed = compare(runs).overall.set_index("system")["PAS"]
    assert failed["a"] == pytest.approx(0.9 / 8)
    scored = compare(runs.assign(status="scored")).overall.set_index("system")
    assert scored.loc["a", "PAS"] == pytest.approx(0.9 / 8)
    assert scored.loc["a", "failed"] == 0
    none = runs.assign(status="scored", PAS=runs["PAS"].where(runs["system"] == "b"))
    assert np.isnan(compare(none).overall.set_index("system").loc["a", "PAS"])


def test_means_are_over_the_sequences_that_all_systems_have():
    """A system that leaves out hard sequences, and loses every pair, has no better mean."""
    hard = [x - 0.4 for x in GOOD]
    comparison = compare(
        table({"a": {"s0": [x + 0.02 for x in GOOD], "s1": hard}, "b": {"s0": GOOD}})
    )
    overall = comparison.overall.set_index("system")
    assert list(overall.index) == ["a", "b"]
    assert overall.loc["a", "PAS"] == pytest.approx(np.mean(GOOD) + 0.02)
    assert overall.loc["a", "PAS_all"] == pytest.approx(np.mean(GOOD) - 0.19)
    assert comparison.verdict[-2:] == [
        "b has no run on 1 of 2 sequences (s1).",
        "Means are over the only sequence that all systems have (s0), PAS (all) is over all "
        "sequences of a system; --expect_all counts the missing ones as failed.",
    ]
    text = verdict_of({"a": {"s0": GOOD}, "b": {"s1": GOOD}})
    assert "No sequence has runs of all systems" in text


def test_runs_that_share_something_are_noted_and_count_once():
    rng = np.random.default_rng(3)
    shared = {a: rng.normal(size=5) for a in "ab"}
    systems = {
        a: {f"s{k}": (shared[a] + 0.3 * rng.normal(size=5)).tolist() for k in range(6)}
        for a in "ab"
    }
    comparison = compare(table(systems))
    assert any("--runs dependent counts each as one value" in note for note in comparison.notes)
    dependent = compare(table(systems), dependent=True)
    assert not any("--runs dependent" in note for note in dependent.notes)
    p, p_dependent = (c.pairs["p_raw"].iloc[0] for c in (comparison, dependent))
    assert p < p_dependent
    independent = {a: {f"s{k}": rng.normal(size=5).tolist() for k in range(6)} for a in "ab"}
    assert not compare(table(independent)).notes


def test_systems_with_different_numbers_of_runs_are_noted():
    (note,) = compare(table({"a": on(1, GOOD[5:]), "b": on(1, GOOD)})).notes
    assert note.startswith("a has 5 runs on a sequence, b 10: were bad runs left out?")


def test_a_metric_of_the_user():
    runs = table({"fast": on(1, [1, 2, 3, 4, 5.0]), "slow": on(1, [6, 7, 8, 9, None])}, "seconds")
    comparison = compare(runs, by="seconds", better="smaller")
    assert comparison.verdict[0].startswith("fast is ahead of slow")
    assert comparison.failed == ["s0, slow, run 4: has no seconds"]
    with_unit = compare(runs.assign(unit="s", lost="no"), by="seconds", better="smaller")
    assert with_unit.verdict == comparison.verdict
    again = compare(runs.drop(columns=["sequence", "run"]), by="seconds", better="smaller")
    assert again.pairs["p"].iloc[0] == comparison.pairs["p"].iloc[0]
    for bad, options, message in (
        (runs, {"by": "seconds"}, "unknown metric seconds: set better to larger or smaller"),
        (runs, {"by": "minutes", "better": "smaller"}, "has no column 'minutes'"),
        (runs.drop(columns="system"), {"by": "seconds", "better": "smaller"}, "column 'system'"),
        (runs.assign(run=1), {"by": "seconds", "better": "smaller"}, "for the same run: s0/fast/1"),
        (runs, {"by": "seconds", "better": "small"}, "better must be larger or smaller"),
        (runs.assign(seconds="x"), {"by": "seconds", "better": "smaller"}, "is not numeric"),
    ):
        with pytest.raises(ValueError, match=re.escape(message)):
            compare(bad, **options)


def test_an_interval_stands_only_next_to_a_significant_difference():
    a = [0.499, 0.510, 0.663, 0.561, 0.661, 0.440, 0.594, 0.520, 0.528, 0.652]
    b = [0.367, 0.530, 0.532, 0.392, 0.569, 0.531, 0.427, 0.418, 0.437, 0.571]
    text = verdict_of({"a": on(1, a), "b": on(1, b)})
    assert "not distinguishable: a wins 73 % of the run pairs on 1 sequence (p = 0.0" in text
    assert "mean PAS +0.0854." in text


def test_runs_of_the_same_name_can_be_paired():
    """Where runs vary by what they share, as scenes or seeds."""
    hard = np.linspace(0.2, 0.8, 8)
    systems = {"a": on(1, (hard + 0.02).tolist()), "b": on(1, hard.tolist())}
    assert verdict_of(systems).startswith("a and b are not distinguishable")
    assert verdict_of(systems, paired=True).startswith("a is ahead of b: it wins 100 %")


def test_twelve_systems_on_two_sequences_fit_a_terminal(run, tmp_path):
    systems = {
        f"system_{k:02d}": {s: (RNG.permutation(GOOD) - 0.02 * k).tolist() for s in ("s0", "s1")}
        for k in range(12)
    }
    table(systems).to_csv(tmp_path / "runs.csv", index=False)
    code, out, _ = run("runs.csv")
    assert code == 0
    assert max(map(text_width, out.splitlines())) <= 120
    assert all(f"\n{name} " in out for name in systems)


def test_without_rotations_the_verdict_says_by_what_to_compare(patterns, run):
    words = *patterns, "--ref_columns", "t x y z"
    assert run(*words)[1].startswith("no run has a PAS, which needs rotations; --by TAS compares")
    assert run(*words, "--by", "TAS")[1].startswith("a_b is ahead of c")


def test_a_system_without_any_value_is_named():
    runs = table({"a": on(1, GOOD), "b": on(1, BAD), "c": on(1, [None] * 10)})
    found = compare(runs.assign(status="scored"))
    assert "No run of c has a PAS: not compared." in found.verdict
    assert set(found.pairs["a"]) | set(found.pairs["b"]) == {"a", "b"}


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
    assert "mean" in legend


def test_csv_and_json_have_the_same_runs(patterns, run):
    runs = pd.read_csv(StringIO(run(*patterns, "--csv")[1]), dtype={"run": str})
    content = json.loads(run(*patterns, "--json")[1])
    assert [list(row) for row in content["runs"]] == 12 * [list(runs.columns)]
    assert runs["PAS"].tolist() == [row["PAS"] for row in content["runs"]]
    (c,) = (e for e in content["summary"] if (e["system"], e["sequence"]) == ("c", None))
    assert (c["runs"], c["failed"], c["rank_best"]) == (6, 1, 2)
    assert c["PAS"] < c["PAS_scored"]
    assert (c["half_distance"], c["half_distance_scored"] > 0) == (None, True)
    assert content["verdict"][0].startswith("a_b is ahead of c")


def test_notes_stand_below_the_verdict_in_every_output(patterns, run, tmp_path):
    """A run with the scores of another one is a copy."""
    shutil.copy(tmp_path / "car/c/0.txt", tmp_path / "car/c/1.txt")
    note = "1 of car, c have the scores of an earlier run (copies, or a deterministic system)"
    run(*patterns, "-o", "out", "--jobs", 1)
    saved = {path.suffix: path for path in (tmp_path / "out").iterdir()}
    assert set(saved) == {".html", ".json", ".csv", ".md", ".png", ".tex"}
    for suffix in (".html", ".json", ".md", ".tex"):
        text = saved[suffix].read_text()
        assert text.index("ahead of c") < text.index(note) or suffix == ".json"
    assert f"\nnote: {note}" in " ".join(run(*patterns)[1].split(" ")).replace("\n", "\n")
    statuses = pd.read_csv(saved[".csv"])["status"].value_counts()
    assert statuses.to_dict() == {"scored": 10, "copy": 1, "missing": 1}
    assert compare(saved[".csv"]).verdict == json.loads(saved[".json"].read_text())["verdict"]


def test_markdown_has_verdict_and_tables(patterns, run, tmp_path):
    run(*patterns, "--markdown", "report.md")
    text = (tmp_path / "report.md").read_text()
    assert text.startswith(r"a_b is ahead of c: it wins 100 %")
    assert re.search(r"\| a_b +\| +1 \| ", text)
    assert re.search(r"\| +\*\*0\.\d{4}\*\* \|", text)
    assert "†1" in text
    assert run(*patterns, "--markdown", "-")[1] == text


def test_the_best_mean_is_bold_in_every_output_and_named_though_it_has_no_test(run, tmp_path):
    """Of the sequences that all systems have; system c has single runs on two of three."""
    runs = table({"a": on(3, GOOD), "b": on(3, BAD), "c": {"s0": [0.99], "s1": [0.5]}})
    runs.loc[(runs["system"] == "a") & (runs["sequence"] == "s0"), "PAS"] = 0.3
    runs["TAS"] = 1 - runs["PAS"]
    runs.to_csv(tmp_path / "runs.csv", index=False)
    run("runs.csv", "-o", "out")
    text = run("runs.csv")[1]
    assert text.startswith("a is ahead of b")
    assert (
        "\nc has the highest mean PAS (0.745, 2 sequences), but too few runs for a test.\n" in text
    )
    assert "bold" not in text
    assert "means over runs, then the 2 sequences that all systems have;" in text
    marks = {"html": r"<b>([\d.]+)", "md": r"\*\*([\d.]+)", "tex": r"textbf{([\d.]+)"}
    for suffix, mark in marks.items():
        saved = (tmp_path / f"out/comparison.{suffix}").read_text()
        bold = [float(number) for number in re.findall(mark, saved)]
        of_a = np.mean(GOOD)
        assert bold[:2] == pytest.approx([(1.7 - of_a) / 2, 0.745], abs=1e-3)  # TAS of a, PAS of c
        assert bold[2:] == pytest.approx([] if suffix == "tex" else [of_a, of_a, 0.99], abs=1e-4)
        assert "bold: best mean, significant or not" in saved


def test_where_nothing_is_better_nothing_is_bold(run, tmp_path):
    for systems in ({"a": on(1, GOOD)}, {"a": on(1, GOOD), "b": on(1, GOOD[::-1])}):
        table(systems).to_csv(tmp_path / "runs.csv", index=False)
        assert "textbf" not in run("runs.csv", "--latex")[1]
        shown = run("runs.csv", "--markdown", "-")[1].replace(r"\*", "")
        assert "**" not in shown
        assert "bold" not in shown
    worst = {"a": on(1, GOOD), "b": on(1, [*GOOD[:4], None])}
    table(worst, "half_distance").to_csv(tmp_path / "runs.csv", index=False)
    assert run("runs.csv", "--by", "half", "--latex")[1].count("textbf") == 1


def test_latex_has_the_best_in_bold_and_ties_marked(run, tmp_path):
    systems = {"a_1": on(1, GOOD), "b": on(1, [x + 0.0001 for x in GOOD]), "c": on(1, BAD)}
    table(systems).to_csv(tmp_path / "runs.csv", index=False)
    lines = run("runs.csv", "--latex")[1].splitlines()
    assert lines[0] == r"\begin{tabular}{lr}"
    assert lines[2] == r"system & PAS \\"
    a, b, c = sorted(lines[4:7])
    assert re.fullmatch(r"a\\_1 & 0\.\d{3} \$\\pm\$ 0\.\d{3}\$\^\{=\}\$ \\\\", a)
    assert re.fullmatch(r"b & \\textbf\{0\.\d{3}\} \$\\pm\$ 0\.\d{3} \\\\", b)
    assert re.fullmatch(r"c & 0\.\d{3} \$\\pm\$ 0\.\d{3} \\\\", c)
    start, end = r"\multicolumn{2}{l}{\footnotesize ", r"} \\"
    assert [line.removeprefix(start).removesuffix(end) for line in lines[8:12]] == [
        r"mean over sequences $\pm$ standard deviation of the runs on a sequence",
        "bold: best mean, significant or not",
        r"$^{=}$\,not significantly different from the best (false discovery rate 5\,\%)",
        r"\end{tabular}",
    ]


def test_latex_has_three_digits_marks_failures_and_all_sequences(run, tmp_path):
    near = [0.0123, 0.0121, 0.0125, 0.0124, 0.0122]
    systems = {
        "a": {"s": near, "t": near},
        "b": {"s": [10 * x for x in near[:4]] + [None], "t": near},
        "c": {"s": [2 * x for x in near]},
    }
    table(systems, "half_distance").to_csv(tmp_path / "runs.csv", index=False)
    lines = run("runs.csv", "--by", "half_distance", "--latex")[1].splitlines()
    assert lines[2] == r"system & half & half\_distance (all) \\"
    a, b, c = sorted(lines[4:7])
    assert a == r"a & \textbf{0.0123} $\pm$ 0.0002 & 0.0123 \\"
    assert re.fullmatch(r"b & 0\.1232\$\^\{\\dagger\}\$ & -- \\\\", b)
    assert c == r"c & 0.0246 $\pm$ 0.0003 & 0.0246 \\"
    assert "% c has no run on 1 of 2 sequences (t)." in lines
    scores = {"a": {"s": [1.0] * 5}, "b": {"s": [1.0, 1.0, 0.9787, 1.0, 1.0]}}
    table(scores, "RAS").to_csv(tmp_path / "runs.csv", index=False)
    lines = run("runs.csv", "--by", "RAS", "--latex")[1].splitlines()
    assert r"\textbf{1.000}" in lines[4]
    assert "0.996" in lines[5]


def test_verbose_says_why_scores_are_low(benchmark_of, run):
    patterns = benchmark_of({"a": (0.5, 10.0, 1, 0.5)}, ["car"], runs=2)
    assert "of the time lost, " not in run(*patterns)[1]
    text = " ".join(run(*patterns, "--verbose")[1].split())
    assert re.search(r"note: car, a, run 0: PAS 0\.\d\d: 4\d% of the time lost, ", text)
    assert json.loads(run(*patterns, "--json")[1])["runs"][0]["low_score"] in text


@pytest.mark.skipif(os.name != "posix", reason="no limit of what is written")
def test_on_a_full_disk_the_table_is_printed(patterns, run, tmp_path):
    """A limit of the size of files stands for it."""
    import resource

    expected = run(*patterns)[1]
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, limits[1]))
    try:
        code, out, err = run(*patterns, "--save_page", "saved.html")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert (code, out) == (1, expected)
    assert "error: saved.html: cannot be written (File too large)\n" in err
    assert {path.name for path in tmp_path.iterdir()} == {"car", "helix"}


def test_where_a_system_was_not_tried_the_tables_say_so(patterns, run, tmp_path):
    shutil.rmtree(tmp_path / "car/c")
    out = run(*patterns)[1]
    best, too_few = out.splitlines()[:2]
    assert re.match(r"a_b has the highest mean PAS \(0\.\d+, 1 sequence\), but too few runs", best)
    assert too_few.startswith("a_b and c: with 3 runs each on 1 sequence no result could be")
    assert "means over runs, then the sequence all systems have;" in out
    assert "c has no run on 1 of 2 sequences (car)." in out
    assert re.search(r"^c .* 1/2 ", out, flags=re.M)
    assert re.search(r"^c +not tried ", out, flags=re.M)
