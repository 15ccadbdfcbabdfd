"""Where the results come from: settings, machines, run times and the command to repeat them."""

import json
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isnan
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.tables import Record

__all__ = ["NONE", "Machine", "command", "machines", "runtimes", "write_levels"]

NONE = "–"


@dataclass(frozen=True)
class Machine:
    """A source tree and a machine, with the tables, or folders of them, that were made there."""

    tables: Sequence[str]
    origin: Mapping[str, Any]


def machines(records: Mapping[Path, Record]) -> list[Machine]:
    """Group tables by the code, the packages and the platform that they were made with."""
    groups: dict[str, list[Path]] = {}
    for path, record in records.items():
        groups.setdefault(json.dumps(record.origin, sort_keys=True), []).append(path)
    sizes = Counter(path.parent for path in records)
    return [Machine(_shorten(paths, sizes), json.loads(key)) for key, paths in groups.items()]


def _shorten(paths: Sequence[Path], sizes: Mapping[Path, int]) -> list[str]:
    """Name a folder in place of all tables in it."""
    found = Counter(path.parent for path in paths)
    names = [
        f"{path.parent.name}/ ({found[path.parent]})"
        if found[path.parent] == sizes[path.parent]
        else f"{path.parent.name}/{path.stem}"
        for path in paths
    ]
    return list(dict.fromkeys(names))


def command(settings: Sequence[str]) -> str:
    """Return the command that repeats the results.

    Examples
    --------
    >>> command(["trials=5", "sigma_t=[0.05]"]), command([])
    ("snakemake report --config trials=5 'sigma_t=[0.05]'", 'snakemake report')
    """
    given = ["--config", *settings] if settings else []
    return shlex.join(["snakemake", "report", *given])


def runtimes(jobs: pd.DataFrame) -> dict[str, dict[str, str]]:
    """Sum the jobs of each folder of results, and of all: numbers by what they are."""
    groups = {str(folder): group for folder, group in jobs.groupby("folder", sort=False)}
    whole = {"all": jobs} if groups else {}
    return {folder: _sum(group) for folder, group in {**groups, **whole}.items()}


def _sum(jobs: pd.DataFrame) -> dict[str, str]:
    memory = jobs["max_rss"].max()
    return {
        "Jobs": str(len(jobs)),
        "Time": _write_seconds(jobs["s"].sum(min_count=1)),
        "Longest job": _write_seconds(jobs["s"].max()),
        "Processor time": _write_seconds(jobs["cpu_time"].sum(min_count=1)),
        "Largest memory": NONE if isnan(memory) else f"{memory:.0f} MB",
    }


def _write_seconds(seconds: float) -> str:
    """Write a duration.

    Examples
    --------
    >>> _write_seconds(7.43), _write_seconds(59.97), _write_seconds(3725.4)
    ('7.4 s', '1 min 00 s', '1 h 02 min 05 s')
    """
    if isnan(seconds):
        return NONE
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min {rest:02} s" if hours else f"{minutes} min {rest:02} s"


def write_levels(values: Sequence[float]) -> str:
    """Write the values of a setting, shortened where they rise in even steps.

    Examples
    --------
    >>> write_levels([0.01, 0.02, 0.03, 0.04, 0.05]), write_levels([0, 1, 10])
    ('0.01, 0.02, …, 0.05', '0, 1, 10')
    """
    steps = {round(after - before, 9) for before, after in pairwise(values)}
    if len(values) > 4 and len(steps) == 1:
        return f"{values[0]:g}, {values[1]:g}, …, {values[-1]:g}"
    return ", ".join(f"{value:g}" for value in values)
