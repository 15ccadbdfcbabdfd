"""Real runs: which metric orders the systems of a benchmark, and what moves it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from ..study import Own, Question, Study
from .answers import agreement, pairs, summarise
from .scores import read_benchmark, score_sequence, sources


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return a table of the metrics, of the pairs of systems, and of how metrics agree."""
    of_pairs = pairs(question.own)
    return [summarise(question.own), of_pairs, agreement(of_pairs)]


def parts(file: Path) -> Mapping[str, Sequence[str]]:
    """Return the sequences of a benchmark, each with the files that its runs are in."""
    benchmark = read_benchmark(file)
    return {sequence: sources(benchmark, sequence) for sequence in benchmark.references}


def score(given: Mapping[str, str], part: str) -> pd.DataFrame:
    """Return the table of a sequence, of runs as they are and, but for a quick look, changed."""
    more = given.get("more", "").strip("[]").replace("'", "")
    benchmark = read_benchmark(Path(given["benchmark"]))
    return score_sequence(benchmark, part, changed=given.get("quick") != "true", more=more)


STUDY = Study(
    name="real",
    title="Your own runs",
    text="Order: how often two runs, one of each system, come in the order of the systems by all "
    "runs of the metric; equal: with one pose a second of each estimate; agrees: in the order by "
    "another metric. Significant: on how many sequences and pairs of systems the difference is. "
    "Runs: how many of each system a rank-sum test needs. Offsets of clocks are removed first.",
    alt="Left, a row for each metric with the share of pairs of runs in the right order for each "
    "pair of systems. Then a matrix of metrics by metrics: how often runs come in the order by "
    "another metric. Where estimates were changed, a matrix of metrics by changes: how far each "
    "moves a run.",
    plan=lambda _: {},  # no tables of trials: the runs are real
    ask=ask,
    position=110,
    trials="real",
    keys=["benchmark", "quick", "more"],
    own=Own("benchmark", parts),
    score=score,
)
