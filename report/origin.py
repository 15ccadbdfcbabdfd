"""Where the results come from: settings, machines, run times and the command to repeat them."""

import json
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

from experiments.config import HOW, load, to_overrides
from experiments.scenarios import BEYOND
from experiments.study import default_axes

from .inputs import Inputs, Job

__all__ = ["Machine", "Runtime", "command", "machines", "runtimes", "write_levels"]


@dataclass(frozen=True)
class Machine:
    """A source tree and a machine, with the tables, or folders of them, that were made there."""

    tables: Sequence[str]
    record: Mapping[str, Any]


@dataclass(frozen=True)
class Runtime:
    """What the jobs of a rule took together."""

    rule: str
    n_jobs: int
    seconds: str
    longest: str
    cpu_seconds: str
    megabytes: str


def machines(inputs: Inputs) -> list[Machine]:
    """Group the tables by the code, the packages and the platform that they were made with."""
    groups: dict[str, list[str]] = {}
    tables = {f"trials/{name}": record for name, record in inputs.experiments.items()}
    tables |= {f"replicates/{name}": record for name, record in inputs.replicates.items()}
    tables |= {f"trials/{name}": record for name, record in inputs.parts.items()}
    for name, record in tables.items():
        machine = {key: record[key] for key in ("git", "python", "platform", "packages")}
        groups.setdefault(json.dumps(machine, sort_keys=True), []).append(name)
    folders = Counter(map(_folder, tables))
    return [
        Machine(_shorten(names, folders), json.loads(machine)) for machine, names in groups.items()
    ]


def _shorten(names: Sequence[str], folders: Mapping[str, int]) -> list[str]:
    """Name a folder in place of all tables in it."""
    found = Counter(map(_folder, names))
    whole = {folder for folder in found if found[folder] == folders[folder]}
    shortened = (
        f"{_folder(name)}/ ({folders[_folder(name)]})" if _folder(name) in whole else name
        for name in names
    )
    return list(dict.fromkeys(shortened))


def _folder(name: str) -> str:
    return name.rpartition("/")[0]


def command(inputs: Inputs) -> str:
    """Return the command that repeats the results: what differs from ``configs/``, and no places.

    Settings are shared by all experiments, as `snakemake --config` shares them.
    """
    changed: dict[str, Any] = {}
    for name, record in inputs.experiments.items():
        defaults = asdict(load([f"experiment={name}"]))
        for key, value in record["config"].items():
            if key not in HOW and value != defaults.get(key):
                changed[key] = value
    plan = inputs.plan
    if inputs.n_replicates != plan.claims.replicates:
        changed["replicates"] = inputs.n_replicates
    axes = {name: axis for study in plan.studies.values() for name, axis in study.axes.items()}
    for name, default in default_axes().items():
        if axes[name].values != default.values:
            changed[name] = list(axes[name].values)
    if plan.scenario_file.resolve() != BEYOND:
        changed["scenarios"] = plan.scenario_file.name
    settings = ["--config", *to_overrides(changed)] if changed else []
    return shlex.join(["snakemake", "report", *settings])


def runtimes(jobs: Mapping[str, Sequence[Job]]) -> list[Runtime]:
    """Sum the jobs of each rule, and of all."""
    parts = {**jobs, "all": [job for group in jobs.values() for job in group]} if jobs else {}
    return [_runtime(rule, group) for rule, group in parts.items()]


def _runtime(rule: str, jobs: Sequence[Job]) -> Runtime:
    seconds = [job.seconds for job in jobs if isfinite(job.seconds)]
    cpu_seconds = [job.cpu_seconds for job in jobs if isfinite(job.cpu_seconds)]
    megabytes = [job.megabytes for job in jobs if isfinite(job.megabytes)]
    return Runtime(
        rule,
        len(jobs),
        seconds=_write_seconds(sum(seconds)) if seconds else "–",
        longest=_write_seconds(max(seconds)) if seconds else "–",
        cpu_seconds=_write_seconds(sum(cpu_seconds)) if cpu_seconds else "–",
        megabytes=f"{max(megabytes):.0f} MB" if megabytes else "–",
    )


def _write_seconds(seconds: float) -> str:
    """Write a duration.

    Examples
    --------
    >>> _write_seconds(7.43), _write_seconds(59.97), _write_seconds(3725.4)
    ('7.4 s', '1 min 00 s', '1 h 02 min 05 s')
    """
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
