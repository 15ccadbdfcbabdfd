"""What the page is made of: tables, figures and records of a results folder, read and checked."""

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.claims import Claim, Claims
from experiments.comparison import PAPER, PROPERTIES
from experiments.config import experiment_names
from experiments.verdicts import INCONCLUSIVE, NOT_REPRODUCED, REPRODUCED
from figures import FIGURES

__all__ = ["VERDICTS", "InputError", "Inputs", "Job", "read_inputs"]

VERDICTS = (NOT_REPRODUCED, INCONCLUSIVE, REPRODUCED)
ESTIMATE = ("ours", "low", "high", "verdict")
CLAIM = ("id", "source", "figure", "statement", "statistic", "criterion", "paper", "replicates")
OF_MEANS = tuple(f"{name}_of_means" for name in ESTIMATE)
DECISION = ("decision", "reading", "claim")
ANSWER = ("paper", "ours", "agrees", "statistic", "value", "experiment")
HOW = ("replicate", "n_jobs", "backend", "results_dir")  # no result depends on them
PNG = b"\x89PNG\r\n\x1a\n"


class InputError(ValueError):
    """A file that the page cannot be made from.

    Parameters
    ----------
    path : Path
        The file.
    problem : str
        What is wrong with it, to be read behind its path.
    module : str
        What to run for a better one, behind ``python -m``.
    """

    def __init__(self, path: Path, problem: str, module: str) -> None:
        super().__init__(f"{path} {problem}")
        self.module = module


@dataclass(frozen=True)
class Job:
    """What Snakemake measured of one job; not a number where it did not."""

    seconds: float
    cpu_seconds: float
    megabytes: float


@dataclass(frozen=True, eq=False)
class Inputs:
    """All that the page shows.

    Parameters
    ----------
    claims : Claims
        What is claimed, and the decisions.
    verdicts, decisions, comparison : DataFrame
        ``claims.csv``, ``tables/decisions.csv`` and ``tables/method_comparison.csv``.
    figures : mapping
        The PNG of each figure.
    experiments, replicates : mapping
        The provenance of each table of trials, by its name.
    jobs : mapping
        The jobs of each rule that Snakemake has run.
    """

    claims: Claims
    verdicts: pd.DataFrame
    decisions: pd.DataFrame
    comparison: pd.DataFrame
    figures: Mapping[str, bytes]
    experiments: Mapping[str, dict[str, Any]]
    replicates: Mapping[str, dict[str, Any]]
    jobs: Mapping[str, Sequence[Job]]

    @property
    def n_replicates(self) -> int:
        """The number of replicate studies behind every verdict."""
        return len(self.replicates)


def read_inputs(results: Path, claims: Claims, n_replicates: int | None = None) -> Inputs:
    """Read what the page is made of.

    Parameters
    ----------
    results : Path
        The folder that the workflow wrote.
    claims : Claims
        The claims that must be decided there.
    n_replicates : int, optional
        The number of replicates that they must be decided from; by default any.

    Raises
    ------
    InputError
        Where a file is missing, or cannot be what it should be.
    """
    verdicts = _read_verdicts(results / "claims.csv", claims, n_replicates)
    numbers = range(int(verdicts["replicates"].iloc[0]))
    return Inputs(
        claims=claims,
        verdicts=verdicts,
        decisions=_read_decisions(results / "tables" / "decisions.csv", claims),
        comparison=_read_comparison(results / "tables" / "method_comparison.csv"),
        figures={name: _read_figure(results / "figures" / f"{name}.png", name) for name in FIGURES},
        experiments={
            name: _read_provenance(
                results / "trials" / f"{name}.json", f"experiments.run experiment={name}"
            )
            for name in experiment_names()
        },
        replicates=_read_replicates(results / "replicates", numbers),
        jobs=_read_jobs(results / "benchmarks", numbers),
    )


def _read_verdicts(path: Path, claims: Claims, n_replicates: int | None) -> pd.DataFrame:
    module = "experiments.verdicts"
    table = _read_table(path, (*CLAIM, *ESTIMATE, *OF_MEANS), module)
    expected = [(name, *_identity(claim)) for name, claim in claims.claims.items()]
    _compare(path, table[list(CLAIM[:-1])], expected, module)
    _check_estimates(path, table, ESTIMATE, module)
    ranges = table[[claim.has_ranges for claim in claims.claims.values()]]
    _check_estimates(path, ranges, OF_MEANS, module)
    found = table["replicates"]
    if found.nunique() != 1 or not pd.api.types.is_integer_dtype(found):
        raise InputError(path, "does not tell the number of replicates", module)
    if n_replicates not in (None, found[0]):
        raise InputError(path, f"rests on {found[0]} replicates, not {n_replicates}", module)
    return table


def _read_decisions(path: Path, claims: Claims) -> pd.DataFrame:
    module = "experiments.verdicts"
    table = _read_table(path, (*DECISION, *ESTIMATE), module)
    expected = [
        (decision.id, reading.reading, claim)
        for decision in claims.decisions
        for reading in decision.readings
        for claim in decision.claims
    ]
    _compare(path, table[list(DECISION)], expected, module)
    _check_estimates(path, table, ESTIMATE, module)
    return table


def _read_comparison(path: Path) -> pd.DataFrame:
    module = "experiments.comparison"
    table = _read_table(path, ("metric", "property", *ANSWER), module)
    expected = [(metric, name) for metric in PAPER for name in PROPERTIES]
    _compare(path, table[["metric", "property"]], expected, module)
    _require_numbers(path, table[table["ours"] != "not tested"], ["value"], module)
    return table


def _read_figure(path: Path, name: str) -> bytes:
    module = f"figures {name}"
    content = _read(path, module)
    if not content.startswith(PNG):
        raise InputError(path, "is no PNG", module)
    return content


def _read_replicates(directory: Path, numbers: Iterable[int]) -> dict[str, dict[str, Any]]:
    records: dict[str, dict[str, Any]] = {}
    for number in numbers:
        path, module = directory / f"{number}.json", f"experiments.replicate replicate={number}"
        records[str(number)] = record = _read_provenance(path, module)
        if _shared(record) != _shared(records["0"]):
            raise InputError(path, "has other settings than replicate 0", module)
    return records


def _shared(record: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in record["config"].items() if key not in HOW}


def _read_provenance(path: Path, module: str) -> dict[str, Any]:
    content = _read(path, module)
    try:
        record = json.loads(content)
    except ValueError:
        record = None
    keys = ("config", "packages", "git", "python", "platform")
    if not isinstance(record, dict) or any(key not in record for key in keys):
        raise InputError(path, "is no record of provenance", module)
    return record


def _read_jobs(directory: Path, numbers: Iterable[int]) -> dict[str, list[Job]]:
    """Read the jobs that made these inputs; the page's own would change it from run to run."""
    rules = {
        "experiment": experiment_names(),
        "figure": [f"figure_{name}" for name in FIGURES],
        "comparison": ["comparison"],
        "replicate": [f"replicate_{number}" for number in numbers],
        "claims": ["claims"],
    }
    found = {
        rule: [job for name in names if (job := _read_job(directory / f"{name}.tsv"))]
        for rule, names in rules.items()
    }
    return {rule: jobs for rule, jobs in found.items() if jobs}


def _read_job(path: Path) -> Job | None:
    """Read a benchmark; None where there is none, since not everything is run by Snakemake."""
    try:
        with path.open(newline="") as file:
            row = next(csv.DictReader(file, delimiter="\t"), {})
    except (OSError, UnicodeDecodeError):
        return None
    return Job(*(_number(row.get(key)) for key in ("s", "cpu_time", "max_rss")))


def _number(text: str | None) -> float:
    try:
        return float(text or nan)
    except ValueError:
        return nan


def _identity(claim: Claim) -> tuple[str | float | None, ...]:
    criterion = claim.criterion or "the paper's number"
    described = (claim.source, claim.figure, claim.statement, claim.describe())
    return (*described, criterion, claim.paper)


def _read_table(path: Path, columns: Iterable[str], module: str) -> pd.DataFrame:
    try:
        table = pd.read_csv(path)
    except FileNotFoundError:
        raise InputError(path, "does not exist", module) from None
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InputError(path, f"cannot be read ({reason})", module) from None
    for column in columns:
        if column not in table:
            raise InputError(path, f"has no column {column}", module)
    return table


def _read(path: Path, module: str) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(path, "does not exist", module) from None
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", module) from None


def _compare(
    path: Path, table: pd.DataFrame, expected: Sequence[tuple[object, ...]], module: str
) -> None:
    """Refuse a table whose rows are not the ones expected, in their order."""
    rows = [
        tuple(None if pd.isna(value) else value for value in row)
        for row in table.itertuples(index=False, name=None)
    ]
    for number, (row, other) in enumerate(zip(rows, expected, strict=False), start=2):
        if row != other:
            problem = (
                f"was made for something else: line {number} is not {'/'.join(map(str, other[:3]))}"
            )
            raise InputError(path, problem, module)
    if len(rows) != len(expected):
        raise InputError(path, f"has {len(rows)} rows, not {len(expected)}", module)


def _check_estimates(path: Path, table: pd.DataFrame, columns: Sequence[str], module: str) -> None:
    *numbers, verdict = columns
    unknown = sorted(set(table[verdict].astype(str)) - set(VERDICTS))
    if unknown:
        raise InputError(path, f"has an unknown verdict {unknown[0]!r}", module)
    decided = table[table[verdict] != INCONCLUSIVE]  # which may be for want of a number
    _require_numbers(path, decided, numbers, module)


def _require_numbers(path: Path, table: pd.DataFrame, columns: Sequence[str], module: str) -> None:
    for column in columns:
        values = pd.to_numeric(table[column], errors="coerce")
        if not all(map(isfinite, values)):
            raise InputError(path, f"has values of {column} that are no numbers", module)
