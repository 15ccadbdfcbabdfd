"""The paper's registration and the refined one, on the same cameras: numbers, words, a section."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import starmap
from typing import Any

import pandas as pd

from experiments.metrics import Column
from experiments.tables import Trials

from .. import order, statistics
from ..axes import Axis, axes_of, is_seeded, over_seeds
from ..study import Answer, config_file
from ..words import document

CELL = ("n_cameras", "n_outliers", "sigma_t")
SCENE = (*CELL, "trial")
OVER_SEEDS = {"mean": "mean", "standard deviation": "std", "smallest": "min", "largest": "max"}
Summary = dict[str, dict[str, "pd.Series[float]"]]  # of each part ("": inputs), each statistic
DEPENDENCE = "dependence on cameras, %"
ORDER = "order of "  # noise or outliers
REGISTRATIONS = config_file("registration_study")
GEOMETRIES = {"cube": "in a cube", "line": "on a line", "uneven": "in clusters"}
REPEATABLE = 0.003  # standard deviation over seeds of a score whose second digit is certain

DIGITS = {  # of the statistics; one of an order, three of all others
    "median standard deviation": 5,
    "largest standard deviation": 4,
    "scattered inputs": 0,
    DEPENDENCE: 1,
}


def compare(axis: Axis, parts: Mapping[str, Trials]) -> pd.DataFrame:
    """Compare the registrations, which are the values of an axis.

    Returns
    -------
    DataFrame
        One row for each statistic: `part, geometry, n_cameras, n_outliers, sigma_t, trial` (empty
        where the statistic is over all of them), `statistic`, and a column for each registration.

        - Of each input that was registered with several seeds: "mean", "standard deviation",
          "smallest" and "largest" score over the seeds.
        - Of each experiment: "order of noise, %" at each number of cameras and outliers, "order of
          outliers, %" at each noise level, and "dependence on cameras, %", the movement of the mean
          over the numbers of cameras in per cent of the range of all means; each where it varies.
    """
    rows: list[dict[str, object]] = []
    for name, trials in parts.items():
        of = _spread if is_seeded(trials.record.metrics) else _experiment
        own = {"part": name, "geometry": trials.sweep.geometry}
        rows += [own | row for row in of(trials.table, axis)]
    columns = ["part", "geometry", *SCENE, "statistic", *axis.values]
    table = pd.DataFrame(rows, columns=columns)
    return table.astype(dict.fromkeys(("n_cameras", "n_outliers", "trial"), "Int64")).round(6)


def _spread(trials: pd.DataFrame, axis: Axis) -> Iterator[dict[str, object]]:
    """Statistics over the seeds, of each input."""
    spreads = {
        value: over_seeds(trials, column).agg(list(OVER_SEEDS.values()), axis=1)
        for value, column in axis.columns.items()
    }
    for i, scene in trials[list(SCENE)].iterrows():
        for name, of in OVER_SEEDS.items():
            values = {value: table.at[i, of] for value, table in spreads.items()}
            yield {**scene, "statistic": name, **values}


def _experiment(trials: pd.DataFrame, axis: Axis) -> Iterator[dict[str, object]]:
    """Return the order in each group of trials, and the dependence on the number of cameras."""
    for level, words in (("sigma_t", "noise"), ("n_outliers", "outliers")):
        if not order.varies(trials, level):
            continue
        groups = [key for key in CELL if key != level]
        for cell, group in trials.groupby(groups):
            row = {**dict(zip(groups, cell, strict=True)), "statistic": f"{ORDER}{words}, %"}
            task = order.within(group, level)
            for value, column in axis.columns.items():
                row[value] = 100 * order.estimate(task.shares(column)).probability
            yield row
    if order.varies(trials, "n_cameras"):
        row = {"statistic": DEPENDENCE}
        for value, column in axis.columns.items():
            row[value] = statistics.dependence(trials, column, ["n_cameras"], "mean")
        yield row


def summarise(axis: Axis, table: pd.DataFrame) -> Summary:
    """Summarise what `compare` returns: by part, and by statistic, each registration's number."""
    summary: Summary = {}
    deviation, mean = (_of_inputs(axis, table, name) for name in ("standard deviation", "mean"))
    if not mean.empty:
        summary[""] = {
            "median standard deviation": deviation.median(),
            "largest standard deviation": deviation.max(),
            "scattered inputs": (deviation > REPEATABLE).sum(),
            "mean score": mean.mean(),
        }
    of_experiments = table[~table["statistic"].isin(list(OVER_SEEDS))]
    for key, group in of_experiments.groupby(["part", "statistic"], sort=False):
        part, name = map(str, key)
        numbers = group[list(axis.values)]
        found = {name: numbers.iloc[0]}
        if name.startswith(ORDER):
            found = {f"mean {name}": numbers.mean(), f"smallest {name}": numbers.min()}
        summary[part] = summary.get(part, {}) | found
    return summary


def gain(axis: Axis, table: pd.DataFrame) -> "pd.Series[float]":
    """Return how much higher the other mean score of each input over its seeds is."""
    mean = _of_inputs(axis, table, "mean")
    paper, refined = axis.values
    return mean[refined] - mean[paper]


def _of_inputs(axis: Axis, table: pd.DataFrame, statistic: str) -> pd.DataFrame:
    return table.loc[table["statistic"] == statistic, list(axis.values)].astype(float)


def spread(axis: Axis, table: pd.DataFrame) -> str:
    """Tell how the scores scatter over the seeds; nothing where no input has several."""
    numbers = summarise(axis, table).get("")
    if numbers is None:
        return ""
    (paper, refined), n = axis.values, len(gain(axis, table))
    scattered = numbers["scattered inputs"]
    median, largest = (numbers[f"{name} standard deviation"] for name in ("median", "largest"))
    return (
        f"The TAS scatters with the seed of the paper’s registration: on **{scattered[paper]} of "
        f"{n} inputs** by more than {REPEATABLE} (standard deviation), so that its second digit is "
        f"uncertain. With the {refined} registration it does on "
        f"**{scattered[refined] or 'none'}**. The median standard deviation is "
        f"{median[paper]:.5f} with {paper} and {median[refined]:.5f} with {refined}, the largest "
        f"{largest[paper]:.4f} and {largest[refined]:.4f}."
    )


def meaning(axis: Axis, table: pd.DataFrame) -> str:
    """Tell that the scores mean something else, and how much higher they are."""
    gains, (_, refined) = gain(axis, table), axis.values
    higher = (
        f"higher on {int((gains > 0).sum())} of {len(gains)} inputs and lower on "
        f"{int((gains < 0).sum())} ({gains.median():+.3f} in the median, from {gains.min():+.4f} "
        f"to {gains.max():+.4f})"
    )
    return (
        f"The {refined} registration aligns so that the score is the largest. The score is "
        f"{higher if len(gains) else 'higher'} and **does not compare with published TAS values**: "
        "those rest on the paper’s registration, which has not seen the score."
    )


def to_markdown(axis: Axis, table: pd.DataFrame, times: pd.DataFrame) -> str:
    """Write what the other registration changes."""
    paper, refined = axis.values
    sentences = [spread(axis, table), meaning(axis, table), *_orders(axis, table)]
    own = times[times["axis"] == axis.name]
    both = own.pivot(index="n_cameras", columns="value", values="milliseconds")
    return document(
        f"The registration of the paper, {paper}, and {refined}, on the same cameras.",
        [f"- {sentence}" for sentence in sentences if sentence],
        "Processor time of one evaluation; it is another in every run and on every\nmachine.",
        [
            f"- {n} cameras: {paper} {ms[paper]:.2f} ms, {refined} {ms[refined]:.2f} ms, "
            f"{ms[refined] / ms[paper]:.1f} times as long."
            for n, ms in both.iterrows()
        ],
    )


def _orders(axis: Axis, table: pd.DataFrame) -> Iterator[str]:
    for part, numbers in summarise(axis, table).items():
        found = []
        for name in (name for name in numbers if name.startswith(f"mean {ORDER}")):
            means, smallest = numbers[name], numbers[name.replace("mean", "smallest", 1)]
            lowest = " and ".join(f"{smallest[value]:.1f} %" for value in axis.values)
            found.append(f"{name.removesuffix(', %')} {_both(means)}, smallest {lowest}")
        if found:
            yield f"**Right order, {part}.** {'; '.join(found)}."
        if DEPENDENCE in numbers:
            yield (
                f"**Number of cameras, {part}.** The mean score moves by "
                f"{_both(numbers[DEPENDENCE])} of its range over all noise levels."
            )


def _both(numbers: "pd.Series[float]") -> str:
    return " and ".join(f"{number:.1f} % ({value})" for value, number in numbers.items())


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    metrics = {name: record.metrics for name, record in answer.records.items()}
    (axis,) = axes_of(REGISTRATIONS, metrics)
    table, times = answer.table, answer.tables[f"{answer.called}_time"]
    inputs = _inputs(axis, table)
    columns = [Column.parse(metric) for part in metrics.values() for metric in part]
    n_seeds = len({column.options["seed"] for column in columns if "seed" in column.options})
    titles = {"": f"{len(inputs)} inputs, {n_seeds} seeds each"}
    groups = [
        {
            "title": titles.get(part, f"Experiment {part.replace('_', ' ')}"),
            "part": part,
            "rows": list(starmap(_row, numbers.items())),
        }
        for part, numbers in summarise(axis, table).items()
    ]
    timed = [
        (f"{n} cameras", [f"{milliseconds:.2f} ms" for milliseconds in rows["milliseconds"]])
        for n, rows in times.groupby("n_cameras")
    ]
    groups.append({"title": "Processor time of one evaluation", "part": "", "rows": timed})
    once = (one.sweep for one in answer.records.values() if not is_seeded(one.metrics))
    return {
        "values": axis.values,
        "paper": axis.paper,
        "trials": next(once).trials,
        "spread": spread(axis, table),
        "meaning": meaning(axis, table),
        "repeatable": REPEATABLE,
        "groups": groups,
        "inputs": inputs,
    }


def _row(name: str, numbers: "pd.Series[float]") -> tuple[str, list[str]]:
    digits = DIGITS.get(name, 1 if ORDER in name else 3)
    return name[0].upper() + name[1:], [f"{number:.{digits}f}" for number in numbers]


def _inputs(axis: Axis, table: pd.DataFrame) -> list[tuple[str, Sequence[str]]]:
    """Return each input with the mean and the standard deviation of its scores over the seeds."""
    scene = ["part", "geometry", *SCENE]
    several = table["trial"].nunique() > 1
    rows: list[tuple[str, Sequence[str]]] = []
    for _, group in table.groupby(scene, sort=False):
        first, of = group.iloc[0], group.set_index("statistic")
        where = GEOMETRIES.get(first["geometry"], first["geometry"])
        words = f"{first['n_cameras']:.0f} {where}, {first['n_outliers']:.0f} outliers, "
        words += f"sigma_t {first['sigma_t']:g}"
        words += f", trial {1 + first['trial']:.0f}" if several else ""
        texts = [
            f"{of[value]['mean']:.4f} ± {of[value]['standard deviation']:.4f}"
            for value in axis.values
        ]
        rows.append((words, texts))
    return rows
