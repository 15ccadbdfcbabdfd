"""Run part of a parameter study: ``python -m experiments.study STUDY PART [key=value ...]``.

A study compares the values of some options of the scores, its axes, on the trials of some
experiments, its parts. All values of all axes are evaluated on the same cameras.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from .command import run_command
from .config import (
    CONFIG_DIR,
    METRIC_OPTIONS,
    Config,
    ConfigError,
    load,
    split_metric,
    to_overrides,
)
from .run import run

__all__ = ["STUDIES", "Axis", "Part", "Study", "axis_names", "default_axes", "load_study", "main"]
__all__ += ["option_title", "seeded", "write_value"]

STUDIES = ("threshold", "registration")
OWN = ("experiment", "metrics")  # settings that the study itself decides
OPTIONS = {
    "max_threshold": "largest threshold, units of d",
    "quantile": "quantile that is d",
    "n_thresholds": "number of thresholds",
    "max_threshold_deg": "largest threshold, degrees",
    "weight": "weight of the TAS",
    "n_hypotheses": "hypotheses",
    "prescreen": "prescreening threshold",
    "order": "m as share of n",
}
INFINITE = {"n_thresholds": "exact area", "prescreen": "off"}


@dataclass(frozen=True)
class Axis:
    """An option of a metric with the values to compare.

    Parameters
    ----------
    name : str
        Its name in the study.
    metric, option : str
        Metric and option that are varied.
    paper : str
        The paper's value.
    values : tuple of str
        All values, the paper's among them.
    """

    name: str
    metric: str
    option: str
    paper: str
    values: tuple[str, ...]

    def column(self, value: str) -> str:
        """Return the metric with this value of the option; the paper's value needs no option.

        Examples
        --------
        >>> from experiments.study import load_study
        >>> axis = load_study("threshold").axes["tas_max_threshold"]
        >>> axis.column("0.5"), axis.column("1")
        ('TAS(max_threshold=0.5)', 'TAS')
        """
        return self.metric if value == self.paper else f"{self.metric}({self.option}={value})"

    @property
    def columns(self) -> list[str]:
        """The metrics of all values."""
        return [self.column(value) for value in self.values]


@dataclass(frozen=True)
class Part:
    """The trials of one experiment; with `seeds`, each is registered with so many seeds."""

    name: str
    config: Config
    seeds: int
    path: Path


@dataclass(frozen=True)
class Study:
    """Axes, and the trials that they are compared on."""

    name: str
    axes: Mapping[str, Axis]
    parts: Mapping[str, Part]
    overrides: tuple[str, ...]

    @property
    def results(self) -> Path:
        """The folder of the results."""
        return Path(next(iter(self.parts.values())).config.results_dir)

    @property
    def columns(self) -> list[str]:
        """The metrics of all values of all axes, each once."""
        return list(dict.fromkeys(c for axis in self.axes.values() for c in axis.columns))

    def table_path(self, name: str = "") -> Path:
        """Return the path of a table of the study."""
        return self.results / "tables" / f"{self.name}_study{name}.csv"


def load_study(name: str, overrides: Sequence[str] = ()) -> Study:
    """Read ``configs/study/<name>.yaml``.

    Parameters
    ----------
    name : str
        One of `STUDIES`.
    overrides : sequence of str
        Values of axes such as ``"tas_max_threshold=[0.5,2]"``, and settings for all parts such as
        ``"trials=5"``. Axes of other studies are passed over.

    Returns
    -------
    Study
        The study, checked.

    Raises
    ------
    ConfigError
        In one line, where something is missing, unknown or impossible.

    Examples
    --------
    >>> from experiments.study import load_study
    >>> study = load_study("threshold", ["tas_max_threshold=[0.5,2]", "trials=5"])
    >>> study.axes["tas_max_threshold"].values
    ('0.5', '1', '2')
    >>> study.parts["length"].config.trials
    5
    """
    content = _read(name)
    axes, given = _override(content["axes"], overrides)
    study = Study(name, axes, {}, tuple(overrides))
    parts = {part: _part(study, part, entry, given) for part, entry in content["trials"].items()}
    return replace(study, parts=parts)


def axis_names() -> list[str]:
    """Return the names of the axes of all studies."""
    return [axis for name in STUDIES for axis in _read(name)["axes"]]


def default_axes() -> dict[str, Axis]:
    """Return the axes of all studies, with the values of their files."""
    entries = [entry for name in STUDIES for entry in _read(name)["axes"].items()]
    return {name: _axis(name, entry, None) for name, entry in entries}


def option_title(option: str) -> str:
    """Return what an option is called where it is read.

    Examples
    --------
    >>> from experiments.study import option_title
    >>> option_title("order"), option_title("registration")
    ('m as share of n', 'registration')
    """
    return OPTIONS.get(option, option)


def write_value(option: str, value: str) -> str:
    """Write a value of an option.

    Examples
    --------
    >>> from experiments.study import write_value
    >>> write_value("prescreen", "inf"), write_value("prescreen", "0.3")
    ('off', '0.3')
    """
    return INFINITE.get(option, "∞") if value == "inf" else value


def seeded(column: str, seed: int) -> str:
    """Return a metric registered with a seed of its own; the RAS has nothing random.

    Examples
    --------
    >>> from experiments.study import seeded
    >>> seeded("TAS", 3), seeded("TAS(order=0.2)", 3)
    ('TAS(seed=3)', 'TAS(order=0.2, seed=3)')
    """
    return f"{column[:-1]}, seed={seed})" if column.endswith(")") else f"{column}(seed={seed})"


def _read(name: str) -> Any:
    if name not in STUDIES:
        raise ConfigError(f"unknown study {name!r}; the studies are {', '.join(STUDIES)}")
    path = CONFIG_DIR / "study" / f"{name}.yaml"
    try:
        return OmegaConf.to_container(OmegaConf.load(path))
    except (OSError, YAMLError, OmegaConfBaseException) as error:
        raise ConfigError(f"cannot read {path}: {' '.join(str(error).split())}") from None


def _override(
    entries: Mapping[str, Any], overrides: Sequence[str]
) -> tuple[dict[str, Axis], dict[str, str]]:
    """Return the axes, and the settings among the overrides."""
    others = set(axis_names()) - set(entries)
    known = [field.name for field in fields(Config) if field.name not in ("name", *OWN)]
    given: dict[str, str] = {}
    for override in overrides:
        key, equals, value = (part.strip() for part in override.partition("="))
        if not equals:
            raise ConfigError(f"{override!r} is not a setting; write key=value, such as trials=5")
        if key in others:
            continue
        if key not in (*known, *entries):
            raise ConfigError(
                f"unknown setting {key!r}; the axes of this study are {', '.join(entries)}; the "
                f"settings are {', '.join(known)}"
            )
        given[key] = value
    axes = {name: _axis(name, entry, given.pop(name, None)) for name, entry in entries.items()}
    return axes, given


def _axis(name: str, entry: Mapping[str, Any], given: str | None) -> Axis:
    """Make an axis of what the file has for it, or of the values given in its place."""
    values = [_write(value) for value in entry["values"]]
    if given is not None:
        values = [_write(value.strip()) for value in given.strip("[]").split(",")]
        if not (given.startswith("[") and given.endswith("]") and all(values)):
            raise ConfigError(f"setting {name!r} must be a list in brackets, for example [1, 2]")
    paper = _write(entry["paper"])
    values = list(dict.fromkeys([*values, paper]))
    axis = Axis(name, entry["metric"], entry["option"], paper, tuple(values))
    for value in values:
        try:
            split_metric(f"{axis.metric}({axis.option}={value})")
        except ConfigError as error:
            raise ConfigError(f"setting {name!r}: {error}") from None
    if len(values) < 2:
        raise ConfigError(f"setting {name!r} needs another value than the paper's {paper}")
    try:
        return replace(axis, values=tuple(sorted(values, key=float)))
    except ValueError:  # words
        return axis


def _part(study: Study, name: str, entry: Mapping[str, Any], given: Mapping[str, str]) -> Part:
    own = {key: value for key, value in entry.items() if key != "seeds"}
    settings = dict(override.split("=", 1) for override in to_overrides(own))
    config = load([f"{key}={value}" for key, value in (settings | dict(given)).items()])
    columns = study.columns
    seeds = entry.get("seeds", 0)
    if seeds:
        random = [column for column in columns if "seed" in METRIC_OPTIONS[split_metric(column)[0]]]
        columns = [seeded(column, seed) for seed in range(seeds) for column in random]
    path = Path(config.results_dir) / "trials" / f"{study.name}_study" / f"{name}.csv"
    return Part(name, replace(config, metrics=columns), seeds, path)


def _write(value: object) -> str:
    """Write a number in one way, 1 for 1.0, so that it is compared with the paper's; or a word."""
    try:
        number = float(str(value))
    except ValueError:
        return str(value)
    return str(int(number)) if number.is_integer() else repr(number)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/trials/<study>_study/<part>.csv``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.study",
        description="Run one part of a parameter study.",
        epilog="settings are those of python -m experiments.run, and the study's axes",
    )
    parser.add_argument("study", metavar="STUDY", help=" | ".join(STUDIES))
    parser.add_argument(
        "part", metavar="PART", help="such as outliers; see configs/study/STUDY.yaml"
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    study = load_study(options.study, options.overrides)
    if options.part not in study.parts:
        parts = ", ".join(study.parts)
        raise ConfigError(f"unknown part {options.part!r}; the parts are {parts}")
    part = study.parts[options.part]
    return [run(part.config, part.path)]


if __name__ == "__main__":
    sys.exit(main())
