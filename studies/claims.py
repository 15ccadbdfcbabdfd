"""The paper's claims, ``configs/claims.yaml``: the trials that they need, and the verdicts.

The central 95 % of the replicate studies are the spread of a single study (`verdict`); the
confidence interval of their mean shows what is true of the mean of all studies of this size
(`populations`). The statistic of the trials of all replicates together is `pooled`: a range grows
with the number of trials.

``python -m studies.claims NUMBER [output=FILE key=value ...]`` runs one replicate study.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from joblib import Parallel, delayed

from alignscores.arrays import Floats
from alignscores.comparison.statistics import LEVEL, holm
from experiments.command import CommandError, ConfigError, run_command
from experiments.config import Selection, Sweep, load, split_override
from experiments.grid import CELL_SETTINGS, Cell, cells
from experiments.sweep import run_sweeps
from experiments.tables import Trials, refuse_to_replace, write_trials

from .settings import load_experiment, reject
from .statements import Claim, Claims, Decision, Reading, intersection, load_claims
from .statistics import cell_means, select

CENTRAL = (LEVEL / 2, 1 - LEVEL / 2)
REPRODUCED, NOT_REPRODUCED, INCONCLUSIVE = "reproduced", "not reproduced", "inconclusive"
VERDICTS = (NOT_REPRODUCED, INCONCLUSIVE, REPRODUCED)
TRUE, FALSE, OPEN = "true", "false", "open"
TRUTHS = (FALSE, OPEN, TRUE)

OtherReading = tuple[Decision, Reading, Mapping[str, Claim]]  # and the claims that it changes
Replicate = Mapping[tuple[str, tuple[str, ...]], pd.DataFrame]  # by `Claim.trials`
FIXED = ("experiment", "metrics", "replicate")  # settings that the claims decide


def plan_replicates(
    claims: Claims, overrides: Sequence[str], numbers: Iterable[int]
) -> list[tuple[Sweep, ...]]:
    """Return the sweeps of replicate studies, those that the claims need."""
    reject(dict(map(split_override, overrides)), FIXED, "the claims decide what is run")
    planned: dict[int, list[Sweep]] = {}  # by the number of claims: the first studies have more
    studies = []
    for number in numbers:
        needed = list(claims.needed(number))
        if len(needed) not in planned:
            planned[len(needed)] = plan(needed, overrides)
        studies.append(tuple(replace(sweep, replicate=number) for sweep in planned[len(needed)]))
    return studies


def plan(claims: Iterable[Claim], overrides: Sequence[str] = ()) -> list[Sweep]:
    """Collect what the claims need: a sweep for each experiment and way to read it."""
    selections_of: dict[tuple[str, tuple[str, ...]], tuple[Sweep, list[Selection]]] = {}
    for claim in claims:
        if claim.trials not in selections_of:
            experiment, settings = claim.trials
            sweep = load_experiment([f"experiment={experiment}", *overrides, *settings])
            selections_of[claim.trials] = sweep, []
        sweep, selections = selections_of[claim.trials]
        check_cells(claim, sweep)
        selections += [selection for selection in _selections(claim) if selection not in selections]
    sweeps = []
    for (_, settings), (sweep, selections) in selections_of.items():
        metrics = list(
            dict.fromkeys(metric for selection in selections for metric in selection.metrics)
        )
        changes = " ".join(settings)
        sweeps.append(replace(sweep, changes=changes, metrics=metrics, selections=selections))
    return sweeps


def _selections(claim: Claim) -> list[Selection]:
    """Return the cells that a claim takes, those before and after a change apart."""
    parts = (claim.before, claim.after) if claim.before or claim.after else ({},)
    return [Selection(list(claim.metrics), intersection(claim.where, part)) for part in parts]


def check_cells(claim: Claim, sweep: Sweep) -> None:
    """Raise a `ConfigError` that names the cells that a claim takes and a sweep lacks."""
    wheres = [selection.where for selection in _selections(claim)]
    needed = [cell for cell in cells(sweep) if any(cell.matches(where) for where in wheres)]
    for part in (claim.where, claim.at, claim.before, claim.after):
        for key, values in part.items():
            missing = sorted(set(values) - _levels(needed, key))
            if missing:
                raise ConfigError(
                    f"claim {claim.id!r} needs trials of {sweep.name} with {key} {missing[0]:g}, "
                    "which these settings leave out"
                )
    n_levels = claim.rule.least_levels
    for key in claim.level:
        levels = _levels(needed, key)
        if len(levels) < n_levels:
            raise ConfigError(
                f"claim {claim.id!r} compares levels of {key}, at least {n_levels}, and these "
                f"settings of {sweep.name} have {len(levels)}"
            )


def _levels(needed: Sequence[Cell], key: str) -> set[float]:
    return {getattr(cell, key) for cell in needed}


def answer(trials: Sequence[Trials]) -> list[pd.DataFrame | str]:
    """Return the verdicts, those under other readings and by other criteria, and the page."""
    if len(trials) < 2:
        raise CommandError(
            "verdicts take at least two replicate studies: the spread is between them"
        )
    for number, table in enumerate(trials):
        if table.sweep.replicate != number:
            raise CommandError(f"{table.path} is not replicate {number}: name them in order, once")
    claims, replicates = load_claims(len(trials)), list(map(select_trials, trials))
    verdicts, readings, criteria = decide(claims, replicates)
    return [verdicts, readings, criteria, draw(verdicts, readings)]


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
    claims: Claims, replicates: Sequence[Replicate]
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
    originals = list(claims.claims.values())
    readings = [entry for entry in claims.other_readings() if entry[2]]  # those that change a claim
    evaluations = [(claim, claims.replicates) for claim in originals]
    for _, reading, changed in readings:
        evaluations += [(claim, claims.n_studies(reading)) for claim in changed.values()]
    tasks = [
        ([claim for claim, n in evaluations if number < n], trials)
        for number, trials in enumerate(replicates)
    ]
    values: list[list[float]] = [[] for _ in evaluations]
    for number, evaluated in enumerate(Parallel()(starmap(delayed(_evaluate), tasks))):
        deciding = [
            column for column, (_, n) in zip(values, evaluations, strict=True) if number < n
        ]
        for column, value in zip(deciding, evaluated, strict=True):
            column.append(value)
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
        _under_readings(readings, arrays),
        _by_other_criteria(claims, original_values),
    )


def _under_readings(readings: Sequence[OtherReading], values: Iterator[Floats]) -> pd.DataFrame:
    """Return the verdicts under other readings."""
    names = ["decision", "question", "paper_says", "choice", "reading"]
    if not readings:
        return pd.DataFrame(columns=names)
    texts = [(d.id, d.question, d.paper, d.choice, reading.reading) for d, reading, _ in readings]
    tables = [_decided(changed, [next(values) for _ in changed]) for *_, changed in readings]
    return pd.concat(tables, keys=texts, names=[*names, "claim"]).reset_index()


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


SECTIONS = {  # of the paper, in its order, by the source of a claim
    "Abstract": "Abstract",
    "Introduction": "1 Introduction",
    "Table 1": "1 Introduction, Table 1",
    "Section 3": "3 Translation Alignment Score",
    "Section 4": "4 Rotation Alignment Score",
    "Figure 2": "6.1.1 Robustness to outliers, Figure 2",
    "Figure 3": "6.1.2 Robustness to collinear motion, Figure 3",
    "Figure 4": "6.1.3 Impact of the trajectory length, Figure 4",
    "Figure 5": "6.2 Evaluation of RAS, Figure 5",
    "Figure 6": "6.3.1 Sensitivity to translation and rotation noise, Figure 6",
    "Figure 7 (a)": "6.3.2 Comparing mAA and PAS, Figure 7 (a)",
    "Figure 7 (b)": "6.3.2 Comparing mAA and PAS, Figure 7 (b)",
    "Figure 7 (c)": "6.3.2 Comparing mAA and PAS, Figure 7 (c)",
    "Discussions": "8 Discussions",
}


def draw(claims: pd.DataFrame, readings: pd.DataFrame | None = None, *, whole: bool = True) -> str:
    """Return the page of all statements as HTML: what fails first, then all by their sections.

    Without `whole` it is a part of another page, such as the documentation's.
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"number": write_number, "count": _count}
    entries = []
    for (source, sentence), rows in claims.groupby(["source", "sentence"], sort=False):
        counted = rows[rows["implied_by"].isna()]
        worst = min((counted if len(counted) else rows)["verdict"], key=VERDICTS.index)
        entry = {"source": source, "sentence": sentence, "verdict": worst}
        entry |= {"claims": rows.to_dict("records"), "n": len(counted)}
        entries.append(
            entry | {"deciding": counted[counted["verdict"] == worst].to_dict("records")}
        )
    order = list(SECTIONS)
    entries.sort(key=lambda entry: order.index(entry["source"]))  # stable: as in the file within
    return environment.get_template("claims.html.j2").render(
        whole=whole,
        claims=claims,
        counted=claims[claims["implied_by"].isna()],
        statements=statements(claims),
        failures=[
            entry
            for word in VERDICTS[:-1]
            for entry in entries
            if entry["n"] and entry["verdict"] == word
        ],
        sections=[
            (section, [entry for entry in entries if entry["source"] == source])
            for source, section in SECTIONS.items()
        ],
        readings=[] if readings is None else _changed(claims, readings),
    )


def _changed(claims: pd.DataFrame, readings: pd.DataFrame) -> list[dict[str, Any]]:
    """Return each other reading with the claims that have another verdict under it."""
    both = readings.merge(claims, left_on="claim", right_on="id", suffixes=("", "_taken"))
    keys = ["question", "paper_says", "choice", "reading", "replicates"]
    return [
        dict(zip(keys, values, strict=True))
        | {"n": len(rows)}
        | {"changed": rows[rows["verdict"] != rows["verdict_taken"]].to_dict("records")}
        for values, rows in both.groupby(keys, sort=False)
    ]


def _count(words: "pd.Series[str]", order: Sequence[str] = VERDICTS[::-1]) -> dict[str, int]:
    """Return how often each word is there."""
    return {word: int((words == word).sum()) for word in order}


def write_number(value: float, unit: str = "") -> str:
    """Write a number with the digits that matter and a true minus."""
    if not np.isfinite(value):
        return "∞" if value > 0 else "–"
    return f"{value:{'.2f' if unit == 'τ' else '.1f'}}".replace("-", "−")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the trials that the claims need; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.claims",
        description="Run the trials of one replicate study, those that the claims need.",
    )
    parser.add_argument("number", type=int, metavar="NUMBER", help="from 0")
    settings = "as of experiments.run"
    parser.add_argument("settings", nargs="*", metavar="key=value", help=settings)
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    claims = load_claims(max(2, options.number + 1))
    (sweeps,) = plan_replicates(claims, options.settings, [options.number])
    _, execution = load(options.settings)
    path = Path(execution.output or f"replicate_{options.number}.csv")
    refuse_to_replace(path)
    write_trials(path, run_sweeps(sweeps, execution.n_jobs), sweeps)
    return [path]


if __name__ == "__main__":
    sys.exit(main())
