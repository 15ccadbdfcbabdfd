"""The comparison in words: who is ahead of whom, who was not tested, how many runs it takes."""

import math
from collections.abc import Sequence

from ..texts import first_few
from .statistics import LEVEL, N_MAX, Interval, runs_needed
from .summary import WITHIN, Pair, Summary

__all__ = ["difference_text", "p_text", "verdict"]


def verdict(summary: Summary, by: str) -> list[str]:
    """Return a few sentences about the systems over all."""
    means = {
        name: [summary.entries[system, None].mean_of_scored(name) for system in summary.systems]
        for name in (by, "TAS")
    }
    if any(map(math.isfinite, means["TAS"])) and not any(map(math.isfinite, means[by])):
        return [f"no run has a {by}, which takes rotations; --by TAS compares by positions"]
    pairs, order = summary.pairs_by(by), summary.ranked(by)
    pairs.sort(key=lambda pair: sorted(map(order.index, (pair.a, pair.b))))  # the leader's first
    tested = [pair for pair in pairs if pair.tested]
    lines = []
    if tested:
        leader = min(tested[0].a, tested[0].b, key=order.index)
        lines = _of_leader(leader, [p for p in tested if leader in (p.a, p.b)], by)
    if len(order) > 1:
        lines += _not_tested(summary, order, tested)
    if not any(pair.better for pair in tested):
        several = [pair for pair in pairs if pair.method == WITHIN]
        lines += [_how_many(several[0], len(tested))] if several else []
    return lines


def p_text(p: float) -> str:
    """Return a p-value."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}"


def difference_text(interval: Interval, significant: bool) -> str:
    """Return a difference, with its interval where it is significant, so that both agree."""
    text = f"{interval.value:+.3f}"
    has_interval = significant and math.isfinite(interval.low)
    return f"{text} ({interval.low:.3f} to {interval.high:.3f})" if has_interval else text


def _of_pair(pair: Pair, by: str) -> str:
    """Return who of two is ahead, how often it wins, and by how much."""
    wins, gain, first, second = pair.wins, pair.difference, pair.a, pair.b
    if pair.better == pair.b or (not pair.better and wins < 0.5):
        wins, gain = 1 - wins, Interval(-gain.value, -gain.high, -gain.low)
        first, second = second, first
    who = f"{first} is ahead of {second}: it"
    if not pair.better:
        who = f"{first} and {second} are not distinguishable: {first}"
    where = f"{len(pair.runs)} sequence{'s' * (len(pair.runs) > 1)}"
    size = difference_text(gain, significant=pair.better is not None)
    mean = f", mean {by} {size}" if math.isfinite(gain.value) else ""
    return f"{who} wins {100 * wins:.0f} % of the run pairs on {where} ({p_text(pair.p)}){mean}."


def _of_leader(leader: str, tested: Sequence[Pair], by: str) -> list[str]:
    """Compare the first system with the second in full, and with the others in short."""
    first, *others = tested
    lines = [_of_pair(first, by)]
    if first.like_these:
        ahead = first.better_like_these
        who = f"{ahead} is ahead" if ahead else "they are not distinguishable"
        lines.append(f"On sequences like these, {who} ({p_text(first.p_like_these)}).")
    for what, better in (("ahead of", True), ("behind", False), ("not distinguishable from", None)):
        of_kind = [
            pair.b if pair.a == leader else pair.a
            for pair in others
            if (pair.better and pair.better == leader) == better
        ]
        if of_kind:
            lines.append(f"{leader} is {what} {first_few(of_kind)}.")
    return lines


def _not_tested(summary: Summary, order: Sequence[str], tested: Sequence[Pair]) -> list[str]:
    """Return which systems were not tested, and why."""
    systems = {system for pair in tested for system in (pair.a, pair.b)}
    reasons: dict[str, list[str]] = {}
    for system in order:
        entry = summary.entries[system, None]
        n, reason = len(entry.results), "too few runs"
        if entry.runs == n:
            reason = f"one run on {'one sequence' if n == 1 else f'each of {n} sequences'}, too few"
        if system not in systems:
            reasons.setdefault(reason, []).append(system)
    return [f"{first_few(own)}: {reason} to be tested." for reason, own in reasons.items()]


def _how_many(pair: Pair, n_tested: int) -> str:
    """Return how many runs show a difference like the one between two systems."""
    n = min(len(own) for both in pair.runs for own in both)
    needed = runs_needed(pair.runs, LEVEL / max(n_tested, 1)) or f"more than {N_MAX}"
    return (
        f"{pair.a} and {pair.b}, {n} runs each: to find a difference like this in "
        f"four of five cases takes {needed} runs each."
    )
