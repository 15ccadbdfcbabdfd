"""Whether the paper's claims hold, from the replicate studies.

The central 95 % of these are the spread of a single study (`verdict`); the confidence interval of
their mean shows what is true of the mean of all studies of this size (`population`). The statistic
of the trials of all replicates together is `pooled`: a range grows with the number of trials.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import starmap

import numpy as np
import pandas as pd
import scipy
from joblib import Parallel, delayed

from alignscores.arrays import Floats
from alignscores.comparison.statistics import LEVEL, holm
from experiments.grid import CELL_SETTINGS
from experiments.tables import Trials

from ..statistics import cell_means, select
from .claims import Claim, Claims, Decision, Reading

CENTRAL = (LEVEL / 2, 1 - LEVEL / 2)
REPRODUCED, NOT_REPRODUCED, INCONCLUSIVE = "reproduced", "not reproduced", "inconclusive"
VERDICTS = (NOT_REPRODUCED, INCONCLUSIVE, REPRODUCED)
TRUE, FALSE, OPEN = "true", "false", "open"
TRUTHS = (FALSE, OPEN, TRUE)

Read = tuple[Decision, Reading, Mapping[str, Claim]]  # a reading with the claims that it changes
Replicate = Mapping[tuple[str, tuple[str, ...]], pd.DataFrame]  # by `Claim.trials`


def evaluate_claim(claim: Claim, trials: pd.DataFrame) -> float:
    """Compute the statistic of a claim from trials of its experiment."""
    needed = trials.filter([*CELL_SETTINGS, *claim.metrics])  # whole tables take twice the time
    trials = select(needed, claim.where)
    if claim.of_means:
        trials = cell_means(trials)
    settings = {key: getattr(claim, key) for key in claim.rule.keys}
    metrics = claim.metrics if claim.is_difference else (claim.metric,)
    value, *others = [claim.rule.function(trials, metric, **settings) for metric in metrics]
    return value - sum(others)


def verdict(claim: Claim, values: Floats) -> str:
    """Return whether one study would show a claim, from its statistic in each replicate.

    A number of the paper, rounded to whole per cents, is "reproduced" where the central 95 % hold
    it, unless they are wider than the number itself: then it is "inconclusive". It is "not
    reproduced" where they do not hold it and it is outside of the prediction interval ``mean ± t sd
    sqrt(1 + 1/R)``, too. A criterion is "reproduced" where they meet it, "not reproduced" where no
    value within them does.
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
        return INCONCLUSIVE if high - low > abs(claim.paper) else REPRODUCED
    reach = _reach(values, 1 + 1 / len(values))
    predicted = lowest <= values.mean() + reach and values.mean() - reach <= highest
    return INCONCLUSIVE if predicted else NOT_REPRODUCED


def _meets(claim: Claim, value: float) -> bool:
    lowest, highest = claim.interval
    return lowest <= value <= highest and (claim.bound[0] != "below" or value < highest)


def populations(claims: Sequence[Claim], values: Sequence[Floats]) -> list[str]:
    """Return whether claims are true of the mean over all studies of this size.

    "true" where the mean certainly meets the criterion (for a number of the paper: rounds to it),
    "false" where it certainly does not, "open" otherwise: by Student's t-test, adjusted for the
    number of claims by Holm's method.
    """
    tests = list(map(_test, claims, values))
    certain = holm([p for _, p in tests]) <= LEVEL
    words = {True: TRUE, False: FALSE}
    return [words[meets] if sure else OPEN for (meets, _), sure in zip(tests, certain, strict=True)]


def _test(claim: Claim, values: Floats) -> tuple[bool, float]:
    """Return whether the mean meets a claim, and the p-value against the contrary."""
    if not np.isfinite(values).all():
        return False, np.nan
    mean, error = float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values)))
    lowest, highest = claim.interval
    if error == 0:
        return _meets(claim, mean), 0.0
    inside = min(mean - lowest, highest - mean)  # negative outside: how far
    return _meets(claim, mean), float(2 * scipy.stats.t.sf(abs(inside) / error, len(values) - 1))


def _reach(values: Floats, share: float) -> float:
    """Return how far the 95 % interval of what has a share of the variance reaches."""
    error = np.sqrt(share * values.var(ddof=1))
    return float(scipy.stats.t.ppf(CENTRAL[1], len(values) - 1) * error)


def decide(
    claims: Claims, replicates: Sequence[Replicate], *, n_jobs: int = 1
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Give every claim its verdicts, from the tables of trials of each replicate study.

    Returns
    -------
    claims : DataFrame
        One row a claim: `id, source, figure, sentence` (the statement that it is a part of),
        `statement, unit, statistic, implied_by` (claims that it follows from), `criterion, paper,
        ours, low, high, replicates, verdict, mean_low, mean_high, population, pooled` (from the
        trials of all replicates together).
    readings : DataFrame
        One row for each claim that another reading of the paper changes: `decision, question,
        paper_says, choice, reading, claim`, and from `criterion` to `population` as above, from the
        first `replicates` studies.
    criteria : DataFrame
        One row for each other bound of a criterion, from all replicates: `word, bound, other`, how
        many `claims` have the bound, how many of their verdicts are others then, `changed` and
        `population_changed`, and `changes`: the former, with what they are.
    """
    originals, readings = list(claims.claims.values()), list(claims.read())
    wanted = [(claim, claims.replicates) for claim in originals]
    for _, reading, changed in readings:
        wanted += [(claim, claims.n_studies(reading)) for claim in changed.values()]
    tasks = [
        ([claim for claim, n in wanted if number < n], trials)
        for number, trials in enumerate(replicates)
    ]
    values: list[list[float]] = [[] for _ in wanted]
    for number, evaluated in enumerate(Parallel(n_jobs)(starmap(delayed(_evaluate), tasks))):
        deciding = [own for own, (_, n) in zip(values, wanted, strict=True) if number < n]
        for own, value in zip(deciding, evaluated, strict=True):
            own.append(value)
    arrays = iter(map(np.array, values))
    original_values = [next(arrays) for _ in originals]

    table = _decided(claims.claims, original_values)
    keys = ("id", "source", "figure", "sentence", "statement", "unit")
    texts = [
        {key: getattr(claim, key) for key in keys}
        | {"statistic": claim.describe(), "implied_by": " ".join(claim.implied_by) or None}
        for claim in originals
    ]
    pooled = {key: pd.concat(r[key] for r in replicates) for key in replicates[-1]}
    table["pooled"] = _evaluate(originals, pooled)
    return (
        pd.concat([pd.DataFrame(texts, index=table.index), table], axis=1).reset_index(drop=True),
        _read(readings, arrays),
        _by_other_criteria(claims, original_values),
    )


def _read(readings: Sequence[Read], values: Iterator[Floats]) -> pd.DataFrame:
    """Return the verdicts under other readings."""
    tables = [pd.DataFrame(columns=["decision", "question", "paper_says", "choice", "reading"])]
    for decision, reading, changed in readings:
        verdicts = _decided(changed, [next(values) for _ in changed])
        verdicts.insert(0, "claim", verdicts.index)
        texts = (decision.id, decision.question, decision.paper, decision.choice, reading.reading)
        for at, (name, text) in enumerate(zip(tables[0], texts, strict=True)):
            verdicts.insert(at, name, text)
        tables.append(verdicts)
    return pd.concat(tables, ignore_index=True) if readings else tables[0]


def statements(claims: pd.DataFrame) -> pd.DataFrame:
    """Return the verdict on each statement of the paper: the worst of the claims that it makes."""
    counted = claims[claims["implied_by"].isna()]
    rows = [
        {"source": source, "sentence": sentence, "claims": len(group)}
        | {"verdict": min(group["verdict"], key=VERDICTS.index)}
        | {"population": min(group["population"], key=TRUTHS.index)}
        for (source, sentence), group in counted.groupby(["source", "sentence"], sort=False)
    ]
    return pd.DataFrame(rows)


def _by_other_criteria(claims: Claims, values: Sequence[Floats]) -> pd.DataFrame:
    """Return which verdicts change with other bounds."""
    originals, both = claims.claims, ["verdict", "population"]
    before = _decided(originals, values)
    rows = []
    for criterion in claims.criteria:
        for other in criterion.others:
            changed = {name: criterion.replace(claim, other) for name, claim in originals.items()}
            names = [name for name, claim in changed.items() if claim != originals[name]]
            after = _decided(changed, values).loc[names]
            others = after[both] != before.loc[names, both]
            verdicts = after.loc[others["verdict"], "verdict"]
            row = {"word": criterion.word, "bound": criterion.bound, "other": other}
            row |= {"claims": len(names), "changed": len(verdicts)}
            row |= {"population_changed": others["population"].sum()}
            row["changes"] = "; ".join(f"{name}: {word}" for name, word in verdicts.items())
            rows.append(row)
    return pd.DataFrame(rows)


def _evaluate(claims: Sequence[Claim], trials: Replicate) -> list[float]:
    return [evaluate_claim(claim, trials[claim.trials]) for claim in claims]


def _decided(claims: Mapping[str, Claim], values: Sequence[Floats]) -> pd.DataFrame:
    words = populations(list(claims.values()), values)
    rows = []
    for claim, statistics, population in zip(claims.values(), values, words, strict=True):
        low, high = np.quantile(statistics, CENTRAL)
        mean, reach = statistics.mean(), _reach(statistics, 1 / len(statistics))
        rows.append(
            {
                "criterion": claim.criterion or "the paper's number",
                "paper": claim.paper,
                "ours": mean,
                "low": low,
                "high": high,
                "replicates": len(statistics),
                "verdict": verdict(claim, statistics),
                "mean_low": mean - reach,
                "mean_high": mean + reach,
                "population": population,
            }
        )
    return pd.DataFrame(rows, index=list(claims))


def select_trials(trials: Trials) -> Replicate:
    """Return the trials of a replicate by experiment and settings."""
    groups = trials.table.groupby(["experiment", "settings"], sort=False)
    return {(str(name), tuple(str(differs).split())): rows for (name, differs), rows in groups}
