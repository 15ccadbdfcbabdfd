"""What the page is made of: tables, figures and records, read and checked.

A file that is missing, or cannot be what it should be, ends in a `TableError` that names it.
"""

from argparse import Namespace
from collections.abc import Container, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image

from experiments.command import CommandError
from experiments.tables import Record, TableError, read_record, read_table
from figures import FIGURES
from studies.claims.claims import Claims, load_claims
from studies.claims.verdicts import (
    INCONCLUSIVE,
    POPULATION,
    TAKEN,
    VERDICTS,
    check_alike,
    reading_title,
)
from studies.frame_rate import rates
from studies.parameters import maps
from studies.parameters.axes import Axis, axes_of, is_seeded
from studies.parameters.effects import COMPARED, EFFECTS
from studies.scenarios.findings import POWERS
from studies.table1 import PAPER, PROPERTIES
from studies.today.orders import FOUND, KEYS

__all__ = [
    "ESTIMATE",
    "Parameters",
    "Records",
    "read_figures",
    "read_findings",
    "read_frame_rates",
    "read_jobs",
    "read_maps",
    "read_order",
]
__all__ += ["read_readings", "read_records", "read_registrations", "read_replicates", "read_table1"]
__all__ += ["read_thresholds", "read_today", "read_verdicts"]

ESTIMATE = ("ours", "low", "high", "verdict", "mean_low", "mean_high", "population")
WORDS = {"verdict": VERDICTS, "population": POPULATION}
NUMBERS = tuple(name for name in ESTIMATE if name not in WORDS)
CLAIM = ("id", "source", "figure", "statement", "paper")
JOB = ["s", "cpu_time", "max_rss"]

Records = Mapping[Path, Record]
Row = Mapping[str, str | float | None]


@dataclass(frozen=True, eq=False)
class Parameters:
    """A parameter study: its axes, what came out, run times, and the records of its trials."""

    axes: Sequence[Axis]
    table: pd.DataFrame
    times: pd.DataFrame
    records: Records

    @property
    def trials(self) -> int:
        """The number of trials in each cell, where they are not those of several seeds."""
        return _unseeded(self.records).sweep.trials


def read_records(paths: Iterable[Path]) -> Records:
    """Read the records of tables of trials."""
    return {path: read_record(path) for path in paths}


def read_replicates(paths: Iterable[Path]) -> tuple[Records, Claims]:
    """Read the records of replicate studies, which differ in their number alone.

    Returned with them are the claims that they are made for.
    """
    records = read_records(paths)
    claims = load_claims(max(len(records), 2))
    check_alike(claims, list(records), list(records.values()))
    return records, claims


def read_verdicts(path: Path, claims: Claims) -> pd.DataFrame:
    """Read the verdicts on the claims."""
    rows: list[Row] = [
        {key: getattr(claim, key) for key in CLAIM}
        | {"statistic": claim.describe(), "criterion": claim.criterion or "the paper's number"}
        | {"replicates": claims.replicates, "implied_by": " ".join(claim.implied_by) or None}
        for claim in claims.claims.values()
    ]
    titles = [reading_title(decision, reading) for decision, reading, _ in claims.read()]
    table = _read_rows(path, rows, NUMBERS, [*WORDS, *titles])
    _check_estimates(path, table)
    return table


def read_readings(path: Path, claims: Claims) -> pd.DataFrame:
    """Read what the claims would say under other readings."""
    rows: list[Row] = [
        {"decision": decision.id, "reading": reading.reading, "claim": name}
        | {"replicates": claims.replicates_of_readings}
        for decision, reading, changed in claims.read()
        for name in changed
    ]
    taken: Row = {"decision": TAKEN, "reading": TAKEN, "replicates": claims.replicates_of_readings}
    rows = [*({**taken, "claim": name} for name in claims.claims), *rows]
    table = _read_rows(path, rows, NUMBERS, list(WORDS))
    _check_estimates(path, table)
    return table


def _check_estimates(path: Path, table: pd.DataFrame) -> None:
    for column, words in WORDS.items():
        unknown = table.loc[~table[column].isin(words), column]
        if not unknown.empty:
            raise TableError(path, f"has an unknown {column} {unknown.iloc[0]!r}")
    # A claim may be inconclusive for want of a number.
    _require_values(path, table.loc[table["verdict"] != INCONCLUSIVE, list(NUMBERS)])


def read_order(path: Path) -> pd.DataFrame:
    """Read which metric orders neighbouring levels best."""
    texts = ("experiment", "level", "metric", "versus")
    numbers = ("order", "low", "high", "p", "trials", "cameras")
    types = {**dict.fromkeys(texts, str), **dict.fromkeys(numbers, float)}
    table = read_table(path, list(types), dtype=types)
    _require_values(path, table[["order", "low", "high"]])
    return table


def read_table1(path: Path) -> pd.DataFrame:
    """Read Table 1."""
    rows: list[Row] = [{"metric": name, "property": each} for name in PAPER for each in PROPERTIES]
    answers = ("paper", "ours", "agrees", "statistic", "experiment", "sensitivity")
    table = _read_rows(path, rows, ["value"], answers)
    _require_values(path, table.loc[table["ours"] != "not tested", ["value"]])
    return table


def read_thresholds(files: Namespace) -> Parameters:
    """Read the threshold study; its axes have the values that its trials have."""
    records = read_records(files.threshold_parts)
    axes = axes_of("threshold", _unseeded(records).metrics)
    effects = [*EFFECTS, *(f"{name}_{what}" for name in COMPARED for what in ("error", "p"))]
    tables = []
    for path in files.thresholds:
        rows: list[Row] = [
            {"axis": axis.name, "value": value, "paper": "yes" if value == axis.paper else "no"}
            for axis in axes
            for value in axis.values
            if axis.name.startswith(f"{path.stem.rpartition('_')[-1]}_")
        ]
        tables.append(_read_rows(path, rows, effects, required=["noise_power"]))
    table = pd.concat(tables, ignore_index=True)
    _require("table of", [axis.name for axis in axes], set(table["axis"]))
    return Parameters(axes, table, _read_times(files.threshold_times, axes, records), records)


def read_registrations(files: Namespace) -> Parameters:
    """Read the registration study; its axis has the values that its trials have."""
    records, path = read_records(files.registration_parts), files.registrations
    axes = axes_of("registration", _unseeded(records).metrics)
    values = [value for axis in axes for value in axis.values]
    numbers = ("n_cameras", "n_outliers", "sigma_t", "trial", *values)
    columns = ["part", "geometry", *numbers, "statistic"]
    table = read_table(path, columns, dtype={"part": str, **dict.fromkeys(numbers, float)})
    found, parts = set(table["part"]), {part.stem: record for part, record in records.items()}
    seeded = {part for part, record in parts.items() if is_seeded(record.metrics)}
    if others := (found - set(parts)) | (seeded - found):
        raise TableError(path, f"was made for something else: see part {min(others)}")
    _require_values(path, table[values])
    return Parameters(axes, table, _read_times(files.registration_times, axes, records), records)


def _read_times(path: Path, axes: Sequence[Axis], records: Records) -> pd.DataFrame:
    seeded = [record.sweep for record in records.values() if is_seeded(record.metrics)]
    rows: list[Row] = [
        {"n_cameras": n, "axis": axis.name, "value": value}
        for n in sorted({n for sweep in seeded for n in sweep.n_cameras})
        for axis in axes
        for value in axis.values
    ]
    return _read_rows(path, rows, required=["milliseconds"])


def _unseeded(records: Records) -> Record:
    """Return the first record of trials that are registered once each."""
    for record in records.values():
        if not is_seeded(record.metrics):
            return record
    raise CommandError("a parameter study needs trials that are registered once each, too")


def read_findings(path: Path, scenarios: Records) -> pd.DataFrame:
    """Read what the scenarios show."""
    rows: list[Row] = [
        {"scenario": scenario.stem, "metric": metric}
        for scenario, record in scenarios.items()
        for metric in record.metrics
    ]
    return _read_rows(path, rows, list(POWERS.values()), ["finding"], ["mean"])


def read_frame_rates(path: Path) -> list[rates.Summary]:
    """Read what the frame rate does to each metric."""
    return rates.summaries(read_table(path, [*rates.KEYS, *rates.FOUND]))


def read_maps(path: Path) -> list[str]:
    """Read what the maps of thresholds say."""
    return maps.sentences(read_table(path, maps.COLUMNS))


def read_today(path: Path, questions: Records) -> pd.DataFrame:
    """Read what today's protocols and the new scores order in each question."""
    table = read_table(path, [*KEYS, *FOUND])
    expected = {
        (one.stem, metric) for one, record in questions.items() for metric in record.metrics
    }
    found = set(zip(table["question"], table["metric"], strict=True))
    if others := expected ^ found:
        raise TableError(path, f"was made for something else: see {' '.join(min(others))}")
    _require_values(path, table[["order"]])
    return table


def read_figures(paths: Iterable[Path], scenario_study: str) -> dict[str, Image.Image]:
    """Read the figures, with that of a study of scenarios; the names are those of the files."""
    figures = {path.stem: _read_figure(path) for path in paths}
    needed = [scenario_study if name == "beyond" else name for name in FIGURES]
    _require("figure", needed, figures)
    return figures


def _read_figure(path: Path) -> Image.Image:
    try:
        with Image.open(path, formats=["PNG"]) as image:
            image.load()
            return image
    except FileNotFoundError:
        raise TableError(path, "does not exist") from None
    except (OSError, SyntaxError, ValueError):
        raise TableError(path, "is not a PNG") from None


def read_jobs(paths: Iterable[Path]) -> pd.DataFrame:
    """Read the benchmarks that there are, for not everything is run by Snakemake.

    Returns
    -------
    DataFrame
        One row a job: the `folder` of its results, seconds, processor time, megabytes; empty where
        Snakemake did not measure one.
    """
    tables = []
    for path in paths:
        with suppress(OSError, ValueError):
            row = pd.read_csv(path, sep="\t", usecols=JOB, na_values="-", nrows=1, dtype=float)
            tables.append(row.assign(folder=path.parent.name))
    return pd.concat(tables) if tables else pd.DataFrame(columns=["folder", *JOB])


def _read_rows(
    path: Path,
    rows: Sequence[Row],
    numbers: Sequence[str] = (),
    texts: Sequence[str] = (),
    required: Sequence[str] = (),
) -> pd.DataFrame:
    """Read a table that has these rows, and columns of numbers and texts; `required` are full."""
    expected = pd.DataFrame(rows)
    types = {**expected.dtypes, **dict.fromkeys([*numbers, *required], float)}
    types |= dict.fromkeys(texts, str)
    table = read_table(path, list(types), dtype=types)
    if len(table) != len(expected):
        raise TableError(path, f"has {len(table)} rows, not {len(expected)}")
    found = table[list(expected)]
    differs = (found != expected) & ~(found.isna() & expected.isna())
    for row, column in np.argwhere(differs.to_numpy()):
        name, other = list(expected)[column], str(found.iat[row, column])
        problem = f"line {row + 2} has the {name} {other}, not {rows[row][name]}"
        raise TableError(path, f"was made for something else: {problem}")
    _require_values(path, table[list(required)])
    return table


def _require_values(path: Path, table: pd.DataFrame) -> None:
    for column in table:
        if not np.isfinite(table[column]).all():
            raise TableError(path, f"lacks values of {column}")


def _require(kind: str, names: Iterable[str], found: Container[str]) -> None:
    for name in names:
        if name not in found:
            raise CommandError(f"the page needs the {kind} {name}, too")
