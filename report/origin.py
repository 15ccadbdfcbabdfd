"""Where the results come from: settings, machines, run times and the command to repeat them."""

import json
import re
import shlex
from collections import defaultdict
from collections.abc import Mapping, Sequence
from math import isnan
from typing import Any

import pandas as pd

from experiments.tables import Record
from studies.words import NONE


def machines(records: Mapping[str, Mapping[str, Record]]) -> list[dict[str, Any]]:
    """Group tables, or studies whose tables have all one, by the code and platform behind them."""
    groups: dict[str, list[str]] = defaultdict(list)
    for study, tables in records.items():
        origins = {
            f"{study}/{table}": json.dumps(record.origin, sort_keys=True)
            for table, record in tables.items()
        }
        if len(set(origins.values())) == 1:
            origins = {f"{study} ({len(tables)})": origins.popitem()[1]}
        for name, origin in origins.items():
            groups[origin].append(name)
    return [{"tables": names, "origin": json.loads(key)} for key, names in groups.items()]


def command(settings: Sequence[str]) -> str:
    """Return the command that repeats the results; files are named without their folders."""
    named = [re.sub(r"=.*/(.*\.ya?ml)$", r"=\1", setting) for setting in settings]
    return shlex.join(["snakemake", "report", *(["--config", *named] if named else [])])


def runtimes(jobs: pd.DataFrame) -> dict[str, dict[str, str]]:
    """Sum the jobs of each target, and of all: numbers by what they are."""
    sums = {str(target): _sum(group) for target, group in jobs.groupby("target", sort=False)}
    return {**sums, "all": _sum(jobs)} if sums else {}


def _sum(jobs: pd.DataFrame) -> dict[str, str]:
    memory = jobs["max_rss"].max()
    return {
        "Jobs": str(len(jobs)),
        "Time": _write_seconds(jobs["s"].sum(min_count=1)),
        "Longest job": _write_seconds(jobs["s"].max()),
        "Processor time": _write_seconds(jobs["cpu_time"].sum(min_count=1)),
        "Largest memory": NONE if isnan(memory) else f"{memory:.0f} MB",
    }


def time_of(jobs: pd.DataFrame, job: str) -> str:
    """Return how long a job took, in words."""
    return _write_seconds(jobs.loc[jobs["job"] == job, "s"].sum(min_count=1))


def _write_seconds(seconds: float) -> str:
    """Write a duration, in hours, minutes and seconds."""
    if isnan(seconds):
        return NONE
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min {rest:02} s" if hours else f"{minutes} min {rest:02} s"
