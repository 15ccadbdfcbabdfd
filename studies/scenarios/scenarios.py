"""Scenarios: the main experiment under other paths, errors and outliers, from a file of YAML.

The file is `configs/study/beyond.yaml` or one's own.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from experiments.command import ConfigError
from experiments.config import CONFIG_DIR, EXECUTION, Sweep, load_sweep, read_yaml

from ..study import Study, Table

__all__ = ["BEYOND", "load_scenarios", "study_name"]

BEYOND = CONFIG_DIR / "study" / "beyond.yaml"
KEYS = ("settings", "scenarios")

Settings = dict[str, Any]


def load_scenarios(path: Path = BEYOND, overrides: Sequence[str] = ()) -> Study:
    """Read a file of scenarios.

    Parameters
    ----------
    path : Path
        A YAML file with `scenarios`, settings by name, and if need be `settings`, which all of them
        share. What neither sets is as in `configs/study/beyond.yaml`.
    overrides : sequence of str
        Hydra overrides for all scenarios, which win over the file.

    Returns
    -------
    Study
        Called "beyond", or "beyond_" and the name of one's own file; a table for each scenario.

    Raises
    ------
    ConfigError
        In one line that names the file and the scenario, where something is missing, unknown or
        impossible.

    Examples
    --------
    >>> from studies.scenarios.scenarios import load_scenarios
    >>> study = load_scenarios(overrides=["trials=5"])
    >>> drift = study.tables["drift"].sweeps[0]
    >>> study.name, drift.name, drift.geometry, drift.error
    ('beyond', 'beyond/drift', 'car', 'drift')
    """
    name = study_name(path)
    shared, settings, scenarios = _read(path)
    tables = {
        scenario: Table((_resolve(path, scenario, shared | settings | own, overrides),))
        for scenario, own in scenarios.items()
    }
    return Study(name, tables)


def study_name(path: Path) -> str:
    """Return what the results of a file of scenarios are called."""
    return "beyond" if path.resolve() == BEYOND else f"beyond_{path.stem}"


def _resolve(path: Path, name: str, settings: Settings, overrides: Sequence[str]) -> Sweep:
    try:
        sweep = load_sweep(overrides, settings)
    except ConfigError as error:
        raise ConfigError(f"{path}: scenario {name!r}: {error}") from None
    paired = sweep.noise == "paired"
    _require(path, paired, f"scenario {name!r} needs noise=paired: one order of levels")
    ordered = len(sweep.sigma_t) > 1 or len(sweep.n_outliers) > 1
    _require(path, ordered, f"scenario {name!r} needs two levels of noise, or numbers of outliers")
    return replace(sweep, name=f"{study_name(path)}/{name}")


def _read(path: Path) -> tuple[Settings, Settings, dict[str, Settings]]:
    """Return the settings that all studies share, and the settings and scenarios of a file."""
    _require(path, _is_name(path.stem), "needs a name of letters, digits and underscores")
    content = {file: read_yaml(file) for file in (BEYOND, path)}
    for key in content[path]:
        _require(path, key in KEYS, f"has an unknown key {key!r}; the keys are {', '.join(KEYS)}")
    settings, scenarios = (content[path].get(key, {}) for key in KEYS)
    _require(path, isinstance(settings, dict), "needs key: value under settings")
    _require(path, isinstance(scenarios, dict) and bool(scenarios), "has no scenarios")
    for name, own in scenarios.items():
        _require(path, _is_name(name), f"scenario {name!r} may have letters, digits, underscores")
        _require(path, isinstance(own, dict), f"scenario {name!r} needs {{key: value, ...}}")
    for own in (settings, *scenarios.values()):
        for key in EXECUTION:
            _require(path, key not in own, f"may not set {key}, which is one for all: --config")
    return content[BEYOND]["settings"], settings, scenarios


def _is_name(name: object) -> bool:
    return isinstance(name, str) and bool(re.fullmatch(r"[A-Za-z0-9_]+", name))


def _require(path: Path, condition: bool, problem: str) -> None:
    if not condition:
        raise ConfigError(f"{path} {problem}")
