"""The article: its text stands in ``docs/article``, its numbers come from the results.

A sentence that the results do not bear out any more is refused; in a quick look it is left out.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import unescape
from typing import Any

import pandas as pd
from jinja2 import TemplateError
from markupsafe import Markup

from experiments.command import CommandError
from experiments.config import CONFIG_DIR
from studies.claims.claims import load_claims
from studies.claims.verdicts import TRUTHS, VERDICTS
from studies.order import SIGNIFICANCE
from studies.statistics import LEAST_POWER

from .estimates import SPACE, Estimate
from .page import contents, environment
from .results import Results

FOLDER = CONFIG_DIR.parent / "docs" / "article"
TEMPLATE = "article.html.j2"
CAPTIONS = ("Figure 5", "Figure 6", "Figure 7")  # whose statements stand beside what came out
KEYS = ("trials=", "replicates=", "benchmark=", "quick=", "more=")  # that leave the study as it is
SHORT = {  # names of metrics with their options, as tables have room for
    "(registration=refined)": " refined",
    "(registration=refined,max_threshold=2)": " refined 2 d",
    "(registration=refined, max_threshold=2)": " refined 2 d",
    "HalfDistance(score=0.25)": "QuarterDistance",
    "HalfAngle(score=0.25)": "QuarterAngle",
}
LEFT_OUT = Markup('<span class="left-out">[left out: not so in this quick look]</span>')


@dataclass(frozen=True)
class Comparison:
    """How much better one metric orders the levels of an experiment than another, in points."""

    order: float
    low: float
    high: float
    p: float

    @property
    def is_certain(self) -> bool:
        """Whether it certainly is better."""
        return self.order > 0 and self.p < SIGNIFICANCE


@dataclass(frozen=True)
class Tally:
    """The claims of one source that are counted, and how many have each verdict."""

    source: str
    counted: int
    verdicts: Mapping[str, int]
    populations: Mapping[str, int]


@dataclass(frozen=True)
class Statement:
    """What a caption says of several metrics, and what came out for each."""

    rows: Sequence[Estimate]

    @property
    def text(self) -> str:
        """The statement, with *it* for a metric."""
        claim = self.rows[0].claim
        text = claim.statement.replace(f"The {claim.metric} ", "It ", 1)
        return text.replace(f"the {claim.metric} ", "it ", 1)

    @property
    def value(self) -> str:
        """The means, from the smallest to the largest, with their unit."""
        if not all(row.is_finite for row in self.rows):
            return "undefined"
        ends = [end(self.rows, key=lambda row: row.mean).number for end in (min, max)]
        return f"{' to '.join(dict.fromkeys(ends))}{SPACE}{self.rows[0].unit}"

    @property
    def verdict(self) -> str:
        """The verdict; of several metrics, for how many it is reproduced."""
        if len(self.rows) == 1:
            return self.rows[0].verdict
        return f"{sum(row.holds for row in self.rows)} of {len(self.rows)}"


def render(results: Results, machine: str = "") -> str:
    """Write the article as HTML that needs no other file; it has no date.

    A `CommandError` says what the text asks for and there is not, or what the results do not bear
    out.
    """
    found = contents(results, machine)
    others = [one for one in results.settings if not one.startswith(KEYS)]
    is_quick = bool(
        others
        or found["replicate"].trials < found["paper_trials"]
        or found["n_replicates"] < load_claims().replicates
    )
    orders = found["head_to_head"]
    text = environment(FOLDER)
    text.filters["listed"] = _listed
    text.filters["short"] = _shortened
    rates = {summary["metric"]: summary for summary in found["frame_rate"]["metrics"]}
    names: dict[str, Any] = {
        "is_quick": is_quick,
        "refined": "TAS(registration=refined)",
        "quarter": "HalfDistance(score=0.25)",
        "least_power": LEAST_POWER,
        "claim": _finder("claim", found["claims"]),
        "picture": _finder("figure", found["pictures"]),
        "at_rates": _finder("frame rate of", rates),
        "place": _finder("order", _places(orders["rankings"])),
        "ahead": lambda *key: _comparison(orders["table"], *key),
        "tallies": _tallies(found["counted"]),
        "captions": _captions(found["counted"]),
        "doubted": lambda ids: [
            row for row in found["exceptions"] if re.fullmatch(ids, row.claim.id)
        ],
        "fixed": lambda text: text,
        "says": _guard(is_quick),
    }
    try:
        return text.get_template(TEMPLATE).render(found | names)
    except TemplateError as error:
        raise CommandError(f"{FOLDER / TEMPLATE}: {error}") from None


def _finder(kind: str, found: Mapping[Any, Any]) -> Callable[..., Any]:
    """Return a function of a name, or of its parts, that refuses those that there are not."""

    def find(*parts: str) -> Any:
        key = parts[0] if len(parts) == 1 else parts
        if key not in found:
            raise CommandError(f"{FOLDER / TEMPLATE} asks for no {kind}: {' '.join(parts)}")
        return found[key]

    return find


def _guard(is_quick: bool) -> Callable[..., Markup]:
    """Return the block of a sentence that holds under a condition."""

    def says(*conditions: bool, caller: Callable[[], str]) -> Markup:
        text = Markup(caller())
        if all(conditions):
            return text
        if is_quick:
            return LEFT_OUT
        sentence = " ".join(unescape(re.sub(r"<[^>]*>", "", text)).split())
        raise CommandError(
            f"{FOLDER / TEMPLATE} says what the results do not: {sentence!r}; write what they do"
        )

    return says


def _places(rankings: Sequence[Any]) -> dict[tuple[str, str, str], Any]:
    return {
        (ranking["experiment"], ranking["level"], place["metric"]): place
        for ranking in rankings
        for place in ranking["places"]
    }


def _comparison(
    order: pd.DataFrame, experiment: str, level: str, metric: str, versus: str
) -> Comparison:
    """Return by how much a metric orders levels better than another."""
    rows = order[(order["experiment"] == experiment) & (order["level"] == level)]
    for first, second, sign in ((metric, versus, 1), (versus, metric, -1)):
        row = rows[(rows["metric"] == first) & (rows["versus"] == second)]
        if len(row) == 1:
            better, low, high, p = row[["order", "low", "high", "p"]].to_numpy()[0]
            lowest, highest = sorted((sign * low, sign * high))
            return Comparison(sign * better, lowest, highest, p)
    words = f"{experiment} {level} {metric} {versus}"
    raise CommandError(f"{FOLDER / TEMPLATE} asks for no comparison: {words}")


def _tallies(counted: Sequence[Estimate]) -> list[Tally]:
    sources = dict.fromkeys(row.claim.source for row in counted)
    tallies = []
    for source in sources:
        rows = [row for row in counted if row.claim.source == source]
        verdicts = Counter(row.verdict for row in rows)
        populations = Counter(row.population for row in rows)
        tallies.append(
            Tally(
                source,
                len(rows),
                {word: verdicts[word] for word in reversed(VERDICTS)},
                {word: populations[word] for word in reversed(TRUTHS)},
            )
        )
    return tallies


def _captions(rows: Sequence[Estimate]) -> list[Statement]:
    """Group what captions say in words by what they say; it may be the same of several metrics."""
    groups: dict[tuple[str, str], list[Estimate]] = {}
    for row in rows:
        if row.claim.source.startswith(CAPTIONS) and row.claim.paper is None:
            key = row.claim.source, Statement([row]).text
            groups.setdefault(key, []).append(row)
    return [Statement(group) for group in groups.values()]


def _shortened(text: str) -> str:
    for name, short in SHORT.items():
        text = text.replace(name, short)
    return text


def _listed(words: Sequence[object]) -> str:
    *others, last = map(str, words) if words else ["none"]
    return f"{', '.join(others)} and {last}" if others else last
