"""Two systems compared by a metric: what their runs say about new runs, and new sequences.

The scores are those of runs that did not fail. How probably a run fails is told apart, and so are
means in which failures count.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Floats
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
UNKNOWN = (math.nan,) * 3


class Cell(NamedTuple):
    """The runs of a system on a sequence: values of those that did not fail, and the failures."""

    scored: Sequence[float]
    failures: Failures


Pair = tuple[Cell, Cell]


def answers(pairs: Sequence[Pair], name: str, error: float) -> dict[str, Entry | None]:
    """Compare two systems on the sequences that both were tried on; `error` is that of intervals.

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
        found["new_runs"] = _answer(pairs, name, error, difference, failures, n)
    if len(pairs) > 1:
        means = [np.mean(a.scored) - np.mean(b.scored) for a, b in pairs if a.scored and b.scored]
        failures = [Failures(sum(c.failures.share for c in of), len(pairs)) for of in both]
        difference = over_sequences(means) if len(means) > 1 else None
        found["new_sequences"] = _answer(pairs, name, error, difference, failures, len(pairs))
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
    n: float,
) -> Entry:
    """Return the differences of two systems with their intervals, and which one is better.

    That is the one with the better mean, failures counted, if one of three differences is certain:
    of the scores, and it fails no more often; of the probabilities of failing; of the means in
    which failures count.
    """
    family = metric(name).family
    sign = 1 if family.larger_is_better else -1
    span = (100.0 if family.unit == "%" else 1.0) if family.larger_is_better else math.inf
    share_a, share_b = (of_one.share for of_one in failures)
    reach_a, reach_b = (_reach(of_one, error) for of_one in failures)
    failing = share_a - share_b, *joined(share_a - share_b, reach_a, reach_b[::-1])
    scored = total = UNKNOWN
    lead = share_b - share_a
    if difference:
        half = margin(difference, error)
        scored = difference.value, *joined(difference.value, (half, half))
        lead = lead or sign * difference.value
    if span < math.inf:
        lead = float(
            np.mean(
                [
                    np.sum(a.scored) / a.failures.of - np.sum(b.scored) / b.failures.of
                    for a, b in pairs
                ]
            )
        )
    if difference and span < math.inf:
        mean_a, mean_b = (
            np.mean(np.concatenate([cell.scored for cell in of])) for of in zip(*pairs, strict=True)
        )
        total = lead, *joined(lead, (half, half), mean_a * reach_a[::-1], mean_b * reach_b)
    by_score = sign * _certain(scored)
    if by_score * (share_a - share_b) > 0:
        by_score = 0  # it fails more often
    ahead = np.sign(lead) if np.sign(lead) in (by_score, -_certain(failing), _certain(total)) else 0
    return {
        **_entry(scored, span),
        "better": {1: "a", -1: "b"}.get(int(ahead)),
        "needed": needed(difference, n, error) if difference else None,
        "failing": _entry(failing, 1.0),
        "with_failures": _entry(total, span),
    }


def _reach(failures: Failures, error: float) -> Floats:
    """Return how far the interval of a probability reaches down and up."""
    low, high = failures.limits(error)
    return np.array([failures.share - low, high - failures.share])


def _certain(found: Sequence[float]) -> int:
    """Return the sign of a difference whose interval does not hold 0; else 0."""
    _, low, high = found
    return int(low > 0) - int(high < 0)


def _entry(found: Sequence[float], span: float) -> Entry:
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
