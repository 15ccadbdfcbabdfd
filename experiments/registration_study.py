"""The paper's registration and the refined one: ``python -m experiments.registration_study``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd

from . import statistics
from .command import run_command
from .effects import read_parts, read_table, seeds_of
from .study import Axis, Part, Study, load_study
from .tables import to_csv, write_files

__all__ = ["AXIS", "REPEATS", "compare", "level", "main", "summarise", "to_markdown"]

AXIS = "tas_registration"
CELL = ("n_cameras", "n_outliers", "sigma_t")
SCENE = (*CELL, "trial")
OVER_SEEDS: Mapping[str, Callable[[pd.DataFrame], "pd.Series[float]"]] = {
    "mean": lambda scores: scores.mean(axis=1),
    "standard deviation": lambda scores: scores.std(axis=1, ddof=1),
    "smallest": lambda scores: scores.min(axis=1),
    "largest": lambda scores: scores.max(axis=1),
}
Summary = dict[str, dict[str, "pd.Series[float]"]]  # of each part, each statistic
REPEATS = 0.003  # standard deviation over seeds of a score whose second digit is certain


def compare(study: Study, trials: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Compare the registrations.

    Returns
    -------
    DataFrame
        One row for each statistic: `part, geometry, n_cameras, n_outliers, sigma_t, trial` (empty
        where the statistic is over all of them), `statistic`, and a column for each registration.

        - Of each input that was registered with several seeds: "mean", "standard deviation",
          "smallest" and "largest" score over the seeds.
        - Of each experiment: "τ with noise" at each number of cameras and outliers, "τ with
          outliers" at each noise level, and "dependence on cameras, %", the movement of the mean
          over the numbers of cameras in per cent of the range of all means; each where it varies.
    """
    axis = study.axes[AXIS]
    rows: list[dict[str, object]] = []
    for name, part in study.parts.items():
        found = _spread(trials[name], axis) if part.seeds else _experiment(trials[name], axis)
        rows += [_named(part) | row for row in found]
    columns = ["part", "geometry", *SCENE, "statistic", *axis.values]
    table = pd.DataFrame(rows, columns=columns)
    return table.astype(dict.fromkeys(("n_cameras", "n_outliers", "trial"), "Int64")).round(6)


def _named(part: Part) -> dict[str, object]:
    return {"part": part.name, "geometry": part.config.geometry}


def _spread(trials: pd.DataFrame, axis: Axis) -> Iterator[dict[str, object]]:
    """Statistics over the seeds, of each input."""
    scores = {value: seeds_of(trials, axis.column(value)) for value in axis.values}
    for i, scene in enumerate(trials[list(SCENE)].itertuples(index=False, name=None)):
        for name, of in OVER_SEEDS.items():
            values = {value: float(of(table).iloc[i]) for value, table in scores.items()}
            yield _row(dict(zip(SCENE, scene, strict=True)), name, values)


def _experiment(trials: pd.DataFrame, axis: Axis) -> Iterator[dict[str, object]]:
    """Discerning power in each group of trials, and the dependence on the number of cameras."""
    for level, words in (("sigma_t", "noise"), ("n_outliers", "outliers")):
        if trials[level].nunique() < 2:
            continue
        groups = [key for key in CELL if key != level]
        for cell, group in trials.groupby(groups):
            powers = {
                value: statistics.power(group, axis.column(value), [level], "mean")
                for value in axis.values
            }
            yield _row(dict(zip(groups, cell, strict=True)), f"τ with {words}", powers)
    if trials["n_cameras"].nunique() > 1:
        dependence = {
            value: statistics.dependence(trials, axis.column(value), ["n_cameras"], "mean")
            for value in axis.values
        }
        yield _row({}, "dependence on cameras, %", dependence)


def _row(
    cell: Mapping[str, object], statistic: str, values: Mapping[str, float]
) -> dict[str, object]:
    return {**cell, "statistic": statistic, **values}


def summarise(axis: Axis, table: pd.DataFrame) -> Summary:
    """Summarise what `compare` returns.

    Returns
    -------
    dict
        For each part, and for each statistic, the number of each registration.

        - Over the inputs that were registered with several seeds, the part being "": "median
          standard deviation", "largest standard deviation", "scattered inputs", the number of
          those with a standard deviation above `REPEATS`, and "mean score".
        - Of each experiment: mean and smallest of each τ over its groups, such as "mean τ with
          noise", and "dependence on cameras, %".
    """
    summary: Summary = {}
    deviation, mean = (_of_inputs(axis, table, name) for name in ("standard deviation", "mean"))
    if not mean.empty:
        summary[""] = {
            "median standard deviation": deviation.median(),
            "largest standard deviation": deviation.max(),
            "scattered inputs": (deviation > REPEATS).sum(),
            "mean score": mean.mean(),
        }
    of_experiments = table[~table["statistic"].isin(list(OVER_SEEDS))]
    for key, group in of_experiments.groupby(["part", "statistic"], sort=False):
        part, name = map(str, key)
        numbers = group[list(axis.values)]
        found = {name: numbers.iloc[0]}
        if name.startswith("τ"):
            found = {f"mean {name}": numbers.mean(), f"smallest {name}": numbers.min()}
        summary[part] = summary.get(part, {}) | found
    return summary


def level(axis: Axis, table: pd.DataFrame) -> "pd.Series[float]":
    """Return how much higher the refined mean score of each input over its seeds is."""
    mean = _of_inputs(axis, table, "mean")
    return mean[_refined(axis)] - mean[axis.paper]


def _of_inputs(axis: Axis, table: pd.DataFrame, statistic: str) -> pd.DataFrame:
    return table.loc[table["statistic"] == statistic, list(axis.values)].astype(float)


def _refined(axis: Axis) -> str:
    (refined,) = (value for value in axis.values if value != axis.paper)
    return refined


def to_markdown(study: Study, table: pd.DataFrame, times: pd.DataFrame) -> str:
    """Tell in sentences what the refined registration changes."""
    axis = study.axes[AXIS]
    paper, refined = axis.paper, _refined(axis)
    lines = [f"The registration of the paper, {paper}, and {refined}, on the same cameras.", ""]
    for part, numbers in summarise(axis, table).items():
        if part:
            sentences = _power_sentences(axis, part, numbers)
        else:
            sentences = _spread_sentences(axis, numbers, level(axis, table))
        lines += [f"- {sentence}" for sentence in sentences]
    lines += [
        f"- **Meaning.** {refined} aligns so that the score is the largest. Its scores are higher, "
        "and do not compare with published TAS values: those rest on the paper's registration.",
        "",
        "Processor time of one evaluation; it is another in every run and on every machine.",
        "",
    ]
    for n, group in times[times["axis"] == AXIS].groupby("n_cameras"):
        ms = group.set_index("value")["milliseconds"]
        lines.append(
            f"- {n} cameras: {paper} {ms[paper]:.2f} ms, {refined} {ms[refined]:.2f} ms, "
            f"{ms[refined] / ms[paper]:.1f} times as long."
        )
    return "\n".join(lines) + "\n"


def _spread_sentences(
    axis: Axis, numbers: Mapping[str, "pd.Series[float]"], gain: "pd.Series[float]"
) -> Iterator[str]:
    paper, refined = axis.paper, _refined(axis)
    median, largest, scattered, _ = numbers.values()
    yield (
        f"**Spread.** The median standard deviation over the seeds of {len(gain)} inputs is "
        f"{median[paper]:.5f} with {paper} and {median[refined]:.5f} with {refined}, the largest "
        f"{largest[paper]:.4f} and {largest[refined]:.4f}. It is above {REPEATS} on "
        f"{scattered[paper]} and {scattered[refined]} of them."
    )
    yield (
        f"**Level.** The mean score with {refined} is higher on {int((gain > 0).sum())} of "
        f"{len(gain)} inputs and lower on {int((gain < 0).sum())}; the difference is "
        f"{gain.median():+.3f} in the median, from {gain.min():+.4f} to {gain.max():+.4f}."
    )


def _power_sentences(
    axis: Axis, part: str, numbers: Mapping[str, "pd.Series[float]"]
) -> Iterator[str]:
    told = []
    for name in (name for name in numbers if name.startswith("mean τ")):
        means, smallest = numbers[name], numbers[name.replace("mean", "smallest", 1)]
        written = " and ".join(f"{means[value]:.3f} ({value})" for value in axis.values)
        lowest = " and ".join(f"{smallest[value]:.3f}" for value in axis.values)
        told.append(f"{name} {written}, smallest {lowest}")
    if told:
        yield f"**Power, {part}.** {'; '.join(told)}."
    if "dependence on cameras, %" in numbers:
        moved = numbers["dependence on cameras, %"]
        values = " and ".join(f"{moved[value]:.1f} % ({value})" for value in axis.values)
        yield (
            f"**Number of cameras, {part}.** The mean score moves by {values} of its range "
            "over all noise levels."
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``registration_study.csv`` and ``registration_study.md``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.registration_study",
        description="Compare the registrations, from the trials of the study.",
        epilog="settings are those that the trials were run with",
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    study = load_study("registration", options.overrides)
    table, times = compare(study, read_parts(study)), read_table(study, "_time")
    sentences = to_markdown(study, table, times)
    path = study.table_path()
    write_files({path: to_csv(table), path.with_suffix(".md"): sentences.encode()})
    return [path, path.with_suffix(".md")]


if __name__ == "__main__":
    sys.exit(main())
