"""The article: its text stands in ``docs/article``, its numbers come from the results.

A sentence that the results do not bear out any more is refused; in a quick look it is left out.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import pandas as pd
from jinja2 import TemplateError
from markupsafe import Markup

from experiments.command import CommandError
from experiments.config import CONFIG_DIR
from studies.claims.claims import load_claims
from studies.order import SIGNIFICANCE
from studies.statistics import LEAST_POWER
from studies.words import listed

from .estimates import SPACE, Estimate
from .page import contents, environment, tally
from .results import Results

FOLDER = CONFIG_DIR.parent / "docs" / "article"
TEMPLATE = "article.html.j2"
CAPTIONS = ("Figure 5", "Figure 6", "Figure 7")  # whose statements stand beside what came out
KEYS = ("trials=", "replicates=", "benchmark=", "quick=", "more=")  # that leave the study as it is
LEFT_OUT = Markup('<span class="left-out">[left out: not so in this quick look]</span>')


def render(results: Results, machine: str = "") -> str:
    """Write the article as HTML that needs no other file; it has no date.

    A `CommandError` says what there is not, or what the results do not bear out.
    """
    found = contents(results, machine)
    is_quick = (
        not all(one.startswith(KEYS) for one in results.settings)
        or found["replicate"].trials < found["paper_trials"]
        or found["n_replicates"] < load_claims().replicates
    )
    orders = found["head_to_head"]["table"]
    text = environment(FOLDER)
    text.filters["listed"] = lambda words: listed(words or ["none"])
    rates = {summary["metric"]: summary for summary in found["frame_rate"]["metrics"]}
    alone = orders[orders["versus"].isna() & orders["outliers"].isna()]
    places = alone.set_index(["experiment", "level", "metric"]).to_dict("index")
    names: dict[str, Any] = {
        "is_quick": is_quick,
        "refined": "TAS(registration=refined)",
        "quarter": "HalfDistance(score=0.25)",
        "least_power": LEAST_POWER,
        "claim": partial(_find, "claim", found["claims"]),
        "picture": partial(_find, "figure", found["pictures"]),
        "at_rates": partial(_find, "frame rate of", rates),
        "place": partial(_find, "order", places),
        "ahead": partial(_find, "comparison", _comparisons(orders)),
        "tallies": _tallies(found["counted"]),
        "captions": _captions(found["counted"]),
        "doubted": lambda ids: [
            row for row in found["exceptions"] if re.fullmatch(ids, row.claim.id)
        ],
        "fixed": lambda text: text,
        "says": partial(_say, is_quick),
    }
    try:
        return text.get_template(TEMPLATE).render(found | names)
    except TemplateError as error:
        raise CommandError(f"{FOLDER / TEMPLATE}: {error}") from None


def _find(kind: str, found: Mapping[Any, Any], *parts: str) -> Any:
    """Return what has a name, or these parts of one; refuse what there is not."""
    key = parts[0] if len(parts) == 1 else parts
    if key not in found:
        raise CommandError(f"{FOLDER / TEMPLATE} asks for no {kind}: {' '.join(parts)}")
    return found[key]


def _say(is_quick: bool, *conditions: bool, caller: Callable[[], str]) -> Markup:
    """Return a sentence that holds under some conditions."""
    text = Markup(caller())
    if all(conditions):
        return text
    if is_quick:
        return LEFT_OUT
    problem = f"says what the results do not: {text.striptags()!r}; write what they do"
    raise CommandError(f"{FOLDER / TEMPLATE} {problem}")


def _comparisons(table: pd.DataFrame) -> dict[Any, Any]:
    """Return by how much each metric orders levels better than each other, in points."""
    pairs = table.dropna(subset="versus").astype({"order": float, "low": float, "high": float})
    turned = pairs.rename(columns={"metric": "versus", "versus": "metric"})
    turned = turned.assign(order=-pairs["order"], low=-pairs["high"], high=-pairs["low"])
    both = pd.concat([pairs, turned])
    both = both.assign(is_certain=(both["order"] > 0) & (both["p"] < SIGNIFICANCE))
    return both.set_index(["experiment", "level", "metric", "versus"]).to_dict("index")


def _tallies(counted: Sequence[Estimate]) -> list[dict[str, Any]]:
    """Count the claims of each source, and how many have each verdict."""
    groups: dict[str, list[Estimate]] = {}
    for row in counted:
        groups.setdefault(row.claim.source, []).append(row)
    return [
        {"source": source, "counted": len(rows), **tally(rows)} for source, rows in groups.items()
    ]


def _captions(rows: Sequence[Estimate]) -> list[dict[str, Any]]:
    """Return what captions say in words, which may be of several metrics, and what came out."""
    groups: dict[tuple[str, str], list[Estimate]] = {}
    for row in rows:
        if row.claim.source.startswith(CAPTIONS) and row.claim.paper is None:
            groups.setdefault((row.claim.source, _statement(row)), []).append(row)
    return [
        {"rows": group, "text": text, "value": _means(group), "verdict": _verdict(group)}
        for (_, text), group in groups.items()
    ]


def _statement(row: Estimate) -> str:
    """Return what is claimed, with *it* for the metric."""
    text = row.claim.statement.replace(f"The {row.claim.metric} ", "It ")
    return text.replace(f"the {row.claim.metric} ", "it ")


def _means(rows: Sequence[Estimate]) -> str:
    """Write the means, from the smallest to the largest, with their unit."""
    if not all(row.is_finite for row in rows):
        return "undefined"
    ends = [end(rows, key=lambda row: row.mean).number for end in (min, max)]
    return f"{' to '.join(dict.fromkeys(ends))}{SPACE}{rows[0].unit}"


def _verdict(rows: Sequence[Estimate]) -> str:
    """Return the verdict; of several metrics, for how many it is reproduced."""
    return rows[0].verdict if len(rows) == 1 else f"{sum(row.holds for row in rows)} of {len(rows)}"
