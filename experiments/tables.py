"""Result tables on disk: whole or not at all, with their provenance beside them."""

import json
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from .config import CONFIG_DIR, Config

__all__ = [
    "KEY_COLUMNS",
    "TableError",
    "package_versions",
    "provenance",
    "read_trials",
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


class TableError(ValueError):
    """A table that a figure cannot be drawn from.

    Parameters
    ----------
    experiment : str
        Whose table it is.
    problem : str
        What is wrong with it, to be read behind its path.
    setting : str
        What to run the experiment with to get a better one.
    """

    def __init__(self, experiment: str, problem: str, setting: str = "") -> None:
        super().__init__(problem)
        self.experiment = experiment
        self.setting = setting


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write files under temporary names, then rename them: never half a file."""
    temporary = {path: path.with_name(f"{path.name}.tmp") for path in files}
    for path in files:
        path.parent.mkdir(parents=True, exist_ok=True)
    try:
        for path, content in files.items():
            temporary[path].write_bytes(content)
        for path in files:
            temporary[path].replace(path)
    finally:
        for path in files:
            temporary[path].unlink(missing_ok=True)


def trials_path(config: Config) -> Path:
    """Return the path of an experiment's table of trials."""
    return Path(config.results_dir) / "trials" / f"{config.name}.csv"


def write_trials(config: Config, trials: pd.DataFrame) -> Path:
    """Write ``<results_dir>/trials/<experiment>.csv`` and its provenance; return the path.

    Numbers are written with the fewest digits that give the same float again.
    """
    path = trials_path(config)
    write_table(path, trials, provenance(config))
    return path


def write_table(path: Path, table: pd.DataFrame, origin: Mapping[str, Any]) -> None:
    """Write a table as CSV and what it rests on as JSON beside it."""
    text = json.dumps(origin, indent=2) + "\n"
    csv = table.to_csv(index=False, lineterminator="\n")
    write_files({path.with_suffix(".json"): text.encode(), path: csv.encode()})


def read_trials(config: Config, path: Path | None = None) -> pd.DataFrame:
    """Read the trials of an experiment, bit for bit as they were computed.

    Parameters
    ----------
    config : Config
        The experiment.
    path : Path, optional
        The table; by default that of `trials_path`.

    Returns
    -------
    DataFrame
        At least one row, and all key columns.

    Raises
    ------
    TableError
        Where there is no such table, or it is empty or another one.
    """
    try:
        table = pd.read_csv(path or trials_path(config))
    except FileNotFoundError:
        raise TableError(config.name, "does not exist") from None
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise TableError(config.name, f"cannot be read ({reason})") from None
    missing = [column for column in KEY_COLUMNS if column not in table]
    if missing:
        raise TableError(config.name, f"is no table of trials: it has no column {missing[0]}")
    if table.empty:
        raise TableError(config.name, "has no trials")
    if set(table["experiment"]) != {config.name}:
        raise TableError(config.name, f"has trials of experiment {table['experiment'].iloc[0]!r}")
    return table


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
