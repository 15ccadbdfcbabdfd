"""Run one scenario of a study: ``python -m experiments.scenarios NAME [key=value ...]``.

A study is a file of scenarios, `configs/study/beyond.yaml` or one's own: the same experiment under
other paths, errors and outliers.
"""

import re
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from .command import run_command
from .config import CONFIG_DIR, Config, ConfigError, load, to_overrides
from .run import run

__all__ = ["BEYOND", "Study", "load_scenario", "load_study", "main", "study_name"]

BEYOND = CONFIG_DIR / "study" / "beyond.yaml"
KEYS = ("settings", "scenarios")

Settings = dict[str, Any]


@dataclass(frozen=True)
class Study:
    """Scenarios that are looked at side by side.

    Parameters
    ----------
    name : str
        "beyond", or "beyond_" and the name of one's own file: what its results are called.
    scenarios : mapping of str to Config
        The settings of each scenario.
    """

    name: str
    scenarios: Mapping[str, Config]

    @property
    def results_dir(self) -> str:
        """Where results go, the same for all scenarios."""
        return next(iter(self.scenarios.values())).results_dir


def load_study(path: Path = BEYOND, overrides: Sequence[str] = ()) -> Study:
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
        The resolved and checked settings of all scenarios.

    Raises
    ------
    ConfigError
        In one line that names the file and the scenario, where something is missing, unknown or
        impossible.

    Examples
    --------
    >>> from experiments.scenarios import load_study
    >>> study = load_study(overrides=["trials=5"])
    >>> study.name, study.scenarios["drift"].geometry, study.scenarios["drift"].error
    ('beyond', 'car', 'drift')
    """
    shared, settings, scenarios = _read(path)
    configs = {
        name: _resolve(path, name, shared | settings | own, overrides)
        for name, own in scenarios.items()
    }
    return Study(study_name(path), configs)


def load_scenario(name: str, path: Path = BEYOND, overrides: Sequence[str] = ()) -> Config:
    """Read one scenario of a file; see `load_study`."""
    shared, settings, scenarios = _read(path)
    if name not in scenarios:
        names = ", ".join(scenarios)
        raise ConfigError(f"{path}: unknown scenario {name!r}; the scenarios are {names}")
    return _resolve(path, name, shared | settings | scenarios[name], overrides)


def study_name(path: Path) -> str:
    """Return what the results of a file of scenarios are called."""
    return "beyond" if path.resolve() == BEYOND else f"beyond_{path.stem}"


def _resolve(path: Path, name: str, settings: Settings, overrides: Sequence[str]) -> Config:
    choices = [*to_overrides(settings), *overrides]
    last = {choice.partition("=")[0].strip(): choice for choice in choices}
    try:
        config = load(list(last.values()))
    except ConfigError as error:
        raise ConfigError(f"{path}: scenario {name!r}: {error}") from None
    paired = config.noise == "paired"
    _require(path, paired, f"scenario {name!r} needs noise=paired: one order of levels")
    ordered = len(config.sigma_t) > 1 or len(config.n_outliers) > 1
    _require(path, ordered, f"scenario {name!r} needs two levels of noise, or numbers of outliers")
    return replace(config, name=f"{study_name(path)}/{name}")


def _read(path: Path) -> tuple[Settings, Settings, dict[str, Settings]]:
    """Return the settings that all studies share, and the settings and scenarios of a file."""
    _require(path, _is_name(path.stem), "needs a name of letters, digits and underscores")
    content = {file: _parse(file) for file in (BEYOND, path)}
    settings, scenarios = (content[path].get(key, {}) for key in KEYS)
    _require(path, isinstance(settings, dict), "needs key: value under settings")
    _require(path, isinstance(scenarios, dict) and bool(scenarios), "has no scenarios")
    for name, own in scenarios.items():
        _require(path, _is_name(name), f"scenario {name!r} may have letters, digits, underscores")
        _require(path, isinstance(own, dict), f"scenario {name!r} needs {{key: value, ...}}")
    for own in (settings, *scenarios.values()):
        _require(path, "results_dir" not in own, "may not set results_dir: it is one for all")
    return content[BEYOND]["settings"], settings, scenarios


def _parse(path: Path) -> Settings:
    try:
        content = OmegaConf.to_container(OmegaConf.load(path)) or {}
    except (OSError, ValueError, YAMLError, OmegaConfBaseException) as error:
        raise ConfigError(f"cannot read {path}: {' '.join(str(error).split())}") from None
    for key in content:
        _require(path, key in KEYS, f"has an unknown key {key!r}; the keys are {', '.join(KEYS)}")
    return {str(key): content[key] for key in content} if isinstance(content, dict) else {}


def _is_name(name: object) -> bool:
    return isinstance(name, str) and bool(re.fullmatch(r"[A-Za-z0-9_]+", name))


def _require(path: Path, condition: bool, problem: str) -> None:
    if not condition:
        raise ConfigError(f"{path} {problem}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/trials/<study>/<scenario>.csv``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.scenarios",
        description="Run the trials of one scenario.",
        epilog="settings are those of python -m experiments.run",
    )
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("--scenarios", type=Path, default=BEYOND, metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    return [run(load_scenario(options.name, options.scenarios, options.overrides))]


if __name__ == "__main__":
    sys.exit(main())
