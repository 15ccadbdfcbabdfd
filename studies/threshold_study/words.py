"""What the paper's thresholds cost and gain: words with the emphasis of Markdown, and a section."""

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import Any

import pandas as pd

from ..axes import Axis, axes_of, option_title, value_title
from ..order import SIGNIFICANCE
from ..study import Answer, config_file
from ..words import NONE, document
from .effects import COMPARED, EFFECTS

THRESHOLDS = config_file("threshold_study")
RELEVANT = 0.02  # of the paper's value
SLOWER = 1.5  # ratio of run times from which they are worth a sentence
NOTHING = "nothing that these trials can tell"

TERMS = {
    "Order of noise, of outliers": "How often two trials at neighbouring levels come in the right "
    "order, the mean over the numbers of outliers; and the other way round. 50 % is chance. Where "
    "most are lost: four of five cameras are outliers.",
    "Range over noise": "Largest minus smallest mean score over the noise levels, mean over the "
    "numbers of outliers. That of single trials, which scatter widens, stands in the tables.",
    "Dependence on cameras": "How far the mean moves with the number of cameras, in per cent of "
    "its range over all noise levels.",
    "Seed noise": "Standard deviation of one input’s score over the seeds of the registration, "
    "median over inputs.",
}
"""What the effects mean."""


Choice = dict[str, Any]  # a value that the paper chose, with what it costs and gains


def choices(axes: Sequence[Axis], table: pd.DataFrame) -> list[Choice]:
    """Tell in what another value certainly is better, with the best, or worse, with the worst."""
    found = []
    for axis in axes:
        rows = table[table["axis"] == axis.name].set_index("value")
        costs, gains = [], []
        for name in COMPARED:
            costs += _sentence(rows, axis, name, "better", "instead of")
            gains += _sentence(rows, axis, name, "worse", "against")
        others = [value_title(axis.option, value) for value in axis.values if value != axis.paper]
        found.append(
            {"axis": axis, "paper": value_title(axis.option, axis.paper)}
            | {"others": ", ".join(others), "costs": costs, "gains": gains}
        )
    return found


def _sentence(rows: pd.DataFrame, axis: Axis, name: str, mark: str, words: str) -> list[str]:
    """Name the most extreme of the values that certainly are better, or worse."""
    effect, of = EFFECTS[name], rows[name]
    certain = [value for value in axis.values if _mark(rows, name, value, axis.paper) == mark]
    if not certain:
        return []
    extreme = max if effect.larger_is_better == (mark == "better") else min
    other = extreme(certain, key=of.__getitem__)
    written = value_title(axis.option, other)
    at = f"at {other}" if written == other else f"({written})"
    ours, theirs = effect.write(of[axis.paper]), effect.write(of[other])
    return [f"{effect.words} {ours} {words} {theirs} {at}"]


def _mark(rows: pd.DataFrame, name: str, value: str, paper: str) -> str:
    """Tell whether a value certainly is better or worse than the paper's, by enough."""
    ours, theirs = rows[name][paper], rows[name][value]
    if not (rows[f"{name}_p"][value] < SIGNIFICANCE and abs(theirs - ours) >= RELEVANT * abs(ours)):
        return ""
    return "better" if (theirs > ours) == EFFECTS[name].larger_is_better else "worse"


def lead(found: Sequence[Choice]) -> str:
    """Sum up in a sentence or two how many of the paper's values cost something."""
    costly = sum(bool(choice["costs"]) for choice in found)
    useful = sum(bool(choice["gains"]) for choice in found)
    text = (
        f"Of {len(found)} values that the paper chose by experience, **{costly} cost something** "
        f"that another value would give, and **{useful} gain something** that another would lose."
    )
    axes = (choice["axis"] for choice in found if not choice["costs"])
    free = [f"{option_title(axis.option)} ({axis.metric})" for axis in axes]
    return f"{text} No cost shows for these: {', '.join(free)}." if free else text


def method(trials: int) -> str:
    """Tell how the values were compared, and how many trials there are in each cell."""
    cell = "1 trial" if trials == 1 else f"{trials} trials"
    return (
        "Each value is compared with others of the same option, all other options as in the paper, "
        f"on the same cameras, {cell} in each cell. A cost names the best of the values that "
        "certainly are better, a gain the worst of those that certainly are worse; what is best in "
        f"one respect is often worse in another. Certain is what differs by {100 * RELEVANT:g} % "
        "or more, and with so small a p-value (of paired trials; of Wilcoxon’s signed "
        "ranks for the seed noise; all adjusted by Holm’s method) that any difference in "
        f"the study is told by chance with a probability of at most {100 * SIGNIFICANCE:g} %."
    )


def to_markdown(axes: Sequence[Axis], table: pd.DataFrame, times: pd.DataFrame, trials: int) -> str:
    """Write what the paper's values cost and gain."""
    found = choices(axes, table)
    return document(
        lead(found),
        method(trials),
        [
            f"- **{choice['axis'].title}, {choice['paper']}**, against {choice['others']}. "
            f"*Costs:* {'; '.join(choice['costs']) or NOTHING}. "
            f"*Gains:* {'; '.join(choice['gains']) or NOTHING}."
            for choice in found
        ],
        [f"- *{term}*: {text}" for term, text in TERMS.items()],
        "Processor time of one evaluation, where the values differ in it. It is another in\n"
        "every run and on every machine.",
        _times(axes, times),
    )


def _times(axes: Sequence[Axis], times: pd.DataFrame) -> Iterator[str]:
    for n, group in times.groupby("n_cameras"):
        for axis in axes:
            values = group[group["axis"] == axis.name].set_index("value")["milliseconds"]
            if values.max() >= SLOWER * values.min():
                listed = ", ".join(f"{value} {time:.2f} ms" for value, time in values.items())
                yield f"- {axis.metric}, {axis.option}, {n} cameras: {listed}."


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    axes = axes_of(THRESHOLDS, {name: one.metrics for name, one in answer.records.items()})
    tables = answer.tables
    table = pd.concat([one for one in tables.values() if "paper" in one])
    times = tables[f"{answer.called}_time"]
    found = choices(axes, table)
    return {
        "choices": found,
        "lead": lead(found),
        "method": method(answer.records["outliers"].sweep.trials),
        "nothing": NOTHING,
        "terms": TERMS,
        "effects": [EFFECTS[name] for name in COMPARED],
        "cameras": sorted(times["n_cameras"].unique()),
        "values": {axis.name: _values(axis, table, times) for axis in axes},
    }


def _values(axis: Axis, table: pd.DataFrame, times: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the values of an axis with their effects, marked where certain, and run times."""
    effects, timed = (rows[rows["axis"] == axis.name].set_index("value") for rows in (table, times))
    return [
        {
            "text": value_title(axis.option, value),
            "is_paper": value == axis.paper,
            "effects": [_cell(effects, name, value, axis.paper) for name in COMPARED],
            "times": [f"{time:.2f} ms" for time in timed.loc[[value], "milliseconds"]],
        }
        for value in axis.values
    ]


def _cell(table: pd.DataFrame, name: str, value: str, paper: str) -> dict[str, str]:
    """Return a number, and where it certainly is better or worse than the paper's, that word."""
    theirs = table[name][value]
    text = EFFECTS[name].write(theirs) if isfinite(theirs) else NONE
    return {"text": text, "mark": _mark(table, name, value, paper)}
