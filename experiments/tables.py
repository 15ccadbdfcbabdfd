"""Result tables on disk: whole or not at all, with their provenance beside them."""

import json
import os
import platform
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from .command import CommandError
from .config import CONFIG_DIR, Config, result_settings

__all__ = [
    "KEY_COLUMNS",
    "TableError",
    "check_settings",
    "package_versions",
    "provenance",
    "read_csv",
    "read_provenance",
    "read_trials",
    "to_csv",
    "trials_path",
    "write_files",
    "write_table",
    "write_trials",
]

KEY_COLUMNS = (
    "experiment",
    "geometry",
    "n_cameras",
    "n_outliers",
    "sigma_t",
    "sigma_r_deg",
    "replicate",
    "trial",
)
PACKAGES = (
    "alignscores",
    "numpy",
    "scipy",
    "pandas",
    "evo",
    "joblib",
    "threadpoolctl",
    "hydra-core",
    "matplotlib",
    "snakemake",
)


class TableError(CommandError):
    """A table that is missing, damaged or another one than it should be.

    Parameters
    ----------
    path : Path
        The table.
    problem : str
        What is wrong with it, to be read behind its path.
    command : sequence of str
        What makes a better one: a module of the project and its arguments.
    """

    def __init__(self, path: Path, problem: str, command: Sequence[str] = ()) -> None:
        remedy = f"; run: {shlex.join(['python', '-m', *command])}" if command else ""
        super().__init__(f"{path} {problem}{remedy}")


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write files under temporary names, then rename them: never half a file.

    Raises
    ------
    OSError
        Where one cannot be written; it has the name of that file, not of the temporary one.
    """
    # Of this process: another one may be writing the same, as one that outlived a killed Snakemake.
    temporary = {path: path.with_name(f".{path.name}.{os.getpid()}") for path in files}
    try:
        for path in files:
            path.parent.mkdir(parents=True, exist_ok=True)
        try:
            for path, content in files.items():
                temporary[path].write_bytes(content)
            for path in files:
                temporary[path].replace(path)
        finally:
            for leftover in temporary.values():
                leftover.unlink(missing_ok=True)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None


def to_csv(table: pd.DataFrame) -> bytes:
    """Return a table as CSV; numbers have the fewest digits that give the same float again."""
    return table.to_csv(index=False, lineterminator="\n").encode()


def read_csv(path: Path, command: Sequence[str] = (), **options: Any) -> pd.DataFrame:
    """Read a table; `command` is what makes it, `options` are those of pandas.

    Raises
    ------
    TableError
        Where it is not there or cannot be read.
    """
    try:
        table: pd.DataFrame = pd.read_csv(path, **options)
    except FileNotFoundError:
        raise TableError(path, "does not exist", command) from None
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise TableError(path, f"cannot be read ({reason})", command) from None
    return table


def trials_path(config: Config) -> Path:
    """Return the path of an experiment's table of trials."""
    return Path(config.results_dir) / "trials" / f"{config.name}.csv"


def write_trials(config: Config, trials: pd.DataFrame, path: Path | None = None) -> Path:
    """Write the trials of an experiment and their provenance; return where, see `trials_path`."""
    path = path or trials_path(config)
    write_table(path, trials, provenance(config))
    return path


def write_table(path: Path, table: pd.DataFrame, origin: Mapping[str, Any]) -> None:
    """Write a table as CSV and what it rests on as JSON beside it."""
    text = json.dumps(origin, indent=2) + "\n"
    write_files({path.with_suffix(".json"): text.encode(), path: to_csv(table)})


def read_trials(
    config: Config, path: Path | None = None, command: Sequence[str] = ()
) -> pd.DataFrame:
    """Read the trials of an experiment, bit for bit as they were computed.

    Parameters
    ----------
    config : Config
        The experiment.
    path : Path, optional
        The table; by default that of `trials_path`.
    command : sequence of str
        What makes the table, to be named where it does not do.

    Returns
    -------
    DataFrame
        At least one row, all key columns, and the metrics of the experiment.

    Raises
    ------
    TableError
        Where there is no such table, or it is empty, another one, or made under other settings.
    """
    path = path or trials_path(config)
    table = read_csv(path, command)
    missing = [column for column in KEY_COLUMNS if column not in table]
    if missing:
        problem = f"is no table of trials: it has no column {missing[0]}"
        raise TableError(path, problem, command)
    if table.empty:
        raise TableError(path, "has no trials", command)
    if set(table["experiment"]) != {config.name}:
        other = table["experiment"].iloc[0]
        raise TableError(path, f"has trials of experiment {other!r}", command)
    missing = [metric for metric in config.metrics if metric not in table]
    if missing:
        raise TableError(path, f"has no column {missing[0]}", command)
    check_settings(config, path, command)
    return table


def check_settings(config: Config, path: Path, command: Sequence[str] = ()) -> None:
    """Make sure that a table was made under these settings, from the record beside it.

    Metrics may differ: the table has a column for each.

    Raises
    ------
    TableError
        Where it was not, or there is no record; `command` makes a better one.
    """
    wanted = result_settings(config)
    found = read_provenance(path.with_suffix(".json"), command)["config"]
    for key, value in wanted.items():
        if key != "metrics" and (key not in found or found[key] != value):
            made = f"{key}={found[key]}" if key in found else f"no {key}"
            raise TableError(path, f"was made with {made}, not {key}={value}", command)


def read_provenance(path: Path, command: Sequence[str] = ()) -> dict[str, Any]:
    """Read what a result rests on, as `provenance` has it.

    Raises
    ------
    TableError
        Where the file is not there or is something else.
    """
    try:
        record = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise TableError(path, "does not exist", command) from None
    except OSError as error:
        raise TableError(path, f"cannot be read ({error.strerror})", command) from None
    except ValueError:
        record = None
    keys = ("config", "packages", "git", "python", "platform")
    whole = isinstance(record, dict) and all(key in record for key in keys)
    if not whole or not isinstance(record["config"], dict):
        raise TableError(path, "is no record of provenance", command)
    return dict(record)


def provenance(config: Config) -> dict[str, Any]:
    """Return what a result rests on: settings, package versions, commit and platform."""
    return {
        "config": asdict(config),
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
