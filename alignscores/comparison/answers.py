"""Two systems compared by a metric: what their runs say about new runs, and new sequences.

The scores are those of runs that did not fail. How probably a run fails is told apart, and so are
means in which failures count.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..metrics import metric
from .intervals import (
    Difference,
    Failures,
    joined,
    margin,
    needed,
    over_runs,
    over_sequences,
)

__all__ = ["NOTHING", "QUESTIONS", "Cell", "answers", "chosen"]

Entry = dict[str, Any]  # of the JSON output

QUESTIONS = "new_runs", "new_sequences"
Found = tuple[float, float, float]  # a difference and its interval
UNKNOWN: Found = (math.nan,) * 3


class Cell(NamedTuple):
    """The runs of a system on a sequence: values of those that did not fail, and the failures."""

    scored: Sequence[float]
    failures: Failures


Pair = tuple[Cell, Cell]


def answers(
    pairs: Sequence[Pair], name: str, error: float, runs: Sequence[Failures]
) -> dict[str, Entry | None]:
    """Compare two systems on the sequences that both were tried on; `error` is that of intervals.

    `runs` are all of each system, on other sequences, too: they tell how often it may fail here.
    There is an answer for new runs where there are two of each on each sequence, and for new
    sequences where there are two.
    """
    both = list(zip(*pairs, strict=True))
    counts = [cell.failures.of for of_one in both for cell in of_one]
    found: dict[str, Entry | None] = dict.fromkeys(QUESTIONS)
    if min(counts) > 1:
        cells = [(a.scored, b.scored) for a, b in pairs if min(map(len, (a.scored, b.scored))) > 1]
        failures = [Failures(*np.sum([c.failures for c in of_one], axis=0)) for of_one in both]
        difference = over_runs(cells) if cells else None
        n = float(np.mean(counts))
        found["new_runs"] = _answer(pairs, name, error, difference, failures, runs, n)
    if len(pairs) > 1:
        means = [np.mean(a.scored) - np.mean(b.scored) for a, b in pairs if a.scored and b.scored]
        failures = [Failures(sum(c.failures.share for c in of), len(pairs)) for of in both]
        difference = over_sequences(means) if len(means) > 1 else None
        found["new_sequences"] = _answer(pairs, name, error, difference, failures, runs, len(pairs))
    return found


def chosen(found: Sequence[Mapping[str, Entry | None]]) -> str | None:
    """Return the question that the ranks of a column are for, of the answers for its pairs.

    It is that of new runs, unless some pair has no answer to it and a pair has one for new
    sequences.
    """
    of_runs, of_sequences = ([of_pair[question] for of_pair in found] for question in QUESTIONS)
    if any(of_runs) and (all(of_runs) or not any(of_sequences)):
        return QUESTIONS[0]
    return QUESTIONS[1] if any(of_sequences) else None


def _answer(
    pairs: Sequence[Pair],
    name: str,
    error: float,
    difference: Difference | None,
    failures: Sequence[Failures],
    runs: Sequence[Failures],
    n: float,
) -> Entry:
    """Return the differences of two systems with their intervals, and which one is better.

    Evidence is a difference that is certain: of the scores, where the better one was not seen to
    fail more often, or of the probabilities of failing. Errors have no means in which failures
    count, so that it takes evidence that the other of the two, as it was seen, does not contradict.
    """
    family = metric(name).family
    sign = 1 if family.larger_is_better else -1
    span = (100.0 if family.unit == "%" else 1.0) if family.larger_is_better else math.inf
    more = failures[0].share - failures[1].share
    reach_a, reach_b = (of_one.reach(error) for of_one in failures)
    failing = more, *joined(more, reach_a, reach_b[::-1])
    scored = total = UNKNOWN
    if difference:
        half = margin(difference, error)
        scored = difference.value, *joined(difference.value, (half, half))
    by_score, by_failing = sign * _certain(scored), -_certain(failing)
    by_score = 0 if by_score * more > 0 else by_score
    if family.larger_is_better:
        evidence = by_score, by_failing
        total, ahead, count = _by_means(pairs, failures, runs, difference, evidence, n, error)
    else:
        count = needed(difference, n, error) if difference else None
        ahead = by_score or (0 if by_failing * scored[0] > 0 else by_failing)
    return {
        **_entry(scored, span),
        "better": {1: "a", -1: "b"}.get(ahead),
        "needed": count,
        "failing": _entry(failing, 1.0),
        "with_failures": _entry(total, span),
    }


def _by_means(
    pairs: Sequence[Pair],
    failures: Sequence[Failures],
    runs: Sequence[Failures],
    difference: Difference | None,
    evidence: Sequence[int],
    n: float,
    error: float,
) -> tuple[Found, int, int | None]:
    """Return the difference of the means in which failures count, who is ahead, and runs needed.

    A system is ahead if its mean is better, there is evidence, or this difference is certain, and
    if its mean stays better when it fails as often as in all its `runs` and one more that failed.
    """
    both = list(zip(*pairs, strict=True))
    means = [
        float(np.mean([np.sum(cell.scored) / cell.failures.of for cell in of_one]))
        for of_one in both
    ]
    lead = means[0] - means[1]
    first = int(lead < 0)
    of_first = [
        (np.mean(cell.scored), cell.failures.share)
        for cell in (pair[first] for pair in pairs)
        if cell.scored
    ]
    feared = runs[first].with_one_more
    worse = sum(mean * (1 - max(share, feared)) for mean, share in of_first) / len(pairs)
    total, count = (lead, math.nan, math.nan), None
    if difference:
        half = margin(difference, error)
        (down_a, up_a), (down_b, up_b) = (
            np.mean(np.concatenate([cell.scored for cell in of_one])) * of_system.reach(error)
            for of_one, of_system in zip(both, failures, strict=True)
        )
        total = lead, *joined(lead, (half, half), (up_a, down_a), (down_b, up_b))
    if difference and lead:
        told = difference
        if lead * difference.value <= 0 or failures[first].share > failures[1 - first].share:
            unit = margin(difference._replace(error=1.0), error)
            told = difference._replace(value=lead, error=abs(total[1 + first] - lead) / unit)
        level = 1 - means[1 - first] * len(pairs) / float(sum(mean for mean, _ in of_first))
        count = needed(told, n, error, n * runs[first].more_until(level))
    leader = (1, -1)[first] if worse > means[1 - first] else 0
    return total, leader if leader in (*evidence, _certain(total)) else 0, count


def _certain(found: Found) -> int:
    """Return the sign of a difference whose interval does not hold 0; else 0."""
    _, low, high = found
    return int(low > 0) - int(high < 0)


def _entry(found: Found, span: float) -> Entry:
    """Return a difference and its interval, within what is possible."""
    value, low, high = found
    return {"difference": value, "low": max(low, -span), "high": min(high, span)}


NOTHING: Entry = {
    **_entry(UNKNOWN, math.inf),
    "better": None,
    "needed": None,
    "failing": _entry(UNKNOWN, math.inf),
    "with_failures": _entry(UNKNOWN, math.inf),
}
"""In place of an answer, where there is none."""
