"""Tables of trials on disk: whole or not at all, each with the record of what it rests on."""

import json
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import Field, TypeAdapter, ValidationError

from alignscores.writing import write_whole

from .command import CommandError
from .config import CONFIG_DIR, Sweep
from .grid import evaluations

__all__ = ["SWEEPS", "Record", "TableError", "Trials", "read_record", "read_table"]
__all__ += ["read_trials", "refuse_to_replace", "to_csv", "write_files", "write_trials"]

SWEEPS = TypeAdapter[tuple[Sweep, ...]](Annotated[tuple[Sweep, ...], Field(min_length=1)])
"""Reads and writes the sweeps of a table as JSON."""

PACKAGES = (
    "alignscores",
    "numpy",
    "scipy",
    "pandas",
    "joblib",
    "evo",
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
    """Provenance of a table of trials: its settings, and the versions that computed it."""

    sweeps: tuple[Sweep, ...]
    origin: Mapping[str, Any]  # package versions, commit, Python and platform

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
        """The settings of the first sweep, usually the only one."""
        return self.record.sweeps[0]


def write_files(files: Mapping[Path, bytes]) -> list[Path]:
    """Write files, each as a whole or not at all, with their folders, and return their paths."""
    for path, content in files.items():
        try:
            write_whole(path, content)
        except ValueError as error:
            raise CommandError(f"{path} {error}") from None
    return list(files)


def to_csv(table: pd.DataFrame) -> bytes:
    """Return a table as CSV; numbers have the fewest digits that give the same float again."""
    return table.to_csv(index=False, lineterminator="\n").encode()


def refuse_to_replace(path: Path) -> None:
    """Create the folder of a table; raise if the table or its record exists."""
    for file in (path, path.with_suffix(".json")):
        if os.path.lexists(file):
            raise CommandError(f"{file} exists, and is not replaced; name another file")
    path.parent.mkdir(parents=True, exist_ok=True)


def write_trials(path: Path, table: pd.DataFrame, sweeps: Sequence[Sweep]) -> None:
    """Write a table of trials as CSV, and its record next to it as JSON; replace neither."""
    content = to_csv(table)
    settings = SWEEPS.dump_python(tuple(sweeps))
    record = {"sweeps": settings, "sha256": sha256(content).hexdigest(), **_origin()}
    text = json.dumps(record, indent=2) + "\n"
    refuse_to_replace(path)
    record_path = path.with_suffix(".json")
    try:
        with record_path.open("x", encoding="utf-8") as file:  # one of two runs at the same time
            file.write(text)
    except FileExistsError:
        raise CommandError(f"{record_path} exists, and is not replaced") from None
    try:
        write_files({path: content})
    except BaseException:
        record_path.unlink()
        raise


def read_table(path: Path, columns: Sequence[str] = (), **options: Any) -> pd.DataFrame:
    """Read a table that has some columns; `options` go to `pandas.read_csv`."""
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
    """Read the record next to a table of trials; refuse a table that was changed."""
    record_path = path.with_suffix(".json")
    try:
        content, text = path.read_bytes(), record_path.read_bytes()
    except FileNotFoundError as error:
        raise TableError(Path(error.filename), "does not exist") from None
    except OSError as error:
        raise TableError(Path(error.filename), f"cannot be read ({error.strerror})") from None
    try:
        record = json.loads(text)
        sweeps, digest = SWEEPS.validate_json(json.dumps(record["sweeps"])), record["sha256"]
        keys = ("packages", "git", "python", "platform")
        result = Record(sweeps, {key: record[key] for key in keys})
    except (AttributeError, KeyError, RecursionError, TypeError, ValidationError, ValueError):
        raise TableError(record_path, "is not the record of a table of trials") from None
    if digest != sha256(content).hexdigest():
        raise TableError(path, f"was changed, or {record_path.name} is not its record")
    return result


def read_trials(path: Path) -> Trials:
    """Read trials, bit for bit as they were computed, with the record of what they rest on."""
    record = read_record(path)
    text = {"dtype": {"settings": str}, "keep_default_na": False, "na_values": [""]}
    table = read_table(path, record.metrics, **text)
    if "settings" in table:
        table["settings"] = table["settings"].fillna("")
    return Trials(path, table, record)


def _origin() -> dict[str, Any]:
    return {
        "packages": {name: version(name) for name in PACKAGES},
        "git": _git_state(),
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def _git_state() -> str | None:
    """Return the commit of the source tree, with -dirty if it has changes; None outside of git."""
    # The archive of a release may lie in another repository: only our own .git counts.
    command = ["git", "--git-dir=.git", "describe"]
    command += ["--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        return subprocess.run(
            command, cwd=CONFIG_DIR.parent, check=True, capture_output=True, text=True
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
