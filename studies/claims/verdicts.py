"""Whether the paper's claims hold, from the replicate studies.

Every statistic is computed in each of R replicate studies. `ours` is its mean, `low` and `high`
enclose the central 95 % of the replicates: the spread that a single study has, of which the paper's
number is one draw.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t as students_t

from experiments.command import CommandError, ConfigError
from experiments.config import Sweep
from experiments.grid import evaluations
from experiments.tables import Record, TableError, Trials

from ..statistics import STATISTICS, cell_means, select
from .claims import Claim, Claims
from .plan import needed_cells

__all__ = ["CENTRAL", "INCONCLUSIVE", "NOT_REPRODUCED", "REPRODUCED", "VERDICTS"]
__all__ += ["check_alike", "decide", "evaluate_claim", "select_trials", "verdict"]

CENTRAL = (0.025, 0.975)
REPRODUCED, NOT_REPRODUCED, INCONCLUSIVE = "reproduced", "not reproduced", "inconclusive"
VERDICTS = (NOT_REPRODUCED, INCONCLUSIVE, REPRODUCED)

Replicate = Mapping[tuple[str, tuple[str, ...]], pd.DataFrame]  # by `Claim.trials`


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


def select_trials(claims: Claims, trials: Trials) -> Replicate:
    """Return the trials of a replicate study by experiment and settings.

    Raises
    ------
    TableError
        Where the table does not have what the claims need.
    """
    sweeps = {(sweep.name, tuple(sweep.differs.split())): sweep for sweep in trials.record.sweeps}
    for claim in claims:
        if claim.trials not in sweeps:
            raise TableError(trials.path, f"has no trials for the claim {claim.id!r}")
        sweep = sweeps[claim.trials]
        try:
            needed = needed_cells(claim, sweep)
        except ConfigError as error:
            raise TableError(trials.path, f"cannot decide the claims: {error}") from None
        evaluated = evaluations(sweep)
        if any(set(claim.metrics) - set(evaluated.get(cell, ())) for cell in needed):
            raise TableError(trials.path, f"lacks trials for the claim {claim.id!r}")
    groups = trials.table.groupby(["experiment", "settings"], sort=False)
    tables = {(str(name), tuple(str(differs).split())): rows for (name, differs), rows in groups}
    for key, sweep in sweeps.items():
        if _lacks_values(tables[key], sweep):
            raise TableError(trials.path, f"lacks values in trials of {sweep.name}")
    return tables


def _lacks_values(trials: pd.DataFrame, sweep: Sweep) -> bool:
    """Tell whether a metric is empty in a trial that it was evaluated in."""
    rows = [dict.fromkeys(metrics, 1) for metrics in evaluations(sweep).values()]
    evaluated = pd.DataFrame(rows).notna().loc[np.repeat(range(len(rows)), sweep.trials)]
    empty = trials[evaluated.columns].isna().to_numpy()
    return bool((empty & evaluated.to_numpy()).any())


def check_alike(paths: Sequence[Path], records: Sequence[Record]) -> None:
    """Make sure that replicate studies differ in their number alone.

    Parameters
    ----------
    paths : sequence of Path
        Their tables.
    records : sequence of Record
        What each rests on.

    Raises
    ------
    TableError, CommandError
        Where there are fewer than two, or one has other settings than the first.
    """
    if len(records) < 2:
        raise CommandError(
            "verdicts take at least two replicate studies: the spread is between them"
        )
    first = [replace(sweep, replicate=0) for sweep in records[0].sweeps]
    for number, (path, record) in enumerate(zip(paths, records, strict=True)):
        if [replace(sweep, replicate=0) for sweep in record.sweeps] != first:
            raise TableError(path, f"has other settings than {paths[0]}")
        if {sweep.replicate for sweep in record.sweeps} != {number}:
            raise TableError(path, f"is not replicate {number}")
