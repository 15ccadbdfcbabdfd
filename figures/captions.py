"""The percentages in the captions of the paper, next to ours.

``python -m figures.captions TRIALS.csv ... --output captions.csv captions.md``
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from alignscores.writing import write_whole
from experiments.command import CommandError, run_command

OUTLIERS = "50 outliers against none", "n_outliers", 0, 50
ROTATION_NOISE = "σr of 9° against 1°", "sigma_r_deg", 1, 9
POSITION_NOISE = "σt of 0.1 against 0.01", "sigma_t", 0.01, 0.1
BOTH_NOISES = "(σt, σr) of (0.1, 10°) against (0.01, 1°)", "sigma_t", 0.01, 0.1
CAPTIONS = (  # figure, experiment, comparison, and the paper's percentage for each metric
    ("2", "outliers", OUTLIERS, {"mAA": -74, "TAS": -51}),
    ("6", "combined", ROTATION_NOISE, {"mAA": -66, "PAS": 13}),
    ("6", "combined", POSITION_NOISE, {"mAA": -84, "PAS": 14}),
    ("7a", "maa_vs_pas_outliers", OUTLIERS, {"mAA": -75, "PAS": -50}),
    ("7a", "maa_vs_pas_outliers", BOTH_NOISES, {"mAA": -94, "PAS": -55}),
    ("7c", "maa_vs_pas_collinear", OUTLIERS, {"mAA": -74, "PAS": -59}),
    ("7c", "maa_vs_pas_collinear", BOTH_NOISES, {"mAA": -73, "PAS": -24}),
)
CELL = ["n_cameras", "n_outliers", "sigma_t", "sigma_r_deg"]
NOTE = """\
Change of the range (largest minus smallest value) of a metric, in %. The paper does not say which
range: `all_trials` is the range of all single trials, `means` the range of their means for each
combination of settings. `snakemake claims` says how far they scatter from study to study.
"""


def captions(trials: pd.DataFrame) -> pd.DataFrame:
    """Compare the captions with trials of the paper's experiments.

    Parameters
    ----------
    trials : DataFrame
        The tables of trials of `outliers`, `combined`, `maa_vs_pas_outliers` and
        `maa_vs_pas_collinear`, one below the other.

    Returns
    -------
    DataFrame
        One row for each percentage: `figure`, `comparison`, `metric`, the change of the range in
        per cent in the `paper`, in `all_trials`, and in the `means` of the trials of each cell;
        NaN where the trials lack one side of the comparison.

    Raises
    ------
    ValueError
        If there is no trial of one of the experiments, or no column of a setting or a metric.
    """
    columns = {"experiment", *CELL, *(metric for *_, metrics in CAPTIONS for metric in metrics)}
    if missing := columns.difference(trials):
        raise ValueError(f"there is no column {min(missing)}")
    rows = []
    for figure, experiment, (comparison, setting, before, after), metrics in CAPTIONS:
        of_experiment = trials[trials["experiment"] == experiment]
        if of_experiment.empty:
            raise ValueError(f"there is no trial of the experiment {experiment}")
        means = of_experiment.groupby(CELL, as_index=False)[list(metrics)].mean()
        for metric, paper in metrics.items():
            row = {"figure": figure, "comparison": comparison, "metric": metric, "paper": paper}
            for name, table in {"all_trials": of_experiment, "means": means}.items():
                ranges = table.groupby(setting)[metric].agg(np.ptp)
                row[name] = 100 * (ranges.get(after, np.nan) / (ranges.get(before) or np.nan) - 1)
            rows.append(row)
    return pd.DataFrame(rows)


def to_markdown(table: pd.DataFrame) -> str:
    """Write the comparison in Markdown, in whole per cent as the paper has it."""
    shown = table.astype({"paper": float}).astype(object)
    shown = shown.where(shown.notna(), None)
    text: str = shown.to_markdown(index=False, floatfmt="+.0f", missingval="–")
    return f"{text}\n\n{NOTE}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the comparison as CSV or Markdown, by the ending of each path."""
    parser = ArgumentParser(prog="python -m figures.captions", description=__doc__.split("\n")[0])
    parser.add_argument("tables", nargs="+", type=Path, metavar="TRIALS.csv")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    tables = []
    for path in options.tables:
        try:
            tables.append(pd.read_csv(path))
        except (OSError, ValueError) as error:
            problem = getattr(error, "strerror", None) or " ".join(str(error).split())
            raise CommandError(f"cannot read {path}: {problem}") from None
    try:
        table = captions(pd.concat(tables, ignore_index=True))
        for path in options.output:
            text = to_markdown(table) if path.suffix == ".md" else table.to_csv(index=False)
            write_whole(path, text.encode())
    except ValueError as error:
        raise CommandError(str(error)) from None
    return list(options.output)


if __name__ == "__main__":
    sys.exit(main())
