"""Real runs: which metric tells people's own systems apart, and what moves it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from ..study import Answer, Figure, Own, Question, Study
from .answers import agreement, pairs, summarise
from .scores import read_benchmark, score_sequence, sources


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return a table of the metrics, of the pairs of systems, and of how metrics agree."""
    return [summarise(question.own), pairs(question.own), agreement(question.own)]


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    return {"metrics": answer.table.to_dict("records")}


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
    plan=lambda _: {},  # no tables of trials: the runs are real
    ask=ask,
    answers=("tables/{}.csv", "tables/{}_pairs.csv", "tables/{}_agreement.csv"),
    figures=[
        Figure("studies.real.figure:draw", ["tables/{}", "tables/{}_pairs", "tables/{}_agreement"])
    ],
    show=show,
    place=110,
    trials="real",
    keys=["benchmark", "quick", "more"],
    own=Own("benchmark", parts),
    score=score,
)
