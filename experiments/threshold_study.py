"""What the paper's thresholds cost and gain: ``python -m experiments.threshold_study``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd

from .command import run_command
from .effects import EFFECTS, effects, read_parts, read_table
from .study import Axis, Study, load_study, write_value
from .tables import to_csv, write_files

__all__ = ["CERTAIN", "RELEVANT", "TOLD", "costs_and_gains", "differs", "main", "to_markdown"]

TOLD = (
    "noise_power",
    "outlier_power",
    "majority_power",
    "noise_range_of_means",
    "camera_dependence",
    "seed_noise",
)
CERTAIN = 2.3  # standard errors: 95 % of Student's t, of the jackknife's nine degrees of freedom
RELEVANT = 0.02  # of the paper's value
SLOWER = 1.5  # times: longer run times are told

INTRODUCTION = f"""\
What the paper's choices cost and gain, each against the other values of the same option, all other
options at the paper's values. All values see the same cameras, and those that do not concern the
registration the same alignment and errors. Only differences above {CERTAIN:g} standard errors and
2 % are told; all stand in the tables.

τ: Kendall's rank correlation of the score with noise (mean over outlier counts) or with outliers
(mean over noise levels), positive where the score gets worse. Most are lost: four of five cameras
are outliers. Range: largest minus smallest mean score over the noise levels (mean over outlier
counts; that of single trials, which scatter widens, stands in the tables). Dependence on cameras:
how far the mean moves with the number of cameras, in % of its range over all noise levels. Seed
noise: standard deviation over the seeds of the registration (median over scenes).
"""


def to_markdown(study: Study, table: pd.DataFrame, times: pd.DataFrame) -> str:
    """Tell in sentences what the paper's values cost and gain.

    Parameters
    ----------
    study : Study
        The study.
    table : DataFrame
        What `experiments.effects.effects` returns.
    times : DataFrame
        What `experiments.study_time.measure` returns.
    """
    lines = [INTRODUCTION]
    for axis in study.axes.values():
        costs, gains = costs_and_gains(axis, table)
        lines.append(
            f"- **{axis.metric}, {axis.option} = {axis.paper}**, against "
            f"{', '.join(value for value in axis.values if value != axis.paper)}. "
            f"*Costs:* {'; '.join(costs) or 'nothing that these trials can tell'}. "
            f"*Gains:* {'; '.join(gains) or 'nothing that these trials can tell'}."
        )
    lines += [
        "",
        "Processor time of one evaluation, where the values differ in it. It is another in",
    ]
    lines += ["every run and on every machine.", ""]
    lines += [f"- {sentence}" for sentence in _times(study, times)]
    return "\n".join(lines) + "\n"


def costs_and_gains(axis: Axis, table: pd.DataFrame) -> tuple[list[str], list[str]]:
    """Tell what the paper's value of an axis costs and gains.

    Parameters
    ----------
    axis : Axis
        The axis.
    table : DataFrame
        What `experiments.effects.effects` returns.

    Returns
    -------
    costs, gains : list of str
        Each effect in which another value is certainly better, with the best one; and each in
        which another is certainly worse, with the worst one.
    """
    rows = table[table["axis"] == axis.name].set_index("value")
    costs, gains = [], []
    for name in TOLD:
        larger = EFFECTS[name].larger_is_better
        costs += _tell(rows, axis, name, larger, "instead of")
        gains += _tell(rows, axis, name, not larger, "against")
    return costs, gains


def _tell(rows: pd.DataFrame, axis: Axis, name: str, larger: bool, words: str) -> list[str]:
    """Tell of the most extreme of the values that certainly have a larger, or smaller, effect."""
    effect, ours = EFFECTS[name], float(rows[name][axis.paper])
    certain = {
        str(value): theirs
        for value, theirs, error in zip(rows.index, rows[name], rows[f"{name}_error"], strict=True)
        if differs(ours, theirs, error) and (theirs > ours) == larger
    }
    if not certain:
        return []
    other = (max if larger else min)(certain, key=certain.__getitem__)
    theirs = certain[other]
    written = write_value(axis.option, other)
    at = f"at {other}" if written == other else f"({written})"
    return [f"{effect.words} {effect.write(ours)} {words} {effect.write(theirs)} {at}"]


def differs(ours: float, theirs: float, error: float) -> bool:
    """Return whether another value's effect certainly is another than the paper's, by enough.

    Examples
    --------
    >>> from experiments.threshold_study import differs
    >>> differs(0.5, 0.6, 0.04), differs(0.5, 0.6, 0.06), differs(0.5, 0.509, 0.001)
    (True, False, False)
    """
    difference = abs(theirs - ours)
    return difference > CERTAIN * error and difference >= RELEVANT * abs(ours)


def _times(study: Study, times: pd.DataFrame) -> Iterator[str]:
    """Tell how long the values take."""
    for n, group in times.groupby("n_cameras"):
        for axis in study.axes.values():
            values = group[group["axis"] == axis.name].set_index("value")["milliseconds"]
            if values.max() < SLOWER * values.min():
                continue
            listed = ", ".join(f"{value} {time:.2f} ms" for value, time in values.items())
            yield f"{axis.metric}, {axis.option}, {n} cameras: {listed}."


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``threshold_study_*.csv`` and ``threshold_study.md``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.threshold_study",
        description="Tell what the paper's thresholds cost and gain, from the trials of the study.",
        epilog="settings are those that the trials were run with",
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    study = load_study("threshold", options.overrides)
    table, times = effects(study, read_parts(study)), read_table(study, "_time")
    kinds = table["axis"].str.partition("_")[0]
    files = {
        study.table_path(f"_{kind}"): to_csv(rows)
        for kind, rows in table.groupby(kinds, sort=False)
    }
    files[study.table_path().with_suffix(".md")] = to_markdown(study, table, times).encode()
    write_files(files)
    return list(files)


if __name__ == "__main__":
    sys.exit(main())
