"""Conditions on which ``--fail_on`` lets a build fail."""

import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from ..metrics import metric
from .baseline import Changes
from .summary import Pair, Summary, by_system, compared
from .tables import number
from .verdicts import p_text

__all__ = ["Condition", "conditions_of", "reasons_to_fail"]

CONDITION = re.compile(
    r"(\S+?)\s*(<|>|\bdrops\b|\brises\b)\s*([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)(%?)"
)
END = re.compile(r"(\bworse|(?:[<>]|\bdrops\b|\brises\b)[^,]*),")  # a name may have a comma, too
WORSE = "worse"
SHARES = "lost", "failed"


@dataclass(frozen=True)
class Condition:
    """A metric or share that is below or above a limit, or drops or rises by more than that."""

    name: str
    relation: str
    limit: float = 0.0

    @property
    def needs_baseline(self) -> bool:
        """Whether it is about what changed."""
        return self.relation in (WORSE, "drops", "rises")


def conditions_of(text: str, by: str, metrics: Collection[str]) -> list[Condition]:
    """Read conditions on these metrics, such as ``worse,PAS<0.8,lost>5%,PAS drops 0.05``."""
    parts = END.sub(r"\1\n", text).splitlines()
    return [_condition(part.strip(), by, metrics) for part in parts]


def _condition(text: str, by: str, metrics: Collection[str]) -> Condition:
    if text == WORSE:
        return Condition(by, WORSE)
    matched = CONDITION.fullmatch(text)
    if not matched:
        form = "PAS<0.8, half>0.1, lost>5%, PAS drops 0.05"
        raise ValueError(f"{text!r} must be worse, or like {form}")
    name, relation, value, percent = matched.groups()
    limit = float(value) / (100 if percent else 1)
    name = name if name in SHARES else metric(name).name
    names = [*metrics, *SHARES] if relation in "<>" else metrics
    if name not in names:
        raise ValueError(f"{text!r}: {name} must be one of {', '.join(names)}")
    return Condition(name, relation, limit)


def reasons_to_fail(
    conditions: Sequence[Condition], summary: Summary, changed: Changes | None
) -> list[str]:
    """Return a line for each system that fulfils a condition, and for each that is gone."""
    reasons = [reason for one in conditions for reason in _reasons(one, summary, changed)]
    if changed:
        reasons += [f"{a} on {s}: has no run, but had one" for a, s in changed.gone]
    return reasons


def _reasons(one: Condition, summary: Summary, changed: Changes | None) -> Iterator[str]:
    """Yield why systems fulfil a condition."""
    if one.relation == WORSE and changed:
        for change in changed.systems:
            if change.change == WORSE:
                text = _from_to(change.system, one.name, change.pair)
                yield f"{text}, worse ({p_text(change.worse)})"
    elif one.needs_baseline and changed:
        after = by_system(summary.results)
        for system, before in changed.saved.items():
            pair = compared(after.get(system, {}), before, one.name)
            rise = pair.means[0] - pair.means[1] if pair else 0.0
            if pair and (rise if one.relation == "rises" else -rise) > one.limit:
                text = _from_to(system, one.name, pair)
                yield f"{text}, {one.relation} by more than {one.limit:g}"
    else:
        for system in summary.systems:
            entry = summary.entries[system, None]
            shares = {"lost": entry.lost, "failed": entry.failed / entry.runs}
            value = shares.get(one.name, math.nan) if one.name in SHARES else entry.mean(one.name)
            if math.isnan(value):
                yield f"{system}: has no {one.name}"
            elif value < one.limit if one.relation == "<" else value > one.limit:
                yield f"{system}: {one.name} {number(value)} {one.relation} {one.limit:g}"


def _from_to(system: str, name: str, pair: Pair) -> str:
    now, saved = map(number, pair.means)
    return f"{system}: {name} {saved} to {now}"
