"""What the page is made of: tables, figures and records of a results folder, read and checked."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from math import isfinite, nan
from pathlib import Path
from typing import Any

import pandas as pd
from PIL import Image

from experiments.claims import Claim, Claims
from experiments.comparison import PAPER, PROPERTIES
from experiments.config import HOW, experiment_names
from experiments.effects import EFFECTS
from experiments.findings import findings_path
from experiments.scenarios import BEYOND
from experiments.scenarios import Study as Scenarios
from experiments.study import Study
from experiments.tables import TableError, read_csv, read_provenance
from experiments.verdicts import INCONCLUSIVE, NOT_REPRODUCED, REPRODUCED
from figures import FIGURES, STUDIES

__all__ = ["VERDICTS", "Inputs", "Job", "Plan", "Tables", "read_inputs"]

VERDICTS = (NOT_REPRODUCED, INCONCLUSIVE, REPRODUCED)
ESTIMATE = ("ours", "low", "high", "verdict")
CLAIM = ("id", "source", "figure", "statement", "statistic", "criterion", "paper", "replicates")
OF_MEANS = tuple(f"{name}_of_means" for name in ESTIMATE)
DECISION = ("decision", "reading", "claim")
ANSWER = ("paper", "ours", "agrees", "statistic", "value", "experiment")
INPUT = ("part", "geometry", "n_cameras", "n_outliers", "sigma_t", "trial", "statistic")
FINDING = ("mean", "verdict", "finding")


@dataclass(frozen=True, eq=False)
class Plan:
    """What the page is to be made of, under the settings that the workflow was run with.

    Parameters
    ----------
    results : Path
        The folder that the workflow wrote.
    settings : sequence of str
        The settings of all experiments, as Hydra overrides.
    claims : Claims
        The claims that must be decided.
    n_replicates : int or None
        The number of replicates that they must be decided from; None where any will do.
    studies : mapping of str to Study
        The parameter studies by name.
    scenarios : Scenarios
        The study of what the paper leaves out.
    scenario_file : Path
        The file that it stands in.
    """

    results: Path
    settings: Sequence[str]
    claims: Claims
    n_replicates: int | None
    studies: Mapping[str, Study]
    scenarios: Scenarios
    scenario_file: Path

    def run(self, *command: str) -> list[str]:
        """Return a command with the settings of all experiments."""
        return [*command, *self.settings]

    @property
    def verdicts(self) -> list[str]:
        """The command that decides the claims."""
        number = [] if self.n_replicates is None else [f"replicates={self.n_replicates}"]
        return self.run("experiments.verdicts", *number)

    def run_scenarios(self, *command: str) -> list[str]:
        """Return a command that takes the file of scenarios."""
        own = self.scenario_file.resolve() != BEYOND
        return self.run(*command, *(["--scenarios", str(self.scenario_file)] if own else []))


@dataclass(frozen=True, eq=False)
class Tables:
    """A parameter study, what came out, and what its values cost in time."""

    study: Study
    results: pd.DataFrame
    times: pd.DataFrame


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
    plan : Plan
        What is claimed, the decisions and the studies.
    verdicts, decisions, comparison : DataFrame
        ``claims.csv``, ``tables/decisions.csv`` and ``tables/method_comparison.csv``.
    thresholds, registrations : Tables
        The parameter studies.
    findings : DataFrame
        ``tables/beyond.csv``, or that of a study of one's own.
    figures : mapping
        Each figure, those of the paper first.
    experiments, replicates, parts : mapping
        The provenance of each table of trials by its name; `parts` are those of the studies.
    jobs : mapping
        The jobs of each rule that Snakemake has run.
    """

    plan: Plan
    verdicts: pd.DataFrame
    decisions: pd.DataFrame
    comparison: pd.DataFrame
    thresholds: Tables
    registrations: Tables
    findings: pd.DataFrame
    figures: Mapping[str, Image.Image]
    experiments: Mapping[str, dict[str, Any]]
    replicates: Mapping[str, dict[str, Any]]
    parts: Mapping[str, dict[str, Any]]
    jobs: Mapping[str, Sequence[Job]]

    @property
    def n_replicates(self) -> int:
        """The number of replicate studies behind every verdict."""
        return len(self.replicates)


def read_inputs(plan: Plan) -> Inputs:
    """Read what the page is made of.

    Raises
    ------
    TableError
        Where a file is missing, or cannot be what it should be.
    """
    results, studies = plan.results, plan.studies
    verdicts = _read_verdicts(plan)
    numbers = range(int(verdicts["replicates"].iloc[0]))
    return Inputs(
        plan=plan,
        verdicts=verdicts,
        decisions=_read_decisions(plan),
        comparison=_read_comparison(plan),
        thresholds=Tables(
            studies["threshold"],
            _read_effects(studies["threshold"]),
            _read_times(studies["threshold"]),
        ),
        registrations=Tables(
            studies["registration"],
            _read_registrations(studies["registration"]),
            _read_times(studies["registration"]),
        ),
        findings=_read_findings(plan),
        figures=_read_figures(plan),
        experiments={
            name: read_provenance(
                results / "trials" / f"{name}.json",
                plan.run("experiments.run", f"experiment={name}"),
            )
            for name in experiment_names()
        },
        replicates=_read_replicates(plan, numbers),
        parts=_read_parts(plan),
        jobs=_read_jobs(plan, numbers),
    )


def _read_verdicts(plan: Plan) -> pd.DataFrame:
    path, command = plan.results / "claims.csv", plan.verdicts
    table = _read_table(path, (*CLAIM, *ESTIMATE, *OF_MEANS), command)
    expected = [(name, *_identity(claim)) for name, claim in plan.claims.claims.items()]
    _compare(path, table[list(CLAIM[:-1])], expected, command)
    _check_estimates(path, table, ESTIMATE, command)
    ranges = table[[claim.has_ranges for claim in plan.claims.claims.values()]]
    _check_estimates(path, ranges, OF_MEANS, command)
    found = table["replicates"]
    if found.nunique() != 1 or not pd.api.types.is_integer_dtype(found):
        raise TableError(path, "does not tell the number of replicates", command)
    if plan.n_replicates not in (None, found[0]):
        problem = f"rests on {found[0]} replicates, not {plan.n_replicates}"
        raise TableError(path, problem, command)
    return table


def _read_decisions(plan: Plan) -> pd.DataFrame:
    path, command = plan.results / "tables" / "decisions.csv", plan.verdicts
    table = _read_table(path, (*DECISION, *ESTIMATE), command)
    expected = [
        (decision.id, reading.reading, claim)
        for decision in plan.claims.decisions
        for reading in decision.readings
        for claim in decision.claims
    ]
    _compare(path, table[list(DECISION)], expected, command)
    _check_estimates(path, table, ESTIMATE, command)
    return table


def _read_comparison(plan: Plan) -> pd.DataFrame:
    path = plan.results / "tables" / "method_comparison.csv"
    command = plan.run("experiments.comparison")
    table = _read_table(path, ("metric", "property", *ANSWER), command)
    expected = [(metric, name) for metric in PAPER for name in PROPERTIES]
    _compare(path, table[["metric", "property"]], expected, command)
    _require_numbers(path, table[table["ours"] != "not tested"], ["value"], command)
    return table


def _read_effects(study: Study) -> pd.DataFrame:
    """Read the tables of the threshold study, joined."""
    tables = []
    for kind in STUDIES["threshold_study"]:
        path = study.table_path(kind)
        command = ["experiments.threshold_study", *study.overrides]
        columns = ("axis", "value", "paper", *EFFECTS, *(f"{name}_error" for name in EFFECTS))
        table = _read_table(path, columns, command, text=["value"])
        expected = [
            (axis.name, value, "yes" if value == axis.paper else "no")
            for axis in study.axes.values()
            for value in axis.values
            if axis.name.startswith(f"{kind[1:]}_")
        ]
        _compare(path, table[["axis", "value", "paper"]], expected, command)
        _require_numbers(path, table, ["noise_power"], command)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _read_times(study: Study) -> pd.DataFrame:
    path = study.table_path("_time")
    command = ["experiments.study_time", study.name, *study.overrides]
    table = _read_table(path, ("n_cameras", "axis", "value", "milliseconds"), command, ["value"])
    seeded = (part.config.n_cameras for part in study.parts.values() if part.seeds)
    expected = [
        (n, axis.name, value)
        for n in sorted({n for numbers in seeded for n in numbers})
        for axis in study.axes.values()
        for value in axis.values
    ]
    _compare(path, table[["n_cameras", "axis", "value"]], expected, command)
    _require_numbers(path, table, ["milliseconds"], command)
    return table


def _read_registrations(study: Study) -> pd.DataFrame:
    path = study.table_path()
    command = ["experiments.registration_study", *study.overrides]
    values = [value for axis in study.axes.values() for value in axis.values]
    table = _read_table(path, (*INPUT, *values), command)
    found = table[["part"]].drop_duplicates()
    parts = [name for name, part in study.parts.items() if part.seeds or name in set(found["part"])]
    _compare(path, found, [(name,) for name in parts], command)
    _require_numbers(path, table, values, command)
    return table


def _read_findings(plan: Plan) -> pd.DataFrame:
    path, command = findings_path(plan.scenarios), plan.run_scenarios("experiments.findings")
    powers = ("noise_power", "outlier_power")
    table = _read_table(path, ("scenario", "metric", *powers, *FINDING), command)
    expected = [
        (name, metric)
        for name, config in plan.scenarios.scenarios.items()
        for metric in config.metrics
    ]
    _compare(path, table[["scenario", "metric"]], expected, command)
    _require_numbers(path, table, ["mean"], command)
    return table


def _read_figures(plan: Plan) -> dict[str, Image.Image]:
    commands = {name: plan.run("figures", name) for name in FIGURES}
    for name, study in plan.studies.items():
        commands[f"{name}_study"] = ["figures", f"{name}_study", *study.overrides]
    for name in (plan.scenarios.name, "paths"):
        commands[name] = plan.run_scenarios("figures.beyond")
    directory = plan.results / "figures"
    return {
        name: _read_figure(directory / f"{name}.png", command) for name, command in commands.items()
    }


def _read_figure(path: Path, command: Sequence[str]) -> Image.Image:
    content = _read(path, command)
    try:
        image = Image.open(BytesIO(content), formats=["PNG"])
        image.load()
    except (OSError, SyntaxError, ValueError):
        raise TableError(path, "is no PNG", command) from None
    return image


def _read_replicates(plan: Plan, numbers: Iterable[int]) -> dict[str, dict[str, Any]]:
    records: dict[str, dict[str, Any]] = {}
    for number in numbers:
        path = plan.results / "replicates" / f"{number}.json"
        command = [*plan.run("experiments.replicate"), f"replicate={number}"]
        records[str(number)] = record = read_provenance(path, command)
        if _shared(record) != _shared(records["0"]):
            raise TableError(path, "has other settings than replicate 0", command)
    return records


def _shared(record: Mapping[str, Any]) -> dict[str, Any]:
    own = ("replicate", *HOW)
    return {key: value for key, value in record["config"].items() if key not in own}


def _read_parts(plan: Plan) -> dict[str, dict[str, Any]]:
    """Read the provenance of the studies' trials."""
    commands = {
        f"{study.name}_study/{name}": ["experiments.study", study.name, name, *study.overrides]
        for study in plan.studies.values()
        for name in study.parts
    }
    for name, config in plan.scenarios.scenarios.items():
        commands[config.name] = plan.run_scenarios("experiments.scenarios", name)
    directory = plan.results / "trials"
    return {
        name: read_provenance(directory / f"{name}.json", command)
        for name, command in commands.items()
    }


def _read_jobs(plan: Plan, numbers: Iterable[int]) -> dict[str, list[Job]]:
    """Read the jobs that made these inputs; the page's own would change it from run to run."""
    directory, beyond = plan.results / "benchmarks", plan.scenarios
    rules = {
        "experiment": experiment_names(),
        "figure": [f"figure_{name}" for name in FIGURES],
        "comparison": ["comparison"],
        "replicate": [f"replicate_{number}" for number in numbers],
        "claims": ["claims"],
        "study_part": [
            f"{study.name}_study/{part}" for study in plan.studies.values() for part in study.parts
        ],
        "study_time": [f"{name}_study/time" for name in plan.studies],
        **{f"{name}_tables": [f"{name}_study"] for name in plan.studies},
        "study_figure": [f"figure_{name}_study" for name in plan.studies],
        "scenario": [config.name for config in beyond.scenarios.values()],
        "findings": [beyond.name],
        "findings_figure": [f"figure_{beyond.name}"],
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


def _read_table(
    path: Path, columns: Iterable[str], command: Sequence[str], text: Sequence[str] = ()
) -> pd.DataFrame:
    """Read a table that has some columns; those of `text` are read as such, even if numbers."""
    table = read_csv(path, command, dtype=dict.fromkeys(text, str))
    for column in columns:
        if column not in table:
            raise TableError(path, f"has no column {column}", command)
    return table


def _read(path: Path, command: Sequence[str]) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise TableError(path, "does not exist", command) from None
    except OSError as error:
        raise TableError(path, f"cannot be read ({error.strerror})", command) from None


def _compare(
    path: Path, table: pd.DataFrame, expected: Sequence[tuple[object, ...]], command: Sequence[str]
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
            raise TableError(path, problem, command)
    if len(rows) != len(expected):
        raise TableError(path, f"has {len(rows)} rows, not {len(expected)}", command)


def _check_estimates(
    path: Path, table: pd.DataFrame, columns: Sequence[str], command: Sequence[str]
) -> None:
    *numbers, verdict = columns
    unknown = sorted(set(table[verdict].astype(str)) - set(VERDICTS))
    if unknown:
        raise TableError(path, f"has an unknown verdict {unknown[0]!r}", command)
    decided = table[table[verdict] != INCONCLUSIVE]  # which may be for want of a number
    _require_numbers(path, decided, numbers, command)


def _require_numbers(
    path: Path, table: pd.DataFrame, columns: Sequence[str], command: Sequence[str]
) -> None:
    for column in columns:
        values = pd.to_numeric(table[column], errors="coerce")
        if not all(map(isfinite, values)):
            raise TableError(path, f"has values of {column} that are no numbers", command)
