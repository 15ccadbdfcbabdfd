"""Result tables on disk: whole or not at all, with their provenance beside them."""

import json
import platform
import subprocess
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from .config import CONFIG_DIR, Config

__all__ = ["provenance", "read_trials", "write_text", "write_trials"]

PACKAGES = ("alignscores", "numpy", "scipy", "pandas", "evo", "joblib", "hydra-core")


def write_text(path: Path, text: str) -> None:
    """Write a file under a temporary name, then rename it: never half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.tmp")
    temporary.write_text(text, encoding="utf-8", newline="\n")
    temporary.replace(path)


def write_trials(config: Config, trials: pd.DataFrame) -> Path:
    """Write ``<results_dir>/trials/<experiment>.csv`` and its provenance; return the path.

    Numbers are written with the fewest digits that give the same float again.
    """
    path = Path(config.results_dir) / "trials" / f"{config.name}.csv"
    write_text(path.with_suffix(".json"), json.dumps(provenance(config), indent=2) + "\n")
    write_text(path, trials.to_csv(index=False, lineterminator="\n"))
    return path


def read_trials(path: Path) -> pd.DataFrame:
    """Read a table of trials, bit for bit as it was computed."""
    return pd.read_csv(path)


def provenance(config: Config) -> dict[str, Any]:
    """Return what a result rests on: settings, package versions, commit and platform."""
    return {
        "config": asdict(config),
        "packages": {name: version(name) for name in PACKAGES},
        "git": _git_state(),
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def _git_state() -> dict[str, Any] | None:
    """Return the commit of the source tree and whether it has changes; None outside of git."""
    try:
        commit = _git("rev-parse", "HEAD")
        return {"commit": commit, "dirty": bool(_git("status", "--porcelain"))}
    except (OSError, subprocess.CalledProcessError):
        return None


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", *arguments], cwd=CONFIG_DIR, check=True, capture_output=True, text=True
    ).stdout.strip()
