"""Whether the paper's claims hold: ``python -m experiments.verdicts``.

Every statistic is computed in each of R replicate studies. `ours` is its mean, `low` and `high`
enclose the central 95 % of the replicates: the spread that a single study has, of which the paper's
number is one draw.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t as students_t

from .claims import Claim, Claims, load_claims, split_replicates
from .command import run_command
from .config import Config, load
from .replicate import FIRST, KEYS, Trials, plan, replicate_path, rows
from .statistics import STATISTICS, cell_means, select
from .tables import TableError, check_settings, read_csv, to_csv, write_files

__all__ = ["decide", "evaluate_claim", "main", "read_replicates", "verdict"]

CENTRAL = (0.025, 0.975)
REPRODUCED, NOT_REPRODUCED, INCONCLUSIVE = "reproduced", "not reproduced", "inconclusive"

Replicate = Mapping[Trials, pd.DataFrame]  # tables of trials


def evaluate_claim(claim: Claim, trials: pd.DataFrame) -> float:
    """Compute the statistic of a claim from trials of its experiment."""
    trials = select(trials, claim.where)
    if claim.of_means:
        trials = cell_means(trials)
    statistic = STATISTICS[claim.statistic]
    settings = {key: getattr(claim, key) for key in statistic.needs}
    metrics = claim.metrics if claim.is_difference else (claim.metric,)
    value, *others = [statistic.function(trials, metric, **settings) for metric in metrics]
    return value - sum(others)


def verdict(claim: Claim, values: NDArray[np.float64]) -> str:
    """Tell whether a claim holds, from its statistic in each replicate.

    Parameters
    ----------
    claim : Claim
        What is claimed.
    values : (R,) ndarray
        The statistic in each replicate study.

    Returns
    -------
    str
        For a number of the paper, which is rounded to whole per cents:

        - "inconclusive" where the central 95 % hold both this number and 0, so that not even the
          direction of the change is certain;
        - "reproduced" where they hold this number;
        - "not reproduced" where they do not, and where one more study would also hardly give it: it
          is outside of the 95 % prediction interval ``mean ± t sd sqrt(1 + 1/R)``;
        - "inconclusive" otherwise: R is too small to tell.

        For a criterion: "reproduced" where the central 95 % meet it, "not reproduced" where no
        value within them does, "inconclusive" where some do.
    """
    if not np.isfinite(values).all():
        return INCONCLUSIVE
    low, high = np.quantile(values, CENTRAL)
    if claim.paper is None:
        met = [_meets(claim, bound) for bound in (low, high)]
        if all(met):
            return REPRODUCED
        relation, number = claim.bound
        between = relation == "within" and low < -number and high > number
        return INCONCLUSIVE if any(met) or between else NOT_REPRODUCED
    lowest, highest = claim.interval
    if lowest <= high and low <= highest:
        return INCONCLUSIVE if low <= 0 <= high else REPRODUCED
    n = len(values)
    reach = students_t.ppf(CENTRAL[1], n - 1) * values.std(ddof=1) * np.sqrt(1 + 1 / n)
    predicted = lowest <= values.mean() + reach and values.mean() - reach <= highest
    return INCONCLUSIVE if predicted else NOT_REPRODUCED


def _meets(claim: Claim, value: float) -> bool:
    relation, number = claim.bound
    if relation == "at least":
        return value >= number
    return value < number if relation == "below" else abs(value) <= number


def decide(claims: Claims, replicates: Sequence[Replicate]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Give every claim its verdict.

    Parameters
    ----------
    claims : Claims
        What is claimed.
    replicates : sequence of mappings
        The tables of trials of each replicate study.

    Returns
    -------
    claims : DataFrame
        One row a claim: `id, source, figure, statement, statistic, criterion, paper, ours, low,
        high, replicates, verdict`, and for ranges what the other meaning of range would give:
        `ours_of_means, low_of_means, high_of_means, verdict_of_means`. Percentages in per cent.
    decisions : DataFrame
        One row for each claim under each reading of what the paper leaves open.
    """
    rows = [_row(claim, replicates) for claim in claims.claims.values()]
    evidence = []
    for decision in claims.decisions:
        texts = {"question": decision.question, "paper_says": decision.paper}
        texts |= {"choice": decision.choice}
        for reading in decision.readings:
            for name in decision.claims:
                claim = reading.of(claims.claims[name])
                row = {"decision": decision.id, **texts, "reading": reading.reading}
                evidence.append(row | {"claim": name} | _decided(claim, replicates))
    return pd.DataFrame(rows), pd.DataFrame(evidence)


def _row(claim: Claim, replicates: Sequence[Replicate]) -> dict[str, object]:
    row: dict[str, object] = {
        "id": claim.id,
        "source": claim.source,
        "figure": claim.figure,
        "statement": claim.statement,
        "statistic": claim.describe(),
    }
    row |= _decided(claim, replicates)
    if claim.has_ranges:
        other = _decided(replace(claim, of_means=True), replicates)
        row |= {f"{key}_of_means": other[key] for key in ("ours", "low", "high", "verdict")}
    return row


def _decided(claim: Claim, replicates: Sequence[Replicate]) -> dict[str, object]:
    values = np.array([evaluate_claim(claim, trials[claim.trials]) for trials in replicates])
    digits = 2 if claim.is_percentage else 3
    low, high = np.quantile(values, CENTRAL)
    return {
        "criterion": claim.criterion or "the paper's number",
        "paper": claim.paper,
        "ours": round(float(values.mean()), digits),
        "low": round(float(low), digits),
        "high": round(float(high), digits),
        "replicates": len(values),
        "verdict": verdict(claim, values),
    }


def read_replicates(
    claims: Claims, config: Config, overrides: Sequence[str] = ()
) -> list[Replicate]:
    """Read the tables of all replicate studies, which were run with these settings.

    Raises
    ------
    TableError
        Where one is missing, or has other trials than it should or was made under other settings,
        with the command that makes it.
    """
    expected = rows(plan(claims, overrides))
    return [
        _read(
            replace(config, replicate=number),
            expected.assign(replicate=number),
            ["experiments.replicate", *overrides, f"replicate={number}"],
        )
        for number in range(claims.replicates)
    ]


def _read(config: Config, expected: pd.DataFrame, command: Sequence[str]) -> Replicate:
    path = replicate_path(config)
    table = read_csv(path, command, keep_default_na=False, na_values=[""], dtype={"settings": str})
    missing = [column for column in expected if column not in table]
    if missing:
        raise TableError(path, f"has no column {missing[0]}", command)
    table["settings"] = table["settings"].fillna("")
    if len(table) != len(expected):
        problem = f"has {len(table)} trials, not the {len(expected)} that the claims need"
        raise TableError(path, problem, command)
    for key, wanted in expected.items():
        found = table[key] if key in KEYS else table[key].notna()
        if list(found) != list(wanted):
            raise TableError(path, f"has other trials than the claims need: see {key}", command)
    check_settings(config, path, command)
    return {
        (str(experiment), tuple(str(settings).split())): group
        for (experiment, settings), group in table.groupby(["experiment", "settings"], sort=False)
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/claims.csv`` and ``tables/decisions.csv``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.verdicts",
        description="Give each claim of the paper a verdict, from the replicate studies.",
        epilog="settings are those of python -m experiments.replicate; and replicates=20",
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[object]:
    replicates, overrides = split_replicates(options.overrides)
    claims = load_claims(replicates)
    config = load([f"experiment={FIRST}", *overrides])
    table, decisions = decide(claims, read_replicates(claims, config, overrides))
    results = Path(config.results_dir)
    files = {results / "claims.csv": table, results / "tables" / "decisions.csv": decisions}
    write_files({path: to_csv(content) for path, content in files.items()})
    counts = table["verdict"].value_counts()
    return [*files, ", ".join(f"{count} {name}" for name, count in counts.items())]


if __name__ == "__main__":
    sys.exit(main())
