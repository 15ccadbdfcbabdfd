"""Tables of trials on disk: whole or not at all, each with the record of what it rests on."""

import json
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import Field, TypeAdapter, ValidationError

from alignscores import writing

from .command import CommandError
from .config import CONFIG_DIR, Sweep
from .grid import evaluations

__all__ = ["SWEEPS", "Record", "TableError", "Trials", "package_versions", "read_record"]
__all__ += ["read_table", "read_trials", "to_csv", "write_files", "write_recorded"]
__all__ += ["write_trials"]

SWEEPS = TypeAdapter[tuple[Sweep, ...]](Annotated[tuple[Sweep, ...], Field(min_length=1)])
"""Reads and writes the sweeps of a table as JSON."""

PACKAGES = (
    "alignscores",
    "numpy",
    "scipy",
    "pandas",
    "joblib",
    "threadpoolctl",
    "hydra-core",
    "pydantic",
    "matplotlib",
    "snakemake",
)


class TableError(CommandError):
    """A file of results that is missing, damaged or another one than it should be."""

    def __init__(self, path: Path, problem: str) -> None:
        remove = "delete it and " if path.exists() else ""
        super().__init__(f"{path} {problem}; {remove}run: snakemake {path}")


@dataclass(frozen=True)
class Record:
    """What a table of trials rests on: the settings, and the versions that it was made with."""

    sweeps: tuple[Sweep, ...]
    origin: Mapping[str, Any]  # package versions, commit, Python and platform

    @property
    def sweep(self) -> Sweep:
        """The settings of a table of one sweep, or of the first."""
        return self.sweeps[0]

    @cached_property
    def metrics(self) -> list[str]:
        """The metrics that are evaluated in any cell."""
        evaluated = [metrics for sweep in self.sweeps for metrics in evaluations(sweep).values()]
        return list(dict.fromkeys(metric for metrics in evaluated for metric in metrics))


@dataclass(frozen=True, eq=False)
class Trials:
    """A table of trials, one row a trial, with its record and the place that it was read from."""

    path: Path
    table: pd.DataFrame
    record: Record

    @property
    def sweep(self) -> Sweep:
        """The settings of a table of one sweep."""
        return self.record.sweep


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write files as a whole or not at all, with their folders; see `alignscores.writing`."""
    for path in files:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from None
    writing.write_files(files)


def to_csv(table: pd.DataFrame) -> bytes:
    """Return a table as CSV; numbers have the fewest digits that give the same float again."""
    return table.to_csv(index=False, lineterminator="\n").encode()


def write_trials(path: Path, table: pd.DataFrame, sweeps: Sequence[Sweep]) -> None:
    """Write a table of trials as CSV, and its record beside it as JSON."""
    write_recorded(path, to_csv(table), sweeps)


def write_recorded(path: Path, content: bytes, sweeps: Sequence[Sweep]) -> None:
    """Write what sweeps gave, and the record of what it rests on beside it as JSON."""
    settings = SWEEPS.dump_python(tuple(sweeps), mode="json", exclude_defaults=True)
    text = json.dumps({"sweeps": settings, **_origin()}, indent=2) + "\n"
    write_files({path.with_suffix(".json"): text.encode(), path: content})


def read_table(path: Path, columns: Sequence[str] = (), **options: Any) -> pd.DataFrame:
    """Read a table that has some columns; `options` are those of `pandas.read_csv`."""
    try:
        table: pd.DataFrame = pd.read_csv(path, **options)
    except FileNotFoundError:
        raise TableError(path, "does not exist") from None
    except (OSError, ValueError) as error:
        raise TableError(path, f"cannot be read ({' '.join(str(error).split())})") from None
    missing = [column for column in columns if column not in table]
    if missing:
        raise TableError(path, f"has no column {missing[0]}")
    return table


def read_record(path: Path) -> Record:
    """Read the record beside a table of trials."""
    place = path.with_suffix(".json")
    try:
        record = json.loads(place.read_bytes())
        sweeps = SWEEPS.validate_json(json.dumps(record.pop("sweeps")))
        keys = ("packages", "git", "python", "platform")
        return Record(sweeps, {key: record[key] for key in keys})
    except FileNotFoundError:
        raise TableError(place, "does not exist") from None
    except OSError as error:
        raise TableError(place, f"cannot be read ({error.strerror})") from None
    except (AttributeError, KeyError, TypeError, ValidationError, ValueError):
        raise TableError(place, "is not the record of a table of trials") from None


def read_trials(path: Path) -> Trials:
    """Read trials, bit for bit as they were computed, with the record of what they rest on."""
    record = read_record(path)
    expected = _expected_keys(record.sweeps)
    text = {"dtype": {"settings": str}, "keep_default_na": False, "na_values": [""]}
    table = read_table(path, [*expected, *record.metrics], **text)
    if "settings" in table:
        table["settings"] = table["settings"].fillna("")
    if len(table) != len(expected):
        problem = f"has {len(table)} trials, not the {len(expected)} of the record beside it"
        raise TableError(path, problem)
    for key, wanted in expected.items():
        if list(table[key]) != list(wanted):
            raise TableError(path, f"has other trials than the record beside it: see {key}")
    return Trials(path, table, record)


def _expected_keys(sweeps: Sequence[Sweep]) -> pd.DataFrame:
    """Return the key columns of the table that sweeps make."""
    rows = [
        {"experiment": sweep.name, "settings": sweep.changes, "geometry": sweep.geometry}
        | vars(cell)
        | {"replicate": sweep.replicate, "trial": trial}
        for sweep in sweeps
        for cell in evaluations(sweep)
        for trial in range(sweep.trials)
    ]
    table = pd.DataFrame(rows)
    return table if len(sweeps) > 1 else table.drop(columns="settings")


def _origin() -> dict[str, Any]:
    return {
        "packages": package_versions(),
        "git": _git_state(),
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def package_versions() -> dict[str, str]:
    """Return the versions, in this process, of the packages that results rest on."""
    return {name: version(name) for name in PACKAGES}


def _git_state() -> dict[str, Any] | None:
    """Return the commit of the source tree and whether it has changes; None outside of git."""
    try:
        if _git("rev-parse", "--show-prefix") != f"{CONFIG_DIR.name}/":
            return None  # a source archive that was unpacked inside another repository
        commit = _git("rev-parse", "HEAD")
        return {
            "commit": commit,
            "dirty": bool(_git("status", "--porcelain", "--untracked-files=no")),
        }
    except (OSError, subprocess.CalledProcessError):
        return None


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", *arguments], cwd=CONFIG_DIR, check=True, capture_output=True, text=True
    ).stdout.strip()
