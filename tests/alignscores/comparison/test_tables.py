"""What is printed: table, CSV, Markdown and LaTeX."""

import csv
import json
import os
import re
import shutil
import subprocess
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from alignscores import Settings
from alignscores.comparison import tables
from alignscores.comparison.benchmark import Run
from alignscores.comparison.intervals import error_of_pair, largest_scatter
from alignscores.comparison.runs import Outcome
from alignscores.comparison.summary import _ranks, summarise
from alignscores.trajectories.formats import FORMATS

CAMERAS = 10
NAMES_BY_HAND = tables.Names({"d": "D", "l": "L_1", "o": "O"}, {"car": "the car", "hill": "hill"})


def by_hand(pas, lost=0.0, scale=1.0):
    """A run with scores that are easily averaged."""
    scores = dict.fromkeys(("TAS", "RAS", "PAS"), pas)
    scores |= {"half_distance": 1 - pas, "half_angle": 10 * (1 - pas)}
    failures = round(lost * CAMERAS)
    return Outcome(scores, n=CAMERAS, failures=failures, unit=1.0, lost=lost, scale=scale)


@pytest.fixture(scope="module")
def small():
    """The summary of three systems: one is not tried on a sequence, of one a run fails."""
    lost = Outcome({}, error="lost")
    outcomes = {
        ("car", "d"): [by_hand(0.875), by_hand(0.875, scale=2.0)],
        ("car", "l"): [by_hand(0.5, 0.1)] * 2,
        ("car", "o"): [by_hand(0.375), by_hand(0.375), lost],
        ("hill", "d"): [by_hand(0.75, scale=0.25)] * 2,
        ("hill", "o"): [by_hand(0.5), by_hand(0.25, 0.5)],
    }
    runs = [
        (Run(sequence, system, str(number), f"{sequence}/{system}/{number}.txt"), outcome)
        for (sequence, system), several in outcomes.items()
        for number, outcome in enumerate(several)
    ]
    return summarise(runs, [], FORMATS["tum"])


TEXT = """\
system  rank (PAS)           TAS           RAS           PAS        half m      half deg  sequences
D              1-2  0.8125 (1-2)  0.8125 (1-2)  0.8125 (1-2)  0.1875 (1-2)  1.8750 (1-2)        2/2
L_1              2    0.5000 (2)    0.5000 (2)    0.5000 (2)    0.5000 (2)    5.0000 (2)        1/2
O              2-3  0.3125 (2-3)  0.3125 (2-3)  0.3125 (2-3)       ∞ (2-3)       ∞ (2-3)        2/2

system  PAS of scored runs   failed runs   lost
D                   0.8125  0/4 (0-60 %)   0.0%
L_1                 0.5000  0/2 (0-84 %)  10.0%
O                   0.3750  1/5 (1-72 %)  29.2%

PAS        the car          hill
D       0.8750 (1)  0.7500 (1-2)
L_1     0.5000 (2)     not tried
O    0.2500 (3) †1  0.3750 (1-2)"""

MARKDOWN = """\
| PAS | the car | hill |
| --- | ---: | ---: |
| D | **0.8750** (1) | 0.7500 (1-2) |
| L_1 | 0.5000 (2) | not tried |
| O | 0.2500 (3) †1 | 0.3750 (1-2) |"""

LATEX = r"""% half_distance: mean over runs
% bold: ahead of all others (95 % for all pairs of a column)
% ranks are for new runs on these sequences
% ranks are by errors of runs that did not fail, and by how often runs fail
\begin{tabular}{lrrr}
\toprule
half m & the car & hill & overall \\
\midrule
D & \textbf{0.1250} & 0.2500 & 0.1875 \\
L\_1 & 0.5000 & -- & 0.5000 \\
O & $\infty$\textsuperscript{\dag1} & 0.6250 & $\infty$\textsuperscript{\dag1} \\
\bottomrule
\end{tabular}
% lost: D 0.0\%, L\_1 10.0\%, O 29.2\%
% failed runs: D 0/4 (0-60 \%), L\_1 0/2 (0-84 \%), O 1/5 (1-72 \%)
% half\_distance of scored runs: D 0.1875, L\_1 0.5000, O 0.6250"""

FOOTNOTES = """\
means over runs, overall over sequences; registration refined
missing cameras: fail; failed and missing runs count as failures
failed runs: in brackets, how often runs fail (95 %)
lost: share of the time that was due without a pose
scale: D 0.25 times the reference's, taken out; --alignment rigid counts it
sequences: those that a system was tried on; pairs are ranked by those of both
(1-2): ranks, shared where they cannot be told apart (95 % for all pairs of a column)
ranks are for new runs on these sequences
ranks are by means: a failure counts as 0, and one more would not change who is ahead
†1: so many runs failed or are missing"""


def test_what_is_told_of_a_run(small):
    """A run that failed has the worst values, and all the cameras that were due."""
    told = {(entry["sequence"], entry["system"], entry["run"]): entry for entry in small.results}
    assert told["hill", "o", "1"] == {
        **{"sequence": "hill", "system": "o", "run": "1", "file": "hill/o/1.txt"},
        **{"status": "scored", "error": None, "TAS": 0.25, "RAS": 0.25, "PAS": 0.25},
        **{"half_distance": 0.75, "half_angle": 7.5, "metrics": {}, "n": 10, "failures": 5},
        **{"lost": 0.5, "unit": 1.0, "parts": 1, "scale": 1.0, "notes": []},
    }
    assert told["car", "o", "2"] == {
        **{"sequence": "car", "system": "o", "run": "2", "file": "car/o/2.txt"},
        **{"status": "failed", "error": "lost", "TAS": 0, "RAS": 0, "PAS": 0},
        **{"half_distance": np.inf, "half_angle": np.inf, "metrics": {}, "n": 10, "failures": 10},
        **{"lost": 1.0, "unit": None, "parts": 1, "scale": None, "notes": []},
    }


def test_a_run_without_a_file_is_missing():
    runs = [
        (Run("s", "a", "1", "file"), by_hand(0.5)),
        (Run("s", "a", "2", None), Outcome({}, error="x")),
    ]
    found = summarise(runs, ["ate:rmse"], FORMATS["nerf"])
    assert [entry["status"] for entry in found.results] == ["scored", "missing"]
    assert [entry["metrics"] for entry in found.results] == [{"ate:rmse": np.inf}] * 2
    assert list(found.headers.values()) == [
        "TAS",
        "RAS",
        "PAS",
        "half",
        "half deg",
        "ate:rmse",
    ]


def test_what_no_run_on_a_sequence_is_given_a_failed_run_does_not_lack():
    """A distance of few cameras: on s none has it, on t one of two, on u no run was scored."""
    few = Outcome({**by_hand(0.5).scores, "half_distance": np.nan})
    outcomes = {
        "s": [few, Outcome({}, error="lost"), few],
        "t": [few, Outcome({}, error="lost"), by_hand(0.75)],
        "u": [Outcome({}, error="lost")],
    }
    runs = [
        (Run(sequence, "a", str(number), "file"), outcome)
        for sequence, several in outcomes.items()
        for number, outcome in enumerate(several)
    ]
    found = summarise(runs, [], FORMATS["tum"])
    nan = np.nan
    assert [entry["half_distance"] for entry in found.results] == pytest.approx(
        [nan, nan, nan, nan, np.inf, 0.25, np.inf], nan_ok=True
    )
    assert [entry["PAS"] for entry in found.results] == [0.5, 0, 0.5, 0.5, 0, 0.75, 0]
    means = [found.entries["a", place]["half_distance"] for place in ("s", "t", "u", None)]
    assert means == pytest.approx([nan, np.inf, np.inf, np.inf], nan_ok=True)
    assert found.entries["a", "t"]["scored"]["half_distance"] == 0.25


def test_what_is_told_of_a_system(small):
    for sequence, n, failed in (("car", 3, 1), ("hill", 2, 0)):
        entry = small.entries["o", sequence]
        limits = stats.binomtest(failed, n).proportion_ci(0.95, method="exact")
        assert entry["failing"] == pytest.approx(tuple(limits))
        assert entry["scored"] == {
            **dict.fromkeys(("TAS", "RAS", "PAS"), 0.375),
            **{"half_distance": 0.625, "half_angle": 6.25},
        }
        assert "sequences" not in entry
    overall = small.entries["o", None]
    limits = stats.binomtest(1, 5).proportion_ci(0.95, method="exact")
    assert overall["failing"] == pytest.approx(tuple(limits))
    assert (overall["system"], overall["sequence"], overall["sequences"]) == ("o", None, 2)
    assert small.entries["l", "hill"] | {"lost": None} == {
        **{"system": "l", "sequence": "hill", "runs": 0, "failed_runs": 0, "n": 0, "failures": 0},
        **{"lost": None, "failing": None},
        **{key: pytest.approx(np.nan, nan_ok=True) for key in small.headers},
        **{f"{key}_sd": None for key in small.headers},
        **{"scored": dict.fromkeys(small.headers, pytest.approx(np.nan, nan_ok=True))},
        **{"rank": dict.fromkeys(small.headers)},
    }
    assert [(e["system"], e["sequence"]) for e in small.in_order()] == [
        *(("d", "car"), ("l", "car"), ("o", "car"), ("d", "hill"), ("o", "hill")),
        *(("d", None), ("l", None), ("o", None)),
    ]


def test_what_is_told_of_pairs(small):
    keys = "a", "b", "sequence", "sequences", "question", "better", "distinguishable"
    pairs = [pair for pair in small.comparisons if pair["metric"] == "PAS"]
    assert [tuple(pair[key] for key in keys) for pair in pairs] == [
        ("d", "l", "car", 1, "new_runs", "a", True),
        ("d", "o", "car", 1, "new_runs", "a", True),
        ("l", "o", "car", 1, "new_runs", "a", True),
        ("d", "o", "hill", 1, "new_runs", None, False),
        ("d", "l", None, 1, "new_runs", "a", True),
        ("d", "o", None, 2, "new_runs", None, False),
        ("l", "o", None, 1, "new_runs", "a", True),
    ]
    assert [pair["difference"] for pair in pairs] == [
        0.375,
        0.5,
        0.125,
        0.375,
        0.375,
        0.4375,
        0.125,
    ]
    of_all = pairs[5]
    assert of_all["new_runs"].items() <= of_all.items()
    assert of_all["new_sequences"] is not None
    assert pairs[3]["new_sequences"] is None
    half = stats.t.ppf(1 - error_of_pair(2) / 2, 1) * 0.125  # of runs 0.5 and 0.25
    errors = [pair for pair in small.comparisons if pair["metric"] == "half_angle"]
    (found,) = (pair for pair in errors if pair["sequence"] == "hill")
    assert (found["low"], found["high"]) == pytest.approx((-3.75 - 10 * half, -3.75 + 10 * half))


def test_one_run_each_has_a_gap_and_no_answer():
    runs = [
        (Run(sequence, system, "1", "file"), by_hand(pas))
        for sequence, of in (("s", (0.75, 0.5)), ("t", (0.5, 0.125)))
        for system, pas in zip("ab", of, strict=True)
    ]
    found = summarise(runs, [], FORMATS["tum"])
    on_s, on_t, over_all = (pair for pair in found.comparisons if pair["metric"] == "TAS")
    for pair, gap in ((on_s, 0.25), (on_t, 0.375)):
        assert (pair["question"], pair["better"], pair["needed"]) == (None, None, None)
        assert (pair["difference"], pair["distinguishable"]) == (gap, False)
        assert np.isnan([pair["low"], pair["high"], pair["failing"]["low"]]).all()
    assert (over_all["question"], over_all["difference"]) == ("new_sequences", 0.3125)


def test_ranks_count_who_is_ahead_and_who_is_not_behind():
    better = {("a", "b"): "a", ("a", "c"): "a", ("b", "d"): "b"}
    assert _ranks("abcd", better) == {"a": [1, 2], "b": [3, 4], "c": [2, 4], "d": [1, 3]}
    assert _ranks("ab", {}) == {"a": [1, 2], "b": [1, 2]}


def test_all_that_the_text_has(small):
    assert tables.as_text(small, "PAS", NAMES_BY_HAND) == TEXT
    settings = Settings(format="tum")
    assert "\n".join(tables.footnotes(small, "PAS", NAMES_BY_HAND, settings)) == FOOTNOTES


PLAIN = """\
system  rank (PAS)         TAS         RAS         PAS      half m    half deg   failed runs  lost
O                1  0.6250 (1)  0.6250 (1)  0.6250 (1)  0.3750 (1)  3.7500 (1)  0/4 (0-60 %)  0.0%
D                2  0.3750 (2)  0.3750 (2)  0.3750 (2)  0.6250 (2)  6.2500 (2)  0/4 (0-60 %)  0.0%

PAS     the car        hill
O    0.7500 (1)  0.5000 (1)
D    0.5000 (2)  0.2500 (2)"""


def test_where_all_were_tried_and_none_failed_nothing_is_said_of_it():
    outcomes = {"car": (0.5, 0.75), "hill": (0.25, 0.5)}
    runs = [
        (Run(sequence, system, number, "file"), by_hand(pas))
        for sequence, values in outcomes.items()
        for system, pas in zip("do", values, strict=True)
        for number in "12"
    ]
    found = summarise(runs, [], FORMATS["tum"])
    assert tables.as_text(found, "PAS", NAMES_BY_HAND) == PLAIN
    footnotes = tables.footnotes(found, "PAS", NAMES_BY_HAND, Settings(format="colmap"))
    assert [line.partition(":")[0] for line in footnotes] == [
        "means over runs, overall over sequences; registration refined",
        *("missing cameras", "failed runs", "(1-2)"),
        "ranks are for new runs on these sequences",
        "ranks are by means",
    ]
    assert tables.as_latex(found, "PAS", NAMES_BY_HAND).endswith(
        "\\end{tabular}\n% lost: O 0.0\\%, D 0.0\\%"
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [
        *((np.inf, "∞"), (-np.inf, "-"), (np.nan, "-"), (0.0, "0.0000"), (-0.12346, "-0.1235")),
        *((9.99994, "9.9999"), (9.99996, "10.0000"), (10.0, "10"), (-10.04, "-10.04")),
        *((123.456, "123.5"), (123456.0, "1.235e+05")),
    ],
)
def test_numbers_have_four_digits(value, text):
    assert tables.number(value) == text


def test_failures_have_their_interval_in_percent():
    entry = {"failed_runs": 7, "runs": 8, "failing": (0.842, 0.951)}
    assert tables.failures_text(entry) == "7/8 (84-95 %)"


@pytest.mark.parametrize(("width", "blocks"), [(99, 3), (98, 3), (32, 8), (31, 10), (1, 12)])
def test_a_table_that_is_too_wide_is_in_parts(small, width, blocks):
    parts = tables.as_text(small, "PAS", NAMES_BY_HAND, width).split("\n\n")
    assert len(parts) == blocks
    assert {part.splitlines()[1].split()[0] for part in parts} == {"D"}
    if width > 20:
        assert max(map(len, "\n".join(parts).splitlines())) <= width


def test_all_that_markdown_has(small):
    overall, by_sequence = tables.as_markdown(small, "PAS", NAMES_BY_HAND).split("\n\n")
    assert by_sequence == MARKDOWN
    cells = [line[2:-2].split(" | ") for line in overall.splitlines()]
    blocks = [re.sub(r" {2,}", "|", block).splitlines() for block in TEXT.split("\n\n")[:2]]
    header, *rows = [
        first.split("|") + second.split("|")[1:] for first, second in zip(*blocks, strict=True)
    ]
    assert cells == [header, ["---", *["---:"] * (len(header) - 1)], *rows]


def test_all_that_latex_has(small):
    assert tables.as_latex(small, "half_distance", NAMES_BY_HAND) == LATEX


def test_all_that_csv_has(small):
    rows = list(csv.DictReader(StringIO(tables.as_csv(small), newline="")))
    columns = ["TAS", "RAS", "PAS", "half_distance", "half_angle"]
    counts = ["rank_best", "rank_worst", "runs", "failed_runs", "n", "failures", "lost"]
    spread = [f(column) for column in columns for f in (str, "{}_sd".format)]
    assert list(rows[0]) == ["system", "sequence", *spread, *counts]
    found = {(row["system"], row["sequence"]): [row[key] for key in counts] for row in rows}
    assert list(found.items()) == [
        (("d", "car"), ["1", "1", "2", "0", "20", "0", "0.0"]),
        (("l", "car"), ["2", "2", "2", "0", "20", "2", "0.1"]),
        (("o", "car"), ["3", "3", "3", "1", "30", "10", str(1 / 3)]),
        (("d", "hill"), ["1", "2", "2", "0", "20", "0", "0.0"]),
        (("o", "hill"), ["1", "2", "2", "0", "20", "5", "0.25"]),
        (("d", ""), ["1", "2", "4", "0", "40", "0", "0.0"]),
        (("l", ""), ["2", "2", "2", "0", "20", "2", "0.1"]),
        (("o", ""), ["2", "3", "5", "1", "50", "15", str((1 / 3 + 0.25) / 2)]),
    ]
    values = [(row["PAS"], row["PAS_sd"], row["half_distance_sd"]) for row in rows]
    assert values[1] == ("0.5", "0.0", "0.0")
    assert (rows[2]["half_angle"], rows[6]["half_angle"]) == ("inf", "5.0")
    assert values[6] == ("0.5", "", "")
    assert float(values[2][1]) == pytest.approx(np.std([0.375, 0.375, 0], ddof=1))
    assert values[2][2] == ""


def a_pair(systems, sequence, **changes):
    first, second = systems
    return {
        **{"a": first, "b": second, "sequence": sequence, "metric": "PAS", "question": "new_runs"},
        **{"difference": 0.1, "low": -0.1, "high": 0.3, "needed": 7, "distinguishable": False},
        **{"sequences": 1},
    } | changes


def explained(*pairs, by="PAS", scored=(0.9, 0.8), systems="ba"):
    means = dict(zip("ab", scored, strict=True))
    entries = {(name, None): {by: mean, "scored": {by: mean}} for name, mean in means.items()}
    summary = SimpleNamespace(systems=systems, entries=entries, comparisons=list(pairs))
    names = tables.Names({"a": "A", "b": "B"}, {})
    return tables.ranks_explained(summary, by, names, "ranks")


RANKED = "ranks (95 % for all pairs of a column)"
BY_MEANS = "ranks are by means: a failure counts as 0, and one more would not change who is ahead"
ONE_RUN = "no ranks where systems have one run each: nothing tells how runs scatter"
NO_SCATTER = "PAS of A and B: runs of each that would do, if they scatter (sd) at most: "


@pytest.mark.parametrize(
    ("on_sequences", "over_all", "what", "unit"),
    [
        (
            "new_runs",
            "new_runs",
            "for new runs on these sequences",
            "runs of each on each sequence",
        ),
        (
            *("new_runs", "new_sequences"),
            *("for new runs; over all, for new sequences like these", "sequences"),
        ),
        (None, "new_sequences", "over all, for new sequences like these", "sequences"),
        ("new_runs", None, "on a sequence, for new runs", None),
    ],
)
def test_what_ranks_are_for(on_sequences, over_all, what, unit):
    pairs = a_pair("ba", "s", question=on_sequences), a_pair("ba", None, question=over_all)
    ranked, scatter = explained(*pairs)[:3], explained(*pairs)[3:]
    assert ranked == [RANKED, f"ranks are {what}", BY_MEANS]
    if unit:
        assert scatter.pop() == f"PAS of A and B: about 7 {unit} would do"
    if None in (on_sequences, over_all):
        assert scatter.pop(0) == ONE_RUN
        assert scatter.pop().startswith(NO_SCATTER)
    assert scatter == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, ["about 7"]),
        ({"needed": None}, ["more than 1000"]),
        ({"low": 0.1}, ["certain but for failures; about 7"]),
        ({"low": -0.3, "high": -0.1}, ["certain but for failures; about 7"]),
        ({"low": 0.0}, ["about 7"]),
        ({"low": -0.3, "high": 0.0}, ["about 7"]),
        ({"low": np.nan, "high": np.nan}, []),
        ({"distinguishable": True}, []),
    ],
)
def test_how_many_runs_would_do(changes, said):
    lines = explained(a_pair("ba", "s"), a_pair("ba", None, **changes))[3:]
    assert lines == [
        f"PAS of A and B: {part} runs of each on each sequence would do" for part in said
    ]


@pytest.mark.parametrize("difference", [0.1, -0.1])
def test_one_run_each_takes_more_runs_than_bear_a_failure(difference):
    """With n runs and one more that fails 0.9 is 0.9 n / (n + 1), above 0.8 from the 9th on."""
    unknown = {"question": None, "low": np.nan, "high": np.nan, "needed": None}
    pairs = [a_pair("ba", place, **unknown, difference=difference) for place in ("s", None)]
    first, scatter = explained(*pairs)
    assert first == ONE_RUN
    numbers = re.fullmatch(re.escape(NO_SCATTER) + r"10 by (.*), 20 by (.*), 50 by (.*)", scatter)
    expected = [f"{largest_scatter(0.1, n, error_of_pair(2)):.2g}" for n in (10, 20, 50)]
    assert list(numbers.groups()) == expected
    pairs[1]["sequences"] = 2  # twice as many runs in all: above 8 / 2
    assert explained(*pairs)[1].startswith(f"{NO_SCATTER}5 by ")
    pairs[1]["difference"] = 0
    assert explained(*pairs) == [ONE_RUN]


def test_runs_with_which_a_failure_makes_the_means_equal_do_not_do():
    """With three runs and one more that fails 0.75 is 0.5625, with five 0.625."""
    unknown = {"question": None, "low": np.nan, "high": np.nan, "needed": None}
    pairs = [a_pair("ba", place, **unknown, difference=0.1875) for place in ("s", None)]
    for scored, first in (((0.75, 0.5625), 5), ((0.749, 0.5615), 3)):
        assert explained(*pairs, scored=scored)[1].startswith(f"{NO_SCATTER}{first} by ")
    pairs[1]["difference"] = 0.001
    assert explained(*pairs)[1] == f"{NO_SCATTER}more than 100"


def test_errors_do_not_bound_the_number_of_runs():
    unknown = {"question": None, "metric": "half_distance", "low": np.nan}
    pairs = [a_pair("ba", place, **unknown, difference=-0.1) for place in ("s", None)]
    _, scatter = explained(*pairs, by="half_distance", scored=(0.8, 0.9))
    assert scatter.startswith("half_distance of A and B: runs of each")
    assert re.search(r": 3 by [\d.]+, 5 by [\d.]+, 10 by [\d.]+$", scatter)


def test_parts_that_do_not_compare_are_no_ranks():
    why = "no ranks where models are in different numbers of parts, which do not compare"
    assert explained() == [why]
    assert explained(systems="a") == []
    assert explained(a_pair("ba", None, metric="TAS")) == [why]


@pytest.mark.parametrize(
    ("scales", "farthest"),
    [
        ([2.0, 0.4, 1.0], 0.4),
        ([0.4, 2.0], 0.4),
        ([0.6, 2.0], 2.0),
        ([0.5, 2.0], 0.5),
        ([2.0, 0.5], 2.0),
        ([None, 1.0], 1.0),
        ([None], None),
    ],
)
def test_the_scale_that_is_told(scales, farthest):
    results = [{"system": "a", "scale": scale} for scale in scales]
    assert tables._scales(SimpleNamespace(systems="ab", results=results)) == {
        "a": farthest,
        "b": None,
    }


def test_text(patterns, run):
    code, out, err = run(*patterns)
    assert code == 1
    assert err == "alignscores: error: c: has no run 2 on car; it counts as a failure\n"
    *overall, by_sequence, notes = out.strip().split("\n\n")  # in as many pieces as it takes
    assert re.match(r"system  rank \(PAS\) +TAS +RAS +PAS +half m +half deg", overall[0])
    assert overall[-1].splitlines()[0].endswith("lost")
    header, first, second = by_sequence.splitlines()
    assert header.split() == ["PAS", "car", "helix"]
    assert re.fullmatch(r"a_b +0\.\d{4} \([12-]+\) +0\.\d{4} \(1\)", first)
    assert re.fullmatch(r"c +0\.\d{4} \([12-]+\) †1 +0\.\d{4} \(2\)", second)
    assert "†1: so many runs failed or are missing" in notes
    assert "\nlost: share of the time that was due without a pose\n" in notes
    assert "would do" not in notes  # to tell the two apart over all
    assert "\nmissing cameras: fail; failed and missing runs count as failures\n" in notes
    assert max(map(len, out.splitlines())) <= 100


def test_no_column_is_wider_than_the_terminal(patterns, run, monkeypatch):
    wide = run(*patterns)[1].partition("means over")[0]
    monkeypatch.setenv("COLUMNS", "40")
    narrow = run(*patterns)[1].partition("means over")[0]
    assert max(map(len, narrow.splitlines())) <= 40
    assert set(narrow.split()) == set(wide.split())


def test_the_scale_of_a_system_is_that_farthest_off_among_its_runs(benchmark_of, run, tmp_path):
    """The estimates are three times as large as the reference; those of one system are mended."""
    systems = {"large": (0.05, 1.0, 1, 0.0), "mostly_right": (0.05, 1.0, 1, 0.0)}
    patterns = benchmark_of(systems, ["car"], n=40)
    for number, factor in ((0, 1 / 3), (1, 1 / 3), (2, 1 / 4)):
        path = tmp_path / f"car/mostly_right/{number}.txt"
        poses = np.loadtxt(path)
        poses[:, 1:4] *= factor
        np.savetxt(path, poses)
    (tmp_path / "car/large/1.txt").write_text("")  # a run that failed has no scale
    _, out, _ = run(*patterns)
    (line,) = (line for line in out.splitlines() if line.startswith("scale: "))
    told = r"scale: (.*) times the reference's, taken out; --alignment rigid.*"
    named = re.fullmatch(told, line)[1].split(", ")
    found = {name: float(scale) for name, scale in (each.split() for each in named)}
    assert found == pytest.approx({"large": 3, "mostly_right": 0.75}, rel=0.02)
    results = {(r["system"], r["run"]): r["scale"] for r in compared(run, patterns)}
    assert results["large", "1"] is None
    assert results["large", "0"] == pytest.approx(3, rel=0.02)
    assert results["mostly_right", "2"] == pytest.approx(0.75, rel=0.02)
    assert "scale: " not in run(*patterns, "--alignment", "rigid")[1]
    scales = {one["scale"] for one in compared(run, patterns, "--alignment", "rigid")}
    assert scales == {1, None}


def compared(run, patterns, *options):
    return json.loads(run(*patterns, *options, "--json")[1])["results"]


def test_csv_and_markdown(patterns, run):
    rows = list(csv.DictReader(run(*patterns, "--csv")[1].splitlines()))
    assert [(row["sequence"], row["system"]) for row in rows] == [
        (sequence, system) for sequence in ("car", "helix", "") for system in ("a_b", "c")
    ]
    assert rows[1]["failed_runs"] == "1"
    text = run(*patterns, "--markdown", "--by", "TAS")[1]
    value = f"{float(rows[2]['TAS']):.4f}"
    assert re.search(rf"^\| a_b \| [^|]+ \| \*\*{value}\*\* \(1\) \|$", text, re.MULTILINE)
    tables = [re.findall(r"\|", line) for line in text.split("\n\n")[1].splitlines()]
    assert len(set(map(len, tables))) == 1


def test_latex(patterns, run, tmp_path):
    text = run(*patterns, "--latex")[1]
    assert {r"\toprule", r"\midrule", r"\bottomrule"} < set(text.splitlines())
    for part in (r"a\_b & ", r"\textsuperscript{\dag1}"):
        assert part in text
    lines = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert lines[0] == r"PAS & car & helix & overall \\"
    assert all(re.fullmatch(r"\S+( & [^&]*[\d}]){3} \\\\", line) for line in lines[1:])
    (best,) = (line for line in lines if line.startswith(r"a\_b & "))
    assert best.count("textbf") == 3  # certain on both sequences, and over all
    assert text.startswith("% PAS: mean over runs\n% bold: ahead of all others (95 % for all")
    assert "\n% ranks are for new runs on these sequences" in text


def test_ranks_over_sequences_with_a_run_each_say_what_they_are_for(benchmark_of, run):
    systems = {"good": (0.02, 1.0, 1, 0.0), "poor": (0.5, 9.0, 1, 0.0)}
    text = run(*benchmark_of(systems, ["car", "helix", "cube"], 1, n=60))[1]
    assert "\nranks are over all, for new sequences like these\n" in text


def test_where_a_system_was_not_tried_the_tables_say_so(patterns, run, tmp_path):
    shutil.rmtree(tmp_path / "car/c")
    text = run(*patterns)[1]
    assert re.search(r"^c .* not tried ", text, re.MULTILINE)
    assert "sequences: those that a system was tried on" in text
    (row,) = re.findall(r"^c & .*", run(*patterns, "--latex")[1], re.MULTILINE)
    assert "--" in row.split(" & ")


def test_models_in_different_numbers_of_parts_have_no_ranks(run, examples, tmp_path):
    for name in ("reference", "whole/0", "parts/0/0", "parts/0/1"):
        source = examples / "colmap" / ("reference" if name == "reference" else "estimate")
        shutil.copytree(source, tmp_path / name)
    out = run("colmap", "reference", "{system}/{run}", "--jobs", 1)[1]
    assert "no ranks where models are in different numbers of parts" in out


def test_what_failed_stands_beside_the_ranks_everywhere(patterns, run, tmp_path):
    rule = "ranks are by means: a failure counts as 0, and one more would not change who is ahead"
    entries = json.loads(run(*patterns, "--json")[1])["systems"]
    (entry,) = (one for one in entries if (one["system"], one["sequence"]) == ("c", None))
    scored = f"{entry['scored']['PAS']:.4f}"
    low, high = (round(100 * limit) for limit in entry["failing"])
    latex = run(*patterns, "--latex")[1]
    assert re.search(rf"^% PAS of scored runs: a\\_b 0\.\d+, c {scored}$", latex, re.MULTILINE)
    assert rf", c 1/6 ({low}-{high} \%)" in latex
    assert f"% {rule}\n" in latex
    run(*patterns, "--html", "page.html")
    for text in (run(*patterns)[1], (tmp_path / "page.html").read_text()):
        assert all(part in text for part in ("PAS of scored runs", scored, f"1/6 ({low}-{high} %)"))
        assert rule in text
    assert "ranks are by errors of runs that did" in run(*patterns, "--by", "half_angle")[1]


def test_one_run_each_has_no_ranks_anywhere(benchmark_of, run, tmp_path):
    patterns = benchmark_of(
        {"good": (0.02, 1.0, 1, 0.0), "poor": (0.5, 9.0, 1, 0.0)}, ["car"], 1, n=60
    )
    outputs = {form: run(*patterns, f"--{form}")[1] for form in ("latex", "markdown", "json")}
    run(*patterns, "--html", "page.html")
    outputs |= {"text": run(*patterns)[1], "page": (tmp_path / "page.html").read_text()}
    for form in ("latex", "text", "page"):
        assert "no ranks where systems have one run each" in outputs[form]
        assert re.search(
            r"PAS of good and poor: runs of each that would do, if they scatter \(sd\) at most: "
            r"3 by 0\.\d+, 5 by 0\.\d+, 10 by 0\.\d+",
            outputs[form],
        )
    assert r"\textbf" not in outputs["latex"]
    assert "**" not in outputs["markdown"]
    assert not re.search(r"\.\d{4} \(\d", outputs["text"])
    for part in ('class="best"', "heat best", 'class="rank"', "Bold"):
        assert part not in outputs["page"]
    found = json.loads(outputs["json"])
    assert {rank for one in found["systems"] for rank in one["rank"].values()} == {None}
    assert not any(pair["better"] or pair["distinguishable"] for pair in found["comparisons"])


def test_the_best_is_the_first_and_what_is_unknown_the_last():
    values = {"a": np.nan, "b": 3.0, "c": np.inf, "d": 1.0}
    entries = {(name, None): {"half_distance": value} for name, value in values.items()}
    summary = SimpleNamespace(systems=list(values), entries=entries)
    assert tables._by(summary, "half_distance") == ["d", "b", "c", "a"]
    assert list(map(tables.number, (np.nan, np.inf, 9.99999, 10.0))) == ["-", "∞", "10.0000", "10"]


def test_the_runs_that_would_do_leave_the_first_ahead_though_one_more_fails():
    """With one failure of n + 1 runs 0.9 is still above 0.7 where n > 3.5."""
    means = {"a": 0.9, "b": 0.7}
    entries = {(name, None): {"scored": {"PAS": mean}} for name, mean in means.items()}
    pair = {"a": "a", "b": "b", "difference": 0.2, "sequences": 1}
    said = tables._one_run(SimpleNamespace(systems="ab", entries=entries), pair, "a and b", "PAS")
    assert "at most: 5 by " in said[1]
    entries["b", None]["scored"]["PAS"] = 0.895
    pair["difference"] = 0.005
    said = tables._one_run(SimpleNamespace(systems="ab", entries=entries), pair, "a and b", "PAS")
    assert said[1].endswith("at most: more than 100")


def test_one_system_needs_no_reason_for_having_no_ranks(benchmark_of, run):
    out = run(*benchmark_of({"only": (0.1, 1.0, 1, 0.0)}, ["car"], 1, n=40))[1]
    assert "means over runs" in out
    assert "no ranks" not in out


def test_little_apart_takes_as_many_runs_as_bear_a_failure(benchmark_of, run):
    """However little they scatter: of three runs a fourth might fail."""
    systems = {"good": (0.1, 1.0, 1, 0.0), "next": (0.13, 1.0, 1, 0.0)}
    text = run(*benchmark_of(systems, ["car"], 1, n=120))[1]
    (least,) = re.findall(r"at most: (\d+) by", text)
    assert int(least) > 5
    several = run(*benchmark_of(systems, ["car"], 3, n=120))[1]
    assert re.search(
        r"PAS of good and next: certain but for failures; about \d+ runs of each", several
    )


def test_the_runs_that_would_do_are_those_over_all_sequences(benchmark_of, run):
    systems = {"good": (0.1, 1.0, 1, 0.0), "next": (0.115, 1.0, 1, 0.0)}
    patterns = benchmark_of(systems, n=40)
    pairs = json.loads(run(*patterns, "--json")[1])["comparisons"]
    needed = {pair["sequence"]: pair["needed"] for pair in pairs if pair["metric"] == "PAS"}
    assert len(set(needed.values())) == 3
    out = run(*patterns)[1]
    assert f"PAS of good and next: about {needed[None]} " in out  # not certain in any respect


NAMES = r"[1] a&b%c_d#e$f~g^h\i{j}|<k>", "*{2} é"


def test_latex_of_any_names(patterns, run, tmp_path):
    """Whatever a name or a metric holds, it is text."""
    sequences = {"car": {"name": NAMES[0]}}
    systems = {"a_b": {"name": NAMES[0]}, "c": {"name": NAMES[1]}}
    described = {"format": "tum", "reference": patterns[1], "estimate": patterns[2]}
    described |= {"sequences": sequences, "systems": systems}
    (tmp_path / "b.yaml").write_text(json.dumps(described))
    text = run("b.yaml", "--latex", "--by", "half_distance")[1]
    comments = [line for line in text.splitlines() if line.startswith("% ")]
    assert comments[0].startswith("% half_distance: ")
    lines = [line for line in text.splitlines() if line not in comments]
    assert any(line.startswith("% lost: ") for line in comments)
    escaped = (
        r"{[}1] a\&b\%c\_d\#e\$f\textasciitilde{}g\textasciicircum{}h\textbackslash{}i\{j\}"
        r"\textbar{}\textless{}k\textgreater{}"
    )
    assert lines[2] == rf"half m & {escaped} & helix & overall \\"
    assert lines[4].startswith(f"{escaped} & ")
    assert lines[5].startswith(r"{*}\{2\} é & ")
    plain = re.sub(r"\\[&%$#_{}]|\$\\infty\$", "", "\n".join(lines))  # without what is escaped
    assert not set("%$#_~^<>|") & set(plain)
    assert {row.count("&") for row in plain.splitlines() if row.endswith(r"\\")} == {3}
    depths = [plain[:end].count("{") - plain[:end].count("}") for end in range(len(plain) + 1)]
    assert min(depths) == depths[-1] == 0


HOSTILE = "a_b & 50% #1 $x ~^\\{}", '[x] *y* |z|, "q" <i>', "*new\nline--é`_u_"


@pytest.fixture
def hostile(benchmark_of, tmp_path):
    """Patterns of a benchmark whose systems have such names, one of them no UTF-8."""
    systems = {str(number): (0.1 * number + 0.05, 1.0, 1, 0.0) for number in range(4)}
    found = benchmark_of(systems, ["car"], runs=2, n=40)
    for number, name in enumerate([*HOSTILE, os.fsdecode(b"n\xff")]):
        (tmp_path / "car" / str(number)).rename(tmp_path / "car" / name)
    (tmp_path / "car").rename(tmp_path / "[c]%_1|2")
    return found


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="needs pdflatex")
@pytest.mark.parametrize("by", ["PAS", "half_distance", "recall@5cm,5deg:hloc-sim3"])
def test_latex_of_any_names_compiles(hostile, run, tmp_path, by):
    metrics = ["--metrics", by] if "@" in by else []
    text = run(*hostile, "--latex", "--by", by, *metrics)[1]
    document = rf"\documentclass{{article}}\usepackage{{booktabs}}\begin{{document}}{text}"
    (tmp_path / "t.tex").write_text(document + r"\end{document}")
    command = ["pdflatex", "-halt-on-error", "t.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout.decode(errors="replace")[-500:]


def test_any_names_in_other_tables(hostile, run, tmp_path):
    rows = list(csv.DictReader(StringIO(run(*hostile, "--csv")[1], newline="")))
    assert {row["system"] for row in rows} == {*HOSTILE, r"n\udcff"}
    assert len(rows) == 2 * 4
    lines = run(*hostile, "--markdown")[1].split("\n\n")[1].splitlines()
    assert lines[0] == r"| PAS | \[c\]%\_1\|2 |"
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in lines} == {3}
    assert any(line.startswith(r"| \*new\\nline--é\`\_u\_ |") for line in lines)
    found = json.loads(run(*hostile, "--json")[1])
    assert {entry["system"] for entry in found["systems"]} == {*HOSTILE, "n\udcff"}
    code, _, err = run(*hostile, "--html", "page.html")
    assert (code, err) == (0, "")
    assert (tmp_path / "page.html").read_text().count("</html>") == 1
