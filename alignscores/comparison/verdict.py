"""The comparison in words: who is ahead of whom, who was not tested, how many runs are needed."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import scipy

from ..texts import alike, first_few, groups_alike
from .advice import advise_systems
from .runs import SEPARATOR
from .statistics import LEVEL, MIN_RUNS
from .summary import DEPENDENT, PAIRED, SINGLE, Design, best_means, common_sequences, records

__all__ = ["contrast_text", "difference_text", "left_out_sequences", "notes_on_runs", "p_text"]
__all__ += ["texts_by_run", "verdict"]


def verdict(
    runs: pd.DataFrame, by: str, larger: bool, overall: pd.DataFrame, pairs: pd.DataFrame
) -> list[str]:
    """Return sentences on the systems over all sequences."""
    scored = runs[runs["status"] == "scored"]
    if len(scored) and not scored[by].notna().any():
        if "TAS" in scored and scored["TAS"].notna().any():
            return [f"no run has a {by}, which needs rotations; --by TAS compares by positions"]
        return [f"no run has a {by}"]
    order = overall["system"].tolist()
    pairs = pairs[pairs["sequence"].isna()]
    positions = pairs[["a", "b"]].map(order.index)
    pairs = pairs.assign(first=positions.min(axis=1), second=positions.max(axis=1))
    pairs = pairs.sort_values(["first", "second"])
    tested = pairs[pairs["p"].notna()]
    lines, of_leader, leader = [], tested, ""
    if len(tested):
        leader = order[tested["first"].iloc[0]]
        of_leader = tested[(tested["a"] == leader) | (tested["b"] == leader)]
        lines = _on_leader(leader, of_leader, by, larger, pairs, runs["sequence"].nunique())
    if len(tested) > 1:
        n = int(tested["better"].notna().sum())
        lines.append(
            f"{n} of {len(tested)} pairs of systems differ significantly; at most "
            f"{100 * LEVEL:.0f} % of the differences that are called significant are expected to "
            "be false. The adjusted p of a pair depends a little on the other pairs."
        )
    best = overall["system"][best_means(overall[by], larger)].tolist()
    compared = {leader, *of_leader["a"], *of_leader["b"]}
    if len(best) == 1 and best[0] not in compared:
        mean = overall.loc[overall["system"] == best[0], by].item()
        n = len(common_sequences(runs))
        lines.append(
            f"{best[0]} has the {'highest' if larger else 'lowest'} mean {by} ({mean:.4g}, "
            f"{_counted(n, 'sequence')}), but too few runs for a test."
        )
    return [*lines, *_too_few_runs(pairs), *_without_value(runs, by), *_missing_sequences(runs, by)]


def p_text(p: float, n_tests: int = 1) -> str:
    """Return a p-value, which is adjusted where it is one of several tests."""
    text = "p < 0.001" if p < 0.001 else f"p = {p:.2g}"
    return f"adjusted {text}" if n_tests > 1 else text


def contrast_text(wins: float, difference: float, larger: bool) -> str:
    """Return that the mean is worse of who wins more often, or better of who loses more often."""
    if (wins - 0.5) * (difference if larger else -difference) < 0:
        return f"though its mean is {'worse' if wins > 0.5 else 'better'}"
    return ""


def difference_text(value: float, low: float, high: float, *, significant: bool) -> str:
    """Return a difference of means, with its interval where the pair differs significantly."""
    text = f"{value:+.3g}"
    has_interval = significant and math.isfinite(low)
    return f"{text} ({low:.3g} to {high:.3g})" if has_interval else text


def _on_pair(pair: dict[str, Any], by: str, larger: bool, n_tested: int, n_sequences: int) -> str:
    """Return which of two systems is ahead, how often it wins, and by how much."""
    wins, value, low, high = (pair[name] for name in ("wins", "difference", "low", "high"))
    first, second = pair["a"], pair["b"]
    significant = isinstance(pair["better"], str)
    if pair["better"] == pair["b"] or (not significant and wins < 0.5):
        wins, value, low, high = 1 - wins, -value, -high, -low
        first, second = second, first
    result = f"{first} is ahead of {second}: it"
    if not significant:
        result = f"{first} and {second} are not distinguishable: {first}"
    p_values = p_text(pair["p_raw"])
    if n_tested > 1:
        p_values += f", adjusted for {n_tested} pairs {pair['p']:.2g}"
    difference = difference_text(value, low, high, significant=significant)
    mean = f", mean {by} {difference}" if math.isfinite(value) else ""
    if contrast := contrast_text(wins, value, larger):
        mean = f", {contrast}: {by} {difference}"
    where = _counted(pair["sequences"], "sequence")
    if pair["sequences"] < n_sequences:
        where = f"{pair['sequences']} of {n_sequences} sequences"
    return f"{result} wins {100 * wins:.0f} % of the run pairs on {where} ({p_values}){mean}."


def _counted(n: int, what: str) -> str:
    """Return a number of things."""
    return f"{n} {what}{'s' * (n != 1)}"


def _on_leader(
    leader: str,
    of_leader: pd.DataFrame,
    by: str,
    larger: bool,
    pairs: pd.DataFrame,
    n_sequences: int,
) -> list[str]:
    """Compare the first system with the second in full, and with the others in short."""
    first, *others = records(of_leader)
    lines = [_on_pair(first, by, larger, pairs["p"].count(), n_sequences)]
    if math.isfinite(first["p_like_these"]):
        ahead = first["better_like_these"]
        who = f"{ahead} is ahead" if isinstance(ahead, str) else "they are not distinguishable"
        p = p_text(first["p_like_these"], pairs["p_like_these"].count())
        lines.append(f"On sequences like these, {who} ({p}).")
    relations: dict[tuple[str, str], list[str]] = {}
    for pair in others:
        other, wins, difference = pair["b"], pair["wins"], pair["difference"]
        if other == leader:
            other, wins, difference = pair["a"], 1 - wins, -difference
        relation, contrast = "not distinguishable from", ""
        if isinstance(pair["better"], str):
            relation = "ahead of" if pair["better"] == leader else "behind"
            contrast = contrast_text(wins, difference, larger)
        relations.setdefault((relation, contrast and f", {contrast}"), []).append(other)
    return lines + [
        f"{leader} is {relation} {first_few(systems)}{contrast}."
        for (relation, contrast), systems in sorted(relations.items())
    ]


def _too_few_runs(pairs: pd.DataFrame) -> list[str]:
    """Return which pairs no result could make significant, and how many runs are needed."""
    systems: dict[tuple[str, str], list[str]] = {}
    for pair in records(pairs[pairs["needed"] != ""]):
        key = _runs_text(pair), pair["needed"]
        systems.setdefault(key, []).append(f"{pair['a']} and {pair['b']}")
    return [
        f"{first_few(names)}{f' ({len(names)} pairs)' if len(names) > 1 else ''}: with {runs} no "
        f"result could be significant; {needed} are needed."
        for (runs, needed), names in systems.items()
    ]


def _runs_text(pair: dict[str, Any]) -> str:
    """Return how many runs a pair has."""
    fewer, more = sorted((pair["runs_a"], pair["runs_b"]))
    where = _counted(pair["sequences"], "sequence")
    if pair["method"] == SINGLE:
        return f"single runs on {where}"
    if pair["method"] == PAIRED:
        return f"so few paired runs on {where}"
    if pair["method"] == DEPENDENT and fewer < MIN_RUNS:
        return f"{_counted(fewer, 'run')} that all of {where} have"
    return f"{f'{fewer} runs each' if fewer == more else f'{fewer} and {more} runs'} on {where}"


def _without_value(runs: pd.DataFrame, by: str) -> list[str]:
    """Return which systems have no value in any run, so that they are not compared."""
    has_value = runs[by].notna().groupby(runs["system"], sort=False).any()
    systems = has_value.index[~has_value].tolist()
    return [f"No run of {first_few(systems)} has a {by}: not compared."] if systems else []


def _missing_sequences(runs: pd.DataFrame, by: str) -> list[str]:
    """Return which systems were not run on all sequences, and what the means are over."""
    has_run = pd.crosstab(runs["system"], runs["sequence"]).gt(0)
    has_run = has_run[runs["sequence"].unique()]  # in their order
    lines = [
        f"{system} has no run on {n} of {len(row)} sequences ({first_few(list(row.index[~row]))})."
        for system, row in has_run.iterrows()
        if (n := int((~row).sum()))
    ]
    if lines:
        common = common_sequences(runs)
        which = f"the {len(common)} sequences" if len(common) > 1 else "the only sequence"
        lines.append(
            f"Means are over {which} that all systems have ({first_few(common)}), {by} (all) is "
            "over all sequences of a system; --expect_all counts the missing ones as failed."
            if common
            else "No sequence has runs of all systems, so that their means cannot be compared; "
            "--expect_all counts the missing ones as failed."
        )
    return lines


def left_out_sequences(left_out: Sequence[str], runs: pd.DataFrame) -> list[str]:
    """Return which sequences were left out, so that nothing is said of them."""
    n, n_all = len(left_out), len(left_out) + runs["sequence"].nunique()
    names = first_few(left_out)
    return [f"Left out: {n} of {n_all} sequences ({names}); the errors say why."] if n else []


def notes_on_runs(runs: pd.DataFrame, by: str, design: Design) -> list[str]:
    """Return the notes on the runs: copies, numbers of runs, dependence, and those on files."""
    names = runs["sequence"] + ", " + runs["system"]
    copies = [
        f"{first_few(list(group['run']))} of {name} have the scores of an earlier run (copies, or "
        "a deterministic system): they do not count"
        for name, group in runs[runs["status"] == "copy"].groupby(names, sort=False)
    ]
    lines = alike([("", note) for note in copies])
    runs = runs[runs["status"] != "copy"]
    numbers = runs.groupby(["system", "sequence"], sort=False).size().groupby("system").max()
    if numbers.max() > numbers.min() > 1:
        lines.append(
            f"{numbers.idxmin()} has {numbers.min()} runs on a sequence, {numbers.idxmax()} "
            f"{numbers.max()}: were bad runs left out? Runs count as failed if the YAML file says "
            "how many there are"
        )
    if design == "independent" and (p := _dependence(runs, by)) <= LEVEL:
        lines.append(
            f"runs of the same name are good or bad together over the sequences ({p_text(p)}), as "
            "if they shared a build or a night: --runs dependent counts each as one value"
        )
    for _, group in advise_systems(runs).groupby("system", sort=False):
        lines += alike(texts_by_run(group, "notes"))
        n_sequences = group["sequence"].nunique()
        if len(group) == n_sequences:
            lines += alike(texts_by_run(group, "hints"))
            continue
        for (name, hint), *others in groups_alike(texts_by_run(group, "hints")):
            where = f" of {len(others) + 1} of {n_sequences} sequences" if n_sequences > 1 else ""
            lines.append(f"{name}: {hint} (in the first run{where}; further runs are not checked)")
    return lines


def texts_by_run(runs: pd.DataFrame, column: str) -> list[tuple[str, str]]:
    """Return the names of runs, each with a text that a column has for it, such as a note."""
    return [
        ("{sequence}, {system}, run {run}".format(**row), text)
        for row in records(runs)
        for text in row[column].split(SEPARATOR)
        if text
    ]


def _dependence(runs: pd.DataFrame, by: str) -> float:
    """Return the p-value of Friedman's test that runs of a name are ranked alike on sequences.

    The statistics of the systems add up; a system counts with the runs that all sequences have.
    """
    statistic, dof = 0.0, 0
    for _, group in runs.groupby("system", sort=False):
        table = group.pivot(index="sequence", columns="run", values=by).dropna(axis="columns")
        if min(len(table), len(table.columns) - 1) < 2:
            continue
        with np.errstate(invalid="ignore", divide="ignore"):  # of runs that are all equal
            chi_squared = scipy.stats.friedmanchisquare(*table.to_numpy().T).statistic
        if np.isfinite(chi_squared):
            statistic, dof = statistic + chi_squared, dof + len(table.columns) - 1
    return float(scipy.stats.chi2.sf(statistic, dof)) if dof else 1.0
