"""What the scenarios of a study show: ``python -m experiments.findings``.

A metric orders the noise levels of a scenario where it gets worse with noise and Kendall's rank
correlation is at least 0.5 at every number of outliers; likewise for the numbers of outliers.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .config import Config, ConfigError
from .scenarios import BEYOND, Study, load_study
from .statistics import favour
from .tables import TableError, read_trials, trials_path, write_files

__all__ = ["DISCERNS", "LEVELS", "findings", "findings_path", "main"]

DISCERNS = 0.5  # as in the claims: three of four pairs of trials are in the right order
LEVELS = {"noise": "sigma_t", "outliers": "n_outliers"}
GENERATORS = ("geometry", "error", "outliers", "outlier_side")
JUDGED = ("TAS", "RAS", "PAS")  # whose failures are told
NEAR_ZERO = 0.1  # a score that has so little left
RISE = 0.02  # of a mean score; less may be scatter


def findings(trials: Mapping[str, pd.DataFrame], scenarios: Mapping[str, Config]) -> pd.DataFrame:
    """Judge every metric in every scenario.

    Parameters
    ----------
    trials : mapping of str to DataFrame
        The trials of each scenario.
    scenarios : mapping of str to Config
        Their settings.

    Returns
    -------
    DataFrame
        One row for each scenario and metric:

        - `scenario, geometry, error, outliers, outlier_side, metric`
        - `noise_power`: the smallest Kendall tau with the noise level at any number of outliers,
          positive where the metric gets worse with noise; empty where there is one level
        - `outlier_power`: likewise with the number of outliers, at any noise level
        - `mean`: of the metric, over all trials
        - `verdict`: "orders noise and outliers", "orders noise", "orders outliers" or "orders
          nothing"
        - `finding`: of the scenario, in sentences; the same in all its rows
    """
    rows = []
    for name, config in scenarios.items():
        judged = [_judge(trials[name], metric) for metric in config.metrics]
        keys = {key: getattr(config, key) for key in GENERATORS}
        finding = " ".join(_sentences(trials[name], judged))
        rows += [{"scenario": name} | keys | row | {"finding": finding} for row in judged]
    return pd.DataFrame(rows)


def _judge(trials: pd.DataFrame, metric: str) -> dict[str, Any]:
    noise, outliers = (_power(trials, metric, column) for column in LEVELS.values())
    powers = dict(zip(LEVELS, (noise, outliers), strict=True))
    ordered = [level for level, power in powers.items() if power >= DISCERNS]
    return {
        "metric": metric,
        "noise_power": noise,
        "outlier_power": outliers,
        "mean": float(trials[metric].mean()),
        "verdict": f"orders {' and '.join(ordered) or 'nothing'}",
    }


def _power(trials: pd.DataFrame, metric: str, level: str) -> float:
    """Discerning power with its sign: a metric that looks better with more noise has none."""
    if trials[level].nunique() < 2:
        return np.nan
    return -favour(trials, metric, level, "largest")


def _sentences(trials: pd.DataFrame, judged: Sequence[Mapping[str, Any]]) -> list[str]:
    verdicts: dict[str, list[str]] = {}
    for row in judged:
        verdicts.setdefault(row["verdict"], []).append(row["metric"])
    sentences = [
        f"{'; '.join(f'{_names(metrics)}: {verdict}' for verdict, metrics in verdicts.items())}."
    ]
    ours = [row for row in judged if row["metric"] in JUDGED]
    failures = [
        f"{row['metric']} fails on {level} (tau {row[column]:.2f})"
        for row in ours
        for level, column in (("noise", "noise_power"), ("outliers", "outlier_power"))
        if row[column] < DISCERNS
    ]
    sentences += [f"{_names(failures)}."] if failures else []
    for row in ours:
        sentences += [*_near_zero(trials, row["metric"]), *_rise(trials, row["metric"])]
    return sentences


def _near_zero(trials: pd.DataFrame, metric: str) -> list[str]:
    """Tell where nothing is left of a score for more outliers to take away."""
    strongest = trials[trials["sigma_t"] == trials["sigma_t"].max()]
    fewest = strongest["n_outliers"].min()
    mean = strongest.loc[strongest["n_outliers"] == fewest, metric].mean()
    if mean >= NEAR_ZERO:
        return []
    return [f"At the strongest noise {metric} is {mean:.2f} with {fewest} outliers."]


def _rise(trials: pd.DataFrame, metric: str) -> list[str]:
    """Tell where the mean of a score rises with the number of outliers."""
    means = trials.groupby("n_outliers")[metric].mean()
    pairs = [(means[more] - means[few], few, more) for few, more in combinations(means.index, 2)]
    rise, few, more = max(pairs, default=(0.0, 0, 0))
    if rise < RISE:
        return []
    return [
        f"{metric} is better with {more} outliers than with {few} "
        f"(mean {means[more]:.2f} and {means[few]:.2f})."
    ]


def _names(names: Sequence[str]) -> str:
    return " and ".join([part for part in (", ".join(names[:-1]), names[-1]) if part])


def findings_path(study: Study) -> Path:
    """Return the path of the table of a study's findings."""
    return Path(study.results_dir) / "tables" / f"{study.name}.csv"


def _read(config: Config) -> pd.DataFrame:
    trials = read_trials(config)
    for metric in config.metrics:
        if metric not in trials:
            raise TableError(config.name, f"has no column {metric}")
    return trials


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/tables/<study>.csv``; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m experiments.findings",
        description="Tell what the scenarios show, from their tables of trials.",
        epilog="settings are those that the scenarios were run with",
    )
    parser.add_argument("overrides", nargs="*", metavar="key=value")
    parser.add_argument("--scenarios", type=Path, default=BEYOND, metavar="FILE")
    options = parser.parse_intermixed_args(arguments)
    try:
        study = load_study(options.scenarios, options.overrides)
    except ConfigError as error:
        print(f"experiments.findings: {error}", file=sys.stderr)
        return 2
    try:
        trials = {name: _read(config) for name, config in study.scenarios.items()}
    except TableError as error:
        path = trials_path(study.scenarios[error.experiment.rpartition("/")[2]])
        print(f"experiments.findings: {path} {error}", file=sys.stderr)
        return 1
    path = findings_path(study)
    table = findings(trials, study.scenarios).to_csv(index=False, lineterminator="\n")
    try:
        write_files({path: table.encode()})
    except OSError as error:
        print(f"experiments.findings: cannot write {path}: {error.strerror}", file=sys.stderr)
        return 1
    print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
