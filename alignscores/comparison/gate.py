"""Conditions on which ``--fail_on`` lets a build fail."""

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from ..metrics import metric
from .baseline import GATE_LEVEL, Changes, means_of_both
from .comparison import Comparison
from .summary import records
from .tables import number
from .verdict import contrast_text, p_text

__all__ = ["WORSE", "Condition", "conditions_of", "reasons_to_fail"]

CONDITION = re.compile(
    r"(\S+?)\s*(<|>|\bdrops\b|\brises\b)\s*([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)(%?)"
)
END = re.compile(
    r"(\bworse(?::[^,]*)?|(?:[<>]|\bdrops\b|\brises\b)[^,]*),"
)  # a name may have a comma, too
WORSE = "worse"
SHARES = "lost", "failed"
LARGEST = {"": 1.0, "%": 100.0}  # score, by its unit


@dataclass(frozen=True)
class Condition:
    """A metric or share that is below or above a limit, or drops or rises by more than that.

    The limit of ``worse`` is its level of significance.
    """

    name: str
    relation: str
    limit: float = 0.0

    @property
    def needs_baseline(self) -> bool:
        """Whether it is about what changed."""
        return self.relation in (WORSE, "drops", "rises")


def conditions_of(text: str, by: str, metrics: Collection[str]) -> list[Condition]:
    """Read conditions on these metrics, such as ``worse:0.01,PAS<0.8,lost>5%,PAS drops 0.05``."""
    parts = END.sub(r"\1\n", text).splitlines()
    return [_condition(part.strip(), by, metrics) for part in parts]


def _condition(text: str, by: str, metrics: Collection[str]) -> Condition:
    word, colon, level = text.partition(":")
    if word == WORSE:
        try:
            limit = float(level) if colon else GATE_LEVEL
        except ValueError:
            limit = math.nan
        if not 0 < limit < 1:
            raise ValueError(f"{text!r}: the level of worse must be above 0 and below 1")
        return Condition(by, WORSE, limit)
    matched = CONDITION.fullmatch(text)
    if not matched:
        examples = "PAS<0.8, half>0.1, lost>5%, PAS drops 0.05"
        raise ValueError(f"{text!r} must be worse, or like {examples}")
    name, relation, limit_text, percent = matched.groups()
    limit = float(limit_text) / (100 if percent else 1)
    name = name if name in (*SHARES, *metrics) else metric(name).name
    names = [*metrics, *SHARES] if relation in "<>" else metrics
    if percent and name not in SHARES:
        raise ValueError(f"{text!r}: only {' and '.join(SHARES)} are in per cent; write {limit:g}")
    if name not in names:
        raise ValueError(f"{text!r}: {name} must be one of {', '.join(names)}")
    condition = Condition(name, relation, limit)
    _check_limit(text, condition)
    return condition


def _check_limit(text: str, condition: Condition) -> None:
    """Raise a ValueError for a limit that no value is beyond, or each."""
    low, high = _range(condition.name)
    what, limit = condition.name, condition.limit
    if condition.needs_baseline:
        what, low, high = f"a change of {what}", 0.0, high - low
    if low < limit < high or limit == (high if condition.relation == "<" else low):
        return
    values = f"from {low:g} to {high:g}" if high < math.inf else f"at least {low:g}"
    raise ValueError(f"{text!r} decides nothing: {what} is {values}")


def _range(name: str) -> tuple[float, float]:
    """Return the smallest and the largest value of a share or a metric, as far as it is known."""
    if name in SHARES:
        return 0.0, 1.0
    with suppress(ValueError):
        if (entry := metric(name)).name == name:
            return 0.0, LARGEST[entry.unit] if entry.larger_is_better else math.inf
    return -math.inf, math.inf


def reasons_to_fail(
    conditions: Sequence[Condition], comparison: Comparison, changed: Changes | None
) -> list[str]:
    """Return a line for each system that fulfils a condition, and for runs that are gone."""
    reasons = [
        reason for condition in conditions for reason in _reasons(condition, comparison, changed)
    ]
    return reasons + ([f"gone: {where}" for where in changed.gone] if changed else [])


def _reasons(
    condition: Condition, comparison: Comparison, changed: Changes | None
) -> Iterator[str]:
    """Yield why systems fulfil a condition."""
    if changed and condition.relation == WORSE:
        for row in records(changed.systems):
            if row["change"] == WORSE:
                p = p_text(row["p_worse"], changed.systems["p_worse"].count())
                contrast = contrast_text(row["wins"], row["difference"], changed.larger)
                yield ", ".join(
                    filter(None, [_from_to(row, condition.name), f"worse ({p})", contrast])
                )
    elif changed and condition.needs_baseline:
        for row in records(means_of_both(changed, condition.name)):
            now, saved = row["now"], row["saved"]
            rise = now - saved if now != saved else 0.0  # both may be infinite
            if (rise if condition.relation == "rises" else -rise) > condition.limit:
                change = _from_to(row, condition.name)
                yield f"{change}, {condition.relation} by more than {condition.limit:g}"
    else:
        for row in records(comparison.overall):
            names = {"failed": row["failed"] / row["runs"], "lost": row["lost_all"]}
            value = names.get(condition.name, row.get(f"{condition.name}_all", math.nan))
            if math.isnan(value):
                yield f"{row['system']}: has no {condition.name}"
            elif value < condition.limit if condition.relation == "<" else value > condition.limit:
                values = number(value), f"{condition.limit:g}"
                if condition.name in names:
                    values = f"{100 * value:.4g}%", f"{100 * condition.limit:g}%"
                text = f" {condition.relation} ".join(values)
                yield f"{row['system']}: {condition.name} {text}"


def _from_to(row: Mapping[str, Any], name: str) -> str:
    return f"{row['system']}: {name} {number(row['saved'])} to {number(row['now'])}"
