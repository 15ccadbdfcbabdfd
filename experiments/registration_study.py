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

__all__ = ["compare", "main", "to_markdown"]

AXIS = "tas_registration"
CELL = ("n_cameras", "n_outliers", "sigma_t")
OVER_SEEDS: Mapping[str, Callable[[pd.DataFrame], "pd.Series[float]"]] = {
    "mean": lambda scores: scores.mean(axis=1),
    "standard deviation": lambda scores: scores.std(axis=1, ddof=1),
    "smallest": lambda scores: scores.min(axis=1),
    "largest": lambda scores: scores.max(axis=1),
}
REPEATS = 0.003  # standard deviation over seeds of a score whose second digit is certain


def compare(study: Study, trials: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Compare the registrations.

    Returns
    -------
    DataFrame
        One row for each statistic: `part, geometry, n_cameras, n_outliers, sigma_t` (empty where
        the statistic is over all of them), `statistic`, and a column for each registration.

        - Of each input that was registered with several seeds: "mean", "standard deviation",
          "smallest" and "largest" score over the seeds.
        - Of each experiment: "|τ| with noise" at each number of cameras and outliers, "|τ| with
          outliers" at each noise level, and "dependence on cameras, %", the movement of the mean
          over the numbers of cameras in per cent of the range of all means; each where it varies.
    """
    axis = study.axes[AXIS]
    rows: list[dict[str, object]] = []
    for name, part in study.parts.items():
        found = _spread(trials[name], axis) if part.seeds else _experiment(trials[name], axis)
        rows += [_named(part) | row for row in found]
    columns = ["part", "geometry", *CELL, "statistic", *axis.values]
    table = pd.DataFrame(rows, columns=columns)
    return table.astype({"n_cameras": "Int64", "n_outliers": "Int64"}).round(6)


def _named(part: Part) -> dict[str, object]:
    return {"part": part.name, "geometry": part.config.geometry}


def _spread(trials: pd.DataFrame, axis: Axis) -> Iterator[dict[str, object]]:
    """Statistics over the seeds, of each input."""
    scores = {value: seeds_of(trials, axis.column(value)) for value in axis.values}
    for i, cell in enumerate(trials[list(CELL)].itertuples(index=False, name=None)):
        for name, of in OVER_SEEDS.items():
            values = {value: float(of(table).iloc[i]) for value, table in scores.items()}
            yield _row(dict(zip(CELL, cell, strict=True)), name, values)


def _experiment(trials: pd.DataFrame, axis: Axis) -> Iterator[dict[str, object]]:
    """Discerning power in each group of trials, and the dependence on the number of cameras."""
    for level, words in (("sigma_t", "noise"), ("n_outliers", "outliers")):
        if trials[level].nunique() < 2:
            continue
        groups = [key for key in CELL if key != level]
        for cell, group in trials.groupby(groups):
            powers = {
                value: abs(statistics.correlation(group[axis.column(value)], group[level]))
                for value in axis.values
            }
            yield _row(dict(zip(groups, cell, strict=True)), f"|τ| with {words}", powers)
    if trials["n_cameras"].nunique() > 1:
        dependence = {
            value: statistics.dependence(trials, axis.column(value), "n_cameras", "mean")
            for value in axis.values
        }
        yield _row({}, "dependence on cameras, %", dependence)


def _row(
    cell: Mapping[str, object], statistic: str, values: Mapping[str, float]
) -> dict[str, object]:
    return {**cell, "statistic": statistic, **values}


def to_markdown(study: Study, table: pd.DataFrame, times: pd.DataFrame) -> str:
    """Tell in sentences what the refined registration changes."""
    axis = study.axes[AXIS]
    paper = axis.paper
    (refined,) = (value for value in axis.values if value != paper)
    lines = [f"The registration of the paper, {paper}, and {refined}, on the same cameras.", ""]
    sentences = [*_spread_sentences(table, paper, refined), *_power_sentences(table, axis)]
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


def _spread_sentences(table: pd.DataFrame, paper: str, refined: str) -> Iterator[str]:
    spread, mean = (table[table["statistic"] == name] for name in ("standard deviation", "mean"))
    if spread.empty:
        return
    n = len(spread)
    yield (
        f"**Spread.** The median standard deviation over the seeds of {n} inputs is "
        f"{spread[paper].median():.5f} with {paper} and {spread[refined].median():.5f} with "
        f"{refined}, the largest {spread[paper].max():.4f} and {spread[refined].max():.4f}. It is "
        f"above {REPEATS} on {int((spread[paper] > REPEATS).sum())} and "
        f"{int((spread[refined] > REPEATS).sum())} of them."
    )
    gain = mean[refined] - mean[paper]
    yield (
        f"**Level.** The mean score with {refined} is higher on {int((gain > 0).sum())} of {n} "
        f"inputs and lower on {int((gain < 0).sum())}; the difference is {gain.median():+.3f} in "
        f"the median, from {gain.min():+.4f} to {gain.max():+.4f}."
    )


def _power_sentences(table: pd.DataFrame, axis: Axis) -> Iterator[str]:
    for part, group in table[table["statistic"].str.startswith("|τ|")].groupby("part", sort=False):
        told = []
        for name, rows in group.groupby("statistic", sort=False):
            means = " and ".join(f"{rows[value].mean():.3f} ({value})" for value in axis.values)
            lowest = " and ".join(f"{rows[value].min():.3f}" for value in axis.values)
            told.append(f"mean {name} {means}, smallest {lowest}")
        yield f"**Power, {part}.** {'; '.join(told)}."
    for _, row in table[table["statistic"] == "dependence on cameras, %"].iterrows():
        values = " and ".join(f"{row[value]:.1f} % ({value})" for value in axis.values)
        yield (
            f"**Number of cameras, {row['part']}.** The mean score moves by {values} of its range "
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
