"""Tables computed from the runs by pandas: complete values, means, pairs of systems, ranks."""

import math
from collections.abc import Hashable, Mapping, Sequence
from functools import cache
from itertools import combinations
from typing import Any, Literal

import numpy as np
import pandas as pd
import scipy

from ..arrays import Floats
from ..metrics import metric
from ..texts import brief, first_few, printable
from . import statistics
from .statistics import LEVEL, MIN_RUNS, MIN_SEQUENCES, Test

__all__ = [
    "DEPENDENT",
    "PAIRED",
    "SINGLE",
    "WITHIN",
    "Better",
    "Design",
    "best_means",
    "checked_runs",
    "common_sequences",
    "completed",
]
__all__ += [
    "compare_systems",
    "larger_is_better",
    "metric_columns",
    "pairs_of",
    "records",
    "summarise",
]
__all__ += ["values_of"]

Better = Literal["larger", "smaller"]
Design = Literal["independent", "dependent", "paired"]  # what runs of the same name have in common

KEYS = ["sequence", "system", "run"]
WITHIN = "permutation within sequences"
DEPENDENT = "permutation of runs"
PAIRED = "signed ranks of paired runs"
SINGLE = "signed ranks of sequences"
STATUSES = ["scored", "failed", "missing", "copy"]
MAX_NEEDED = 50  # runs, or sequences, up to which the verdict says how many are needed


def checked_runs(runs: pd.DataFrame, by: str) -> pd.DataFrame:
    """Return a table of runs with all columns that the comparison takes.

    It needs the columns ``system`` and `by`. Without ``sequence`` there is one sequence, without
    ``run`` they are numbered, and without ``status`` a run without a value has failed.
    """
    runs = runs.reset_index(drop=True).copy()
    for name in ("system", by):
        if name not in runs:
            raise ValueError(f"the table of runs has no column {brief(name)}")
    if runs.empty:
        raise ValueError("the table of runs has no row")
    if "sequence" not in runs:
        runs["sequence"] = "sequence"
    if "run" not in runs:
        runs["run"] = runs.groupby(["sequence", "system"]).cumcount() + 1
    for name in KEYS:
        if runs[name].isna().any():
            row = int(np.flatnonzero(runs[name].isna())[0])
            raise ValueError(f"row {row} of the table of runs has no {name}")
        runs[name] = [printable(str(value)) for value in runs[name]]
    twice = runs[runs.duplicated(KEYS)]
    if len(twice):
        key = first_few(["/".join(row) for row in twice[KEYS].to_numpy()])
        raise ValueError(f"rows of the table of runs are for the same run: {key}")
    return _with_values(runs, by)


def _with_values(runs: pd.DataFrame, by: str) -> pd.DataFrame:
    """Return a table of runs with numbers for metrics, and texts where it has no column."""
    for name in metric_columns(runs, by):
        try:
            runs[name] = pd.to_numeric(runs[name]).astype(float)
        except (TypeError, ValueError):
            raise ValueError(f"column {brief(name)} of the table of runs is not numeric") from None
    for name in ("lost", "unit"):  # which may be something else in a user's own table
        values = runs[name] if name in runs else pd.Series(math.nan, runs.index)
        runs[name] = pd.to_numeric(values, errors="coerce").astype(float)
    if "status" not in runs:
        runs["status"] = np.where(runs[by].isna(), "failed", "scored")
    if not runs["status"].isin(STATUSES).all():
        raise ValueError(f"status in the table of runs must be one of {', '.join(STATUSES)}")
    for name in ("file", "error", "notes", "hints", "low_score", "settings"):
        texts = runs[name] if name in runs else [""] * len(runs)
        runs[name] = ["" if pd.isna(text) else printable(str(text)) for text in texts]
    if "reference_rotations" not in runs:
        runs["reference_rotations"] = False
    return runs


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table."""
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def metric_columns(runs: pd.DataFrame, by: str) -> list[str]:
    """Return the columns that are metrics: those that this package knows, and `by`."""
    return [str(name) for name in runs if name == by or _is_known(name)]


@cache
def _is_known(name: Hashable) -> bool:
    try:
        return metric(str(name)).name == name
    except ValueError:
        return False


def larger_is_better(name: str, better: Better | None = None) -> bool:
    """Return whether larger values of a metric are better; of unknown ones `better` says it."""
    if better not in (None, "larger", "smaller"):
        raise ValueError(f"better must be larger or smaller, not {brief(better)}")
    if _is_known(name):
        if better and (better == "larger") != metric(name).larger_is_better:
            raise ValueError(f"better must not be {better} for {name}")
        return metric(name).larger_is_better
    if better is None:
        raise ValueError(f"unknown metric {name}: set better to larger or smaller")
    return better == "larger"


def completed(runs: pd.DataFrame, by: str, better: Better | None = None) -> pd.DataFrame:
    """Return the runs without copies; a value that a run lacks is the worst one.

    So a system gains nothing by leaving out what is bad. Values stay unknown of a system that never
    has any, and on a sequence where no run can have any: where no scored one does, unless it only
    takes rotations, which the reference has.
    """
    runs = runs[runs["status"] != "copy"].copy()
    scored = runs["status"] == "scored"
    system, sequence = runs["system"], runs["sequence"]
    none_scored = ~scored.groupby(system).transform("any")
    for name in metric_columns(runs, by):
        is_known, larger = _is_known(name), larger_is_better(name, better if name == by else None)
        valued = scored & runs[name].notna()
        expected = valued.groupby(sequence).transform("any")
        expected |= ~scored.groupby(sequence).transform("any")
        if is_known and "rotations" in metric(name).needs:
            expected |= runs["reference_rotations"].astype(bool)
        expected &= valued.groupby(system).transform("any") | none_scored
        runs.loc[~valued, name] = math.nan
        runs.loc[expected & ~valued, name] = (
            metric(name).worst if is_known else -math.inf if larger else math.inf
        )
    return runs


def common_sequences(runs: pd.DataFrame) -> list[str]:
    """Return the sequences on which all systems were run."""
    n_systems = runs.groupby("sequence", sort=False)["system"].nunique()
    return [str(name) for name in n_systems.index[n_systems == runs["system"].nunique()]]


def summarise(runs: pd.DataFrame, by: str, larger: bool, pairs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each system and sequence, and one over all (sequence None).

    Means are over runs, and over all also over the sequences that every system was run on; the
    columns ``..._all`` are over all sequences of the system, ``..._scored`` over the runs that did
    not fail, ``..._sd`` the standard deviation of the runs on a sequence (over all: the root mean
    square of these). Systems come in the order of their ranks, then of their means.
    """
    names = metric_columns(runs, by)
    keys = ["system", "sequence"]
    values = runs.set_index(keys)[list(dict.fromkeys([*names, "lost"]))]
    scored, finite = values[runs["status"].eq("scored").values], values.where(np.isfinite(values))
    means = values.groupby(keys, sort=False).mean()
    scored_means = scored.groupby(keys, sort=False).mean().reindex(means.index)
    deviations = finite.groupby(keys, sort=False).std().where(np.isfinite(means))
    common = common_sequences(runs)
    ranks = {name: _ranks(_on(pairs, name)) for name in [None, *runs["sequence"].unique()]}
    rows = []
    for (system, sequence), group in [
        *(((system, None), group) for system, group in runs.groupby("system", sort=False)),
        *runs.groupby(keys, sort=False),
    ]:
        mean, deviation, scored_mean = (
            table.loc[system] for table in (means, deviations, scored_means)
        )
        chosen = mean.index.isin(common) if sequence is None else mean.index == sequence
        failed = int((group["status"] != "scored").sum())
        low, high = scipy.stats.binomtest(failed, len(group)).proportion_ci(1 - LEVEL)
        units = group["unit"].dropna()
        row = {
            "system": system,
            "sequence": sequence,
            "sequences": len(mean) if sequence is None else 1,
            "runs": len(group),
            "failed": failed,
            "failing_low": low,
            "failing_high": high,
            "unit": units.iloc[0] if sequence is not None and len(units) else math.nan,
            "lost": mean.loc[chosen, "lost"].mean(),
            "lost_all": mean["lost"].mean() if sequence is None else math.nan,
        }
        best, worst = ranks[sequence].get(system, (math.nan, math.nan))
        row |= {"rank_best": best, "rank_worst": worst}
        for name in names:
            row[name] = mean.loc[chosen, name].mean()
            row[f"{name}_sd"] = np.sqrt((deviation.loc[chosen, name] ** 2).mean(skipna=False))
            row[f"{name}_scored"] = scored_mean.loc[chosen, name].mean()
            row[f"{name}_all"] = mean[name].mean() if sequence is None else row[name]
        rows.append(row)
    table = pd.DataFrame(rows)
    overall = table[table["sequence"].isna()].copy()
    columns = [by, f"{by}_scored", f"{by}_all"]
    overall[columns] *= -1 if larger else 1
    overall = overall.sort_values(["rank_best", "rank_worst", *columns, "system"], kind="stable")
    position = {system: index for index, system in enumerate(overall["system"])}
    return table.sort_values(
        "system", key=lambda names: names.map(position), kind="stable", ignore_index=True
    )


def best_means(means: "pd.Series[float]", larger: bool) -> "pd.Series[bool]":
    """Return which means are the best; none where no other one is worse."""
    order = (means if larger else -means).astype(float)
    best = order.max()
    is_best = pd.Series(np.isclose(order, best, rtol=1e-9, atol=0), means.index)
    return is_best & bool((order[~is_best] < best).any()) & np.isfinite(order)


def _on(pairs: pd.DataFrame, sequence: str | None) -> pd.DataFrame:
    """Return the pairs on a sequence, or over all."""
    return pairs[pairs["sequence"].isna() if sequence is None else pairs["sequence"] == sequence]


def _ranks(pairs: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """Return one more than the number of systems ahead, and the number of those not behind.

    Systems that are in no test have no rank, and do not count.
    """
    tested = pairs[pairs["p"].notna()]
    systems = pd.unique(tested[["a", "b"]].to_numpy().ravel())
    decided = tested[tested["better"].notna()]
    worse = decided["a"].where(decided["better"] == decided["b"], decided["b"])
    n_behind = decided["better"].value_counts().reindex(systems, fill_value=0)
    n_ahead = worse.value_counts().reindex(systems, fill_value=0)
    return {
        str(system): (1 + int(n_ahead[system]), len(systems) - int(n_behind[system]))
        for system in systems
    }


def pairs_of(
    runs: pd.DataFrame,
    by: str,
    larger: bool,
    design: Design = "independent",
    sequences: Sequence[str | None] = (None,),
) -> pd.DataFrame:
    """Compare all pairs of systems by a metric on some sequences, or over all (None).

    Returns
    -------
    DataFrame
        A row a pair, for each of the sequences:

        - `a, b, sequence, metric`
        - `sequences`: how many both were run on
        - `wins`: P(A beats B)
        - `difference, low, high`: of the means, with its interval of 95 %
        - `method`: of the test
        - `p_raw, p`: two-sided p-value, and adjusted for the false discovery rate over all pairs
          with this `sequence`; too few runs have no `p`
        - `better`: the system that is significantly ahead
        - `needed`: how many runs or sequences are needed where no result could be significant
        - `p_like_these, better_like_these`: for sequences like these, from six sequences on
    """
    values = values_of(runs, by, larger)
    compared_pairs = []
    for sequence in sequences:
        chosen = values
        if sequence is not None:
            chosen = {
                a: {sequence: of_a[sequence]} for a, of_a in values.items() if sequence in of_a
            }
        rows = [
            {"a": a, "b": b, "sequence": sequence, "metric": by} | row
            for a, b in combinations(chosen, 2)
            if (row := compare_systems(chosen[a], chosen[b], design))
        ]
        compared_pairs.append(_pair_table(rows))
    return pd.concat(compared_pairs, ignore_index=True)


Values = Mapping[str, Mapping[str, pd.DataFrame]]  # by system and sequence


def values_of(runs: pd.DataFrame, by: str, larger: bool) -> Values:
    """Return the values of each system and sequence by run, and in `order`, larger ones better."""
    runs = runs[runs[by].notna()]
    order = (runs[by] if larger else -runs[by]).where(runs["status"] == "scored", -np.inf)
    table = pd.DataFrame({"value": runs[by], "order": order, **runs[KEYS]}).set_index("run")
    return {
        str(system): {str(name): part for name, part in group.groupby("sequence", sort=False)}
        for system, group in table.groupby("system", sort=False)
    }


def compare_systems(
    a: Mapping[str, pd.DataFrame], b: Mapping[str, pd.DataFrame], design: Design
) -> dict[str, Any]:
    """Compare two systems on the sequences that both were run on; without any, return no row.

    Sequences with several runs of each are the better evidence: where there are any, others are
    left out.
    """
    tables = [(a[name], b[name]) for name in a if name in b]
    if design == "paired":
        pairs = [(x, y, x.index.intersection(y.index)) for x, y in tables]
        tables = [(x.loc[names], y.loc[names]) for x, y, names in pairs if len(names)]
    elif repeated := [pair for pair in tables if min(map(len, pair)) > 1]:
        tables = repeated
    if not tables:
        return {}
    runs, values = (
        [(x[name].to_numpy(float), y[name].to_numpy(float)) for x, y in tables]
        for name in ("order", "value")
    )
    tested = runs
    if design == "paired":
        method, test = PAIRED, statistics.paired_test(runs)
    elif min(min(map(len, pair)) for pair in runs) < 2:
        method, test = SINGLE, statistics.sequence_test(runs)
    elif design == "dependent":
        method, tested = DEPENDENT, _recurring_runs(tables)
        test = statistics.permutation_test(tested, dependent=True) if tested else UNTESTED
    else:
        method, test = WITHIN, statistics.permutation_test(runs)
    difference = statistics.difference(values, design == "paired")
    like_these = statistics.sequence_test(runs) if len(runs) >= MIN_SEQUENCES else UNTESTED
    return {
        "sequences": len(runs),
        "wins": statistics.win_probability(runs, design == "paired"),
        "mean_a": float(np.mean([x.mean() for x, _ in values])),
        "mean_b": float(np.mean([y.mean() for _, y in values])),
        "difference": difference.value,
        "low": difference.low,
        "high": difference.high,
        "method": method,
        "runs_a": min(len(x) for x, _ in tested) if tested else 0,
        "runs_b": min(len(y) for _, y in tested) if tested else 0,
        "test": test,
        "like_these": like_these,
    }


UNTESTED = Test(math.nan, math.nan, math.nan, possible=False)


def _recurring_runs(
    tables: Sequence[tuple[pd.DataFrame, pd.DataFrame]],
) -> list[tuple[Floats, Floats]]:
    """Return the runs that each system has on all sequences, in the same order on each."""
    first, second = (
        pd.concat([table["order"] for table in of_system], axis="columns", join="inner")
        for of_system in zip(*tables, strict=True)
    )
    if min(len(first), len(second)) < 2:
        return []
    return list(zip(first.to_numpy(float).T, second.to_numpy(float).T, strict=True))


def _pair_table(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return the pairs of a table with adjusted p-values, and who is ahead by them."""
    columns = ["a", "b", "sequence", "metric", "sequences", "wins", "mean_a", "mean_b"]
    columns += ["difference", "low", "high", "method", "runs_a", "runs_b", "test", "like_these"]
    pairs = pd.DataFrame(rows, columns=columns)
    pairs["p_raw"] = pairs["test"].map(lambda test: test.p).astype(float)
    pairs["p"], pairs["better"] = _significant(pairs, pairs["test"])
    pairs["needed"] = [_needed(pairs, row) for row in range(len(pairs))]
    of_sequences = _significant(pairs, pairs["like_these"])
    pairs["p_like_these"], pairs["better_like_these"] = of_sequences
    return pairs.drop(columns=["test", "like_these"])


def _significant(pairs: pd.DataFrame, tests: "pd.Series[Any]") -> tuple[Floats, "pd.Series[Any]"]:
    """Return p-values adjusted over all pairs, and the system that is significantly ahead."""
    p = statistics.false_discovery([test.p if test.possible else math.nan for test in tests])
    a_wins = pd.Series([test.better < test.worse for test in tests], pairs.index, dtype=bool)
    ahead = pairs["a"].where(a_wins, pairs["b"])
    return p, ahead.astype(object).where(p <= LEVEL, None)


def _needed(pairs: pd.DataFrame, row: int) -> str:
    """Return how many runs are needed where no result of a pair could be significant.

    The other pairs of the table keep their results.
    """
    pair = pairs.iloc[row]
    if pair["p"] <= LEVEL:
        return ""
    tested = pairs["p"].notna().to_numpy()
    raw = np.where(tested, pairs["p_raw"], np.nan)

    def can_be_significant(smallest: float) -> bool:
        p = raw.copy()
        p[row] = min(1.0, 2 * smallest)
        return bool(statistics.false_discovery(p)[row] <= LEVEL)

    if tested[row] and can_be_significant(pair["test"].smallest):
        return ""
    floor = 1 / (statistics.N_PERMUTATIONS + 1)
    signed_ranks = pair["method"] in (SINGLE, PAIRED)
    blocks = 1 if pair["method"] == DEPENDENT else pair["sequences"]
    what = {SINGLE: "sequences", PAIRED: "pairs of runs"}.get(pair["method"], "runs each")
    for n in range(2, MAX_NEEDED + 1):
        enough = n >= MIN_SEQUENCES if signed_ranks else n * blocks >= MIN_RUNS
        smallest = 0.5**n if signed_ranks else math.comb(2 * n, n) ** -float(blocks)
        if enough and can_be_significant(max(smallest, floor)):
            return f"{n} {what}"
    return f"more than {MAX_NEEDED} {what}"
