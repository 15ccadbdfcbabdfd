"""What the scenarios of a study show: ``python -m experiments.findings``.

A metric orders the noise levels of a scenario where it gets worse with noise and Kendall's rank
correlation is at least 0.5 at every number of outliers; likewise for the numbers of outliers.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .command import run_command
from .config import Config
from .scenarios import BEYOND, Study, load_study
from .statistics import DISCERNS, power
from .tables import read_trials, to_csv, write_files

__all__ = ["DISCERNS", "LEVELS", "findings", "findings_path", "main"]

LEVELS = {"noise": "sigma_t", "outliers": "n_outliers"}
VERDICTS = ("orders noise and outliers", "orders noise", "orders outliers", "orders nothing")
GENERATORS = ("geometry", "error", "outliers", "outlier_side")
JUDGED = ("TAS", "RAS", "PAS")  # whose failures are told
NEAR_ZERO = 0.1  # a score that has so little left


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
    verdict = f"orders {' and '.join(ordered) or 'nothing'}"
    return {
        "metric": metric,
        "noise_power": noise,
        "outlier_power": outliers,
        "mean": float(trials[metric].mean()),
        "verdict": verdict,
    }


def _power(trials: pd.DataFrame, metric: str, level: str) -> float:
    return power(trials, metric, [level], "smallest") if trials[level].nunique() > 1 else np.nan


def _sentences(trials: pd.DataFrame, judged: Sequence[Mapping[str, Any]]) -> list[str]:
    ours = [row for row in judged if row["metric"] in JUDGED]
    found = [_who_orders_what(judged), *map(_failure, ours), _near_zero(trials, ours)]
    found += [_no_worse(trials, row["metric"]) for row in ours]
    return [sentence for sentence in found if sentence]


def _who_orders_what(judged: Sequence[Mapping[str, Any]]) -> str:
    parts = []
    for verdict in VERDICTS:
        metrics = [row["metric"] for row in judged if row["verdict"] == verdict]
        what = verdict.removeprefix("orders ")
        if metrics:
            parts.append(f"{_names(metrics)} {'order' if metrics[1:] else 'orders'} {what}")
    return f"{'; '.join(parts)}."


def _failure(row: Mapping[str, Any]) -> str:
    columns = zip(LEVELS, (row["noise_power"], row["outlier_power"]), strict=True)
    failures = [f"{level} (tau {power:.2f})" for level, power in columns if power < DISCERNS]
    return f"{row['metric']} fails on {_names(failures)}." if failures else ""


def _near_zero(trials: pd.DataFrame, ours: Sequence[Mapping[str, Any]]) -> str:
    """Tell which scores have nothing left for outliers to take away."""
    strongest = trials[trials["sigma_t"] == trials["sigma_t"].max()]
    fewest = strongest["n_outliers"].min()
    means = strongest[strongest["n_outliers"] == fewest].mean(numeric_only=True)
    low = [row["metric"] for row in ours if means[row["metric"]] < NEAR_ZERO]
    low = [f"{metric} ({means[metric]:.2f})" for metric in low]
    if not low:
        return ""
    be = "are" if low[1:] else "is"
    return f"At the strongest noise, with {fewest} outliers, {_names(low)} {be} near 0."


def _no_worse(trials: pd.DataFrame, metric: str) -> str:
    """Tell where the mean of a score does not fall as outliers are added."""
    means = trials.groupby("n_outliers")[metric].mean()
    pairs = [(means[more] - means[few], few, more) for few, more in combinations(means.index, 2)]
    rise, few, more = max(pairs, default=(-1.0, 0, 0))
    if rise < 0:
        return ""
    return (
        f"{metric} is no worse with {more} outliers than with {few} "
        f"(mean {means[more]:.2f} and {means[few]:.2f})."
    )


def _names(names: Sequence[str]) -> str:
    return " and ".join([part for part in (", ".join(names[:-1]), names[-1]) if part])


def findings_path(study: Study) -> Path:
    """Return the path of the table of a study's findings."""
    return Path(study.results_dir) / "tables" / f"{study.name}.csv"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/tables/<study>.csv``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.findings",
        description="Tell what the scenarios show, from their tables of trials.",
        epilog="settings are those that the scenarios were run with",
    )
    parser.add_argument("--scenarios", type=Path, default=BEYOND, metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    study = load_study(options.scenarios, options.overrides)
    file = [] if options.scenarios == BEYOND else ["--scenarios", str(options.scenarios)]
    trials = {
        name: read_trials(config, None, ["experiments.scenarios", name, *file, *options.overrides])
        for name, config in study.scenarios.items()
    }
    path = findings_path(study)
    write_files({path: to_csv(findings(trials, study.scenarios))})
    return [path]


if __name__ == "__main__":
    sys.exit(main())
