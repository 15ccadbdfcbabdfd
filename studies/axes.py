"""Axes of a study: options of metrics, with the values that are compared on the same cameras."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from experiments.command import ConfigError
from experiments.config import read_yaml, split_override
from experiments.metrics import Column

from .study import Section, Settings, Table, TableName, naming, reject, resolve

FIXED = ("experiment", "metrics")  # settings that the study itself decides
TITLES = {
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

AxisValue = float | str


class Part(Settings):
    """The settings of a part; with `seeds`, each trial is registered with so many."""

    seeds: int = 0


class _Axis(Section):
    metric: str
    option: str
    paper: AxisValue
    values: list[AxisValue]


class AxesFile(Section):
    """What the file of a study with axes has."""

    axes: dict[str, _Axis]
    trials: dict[TableName, Part]


@dataclass(frozen=True)
class Axis:
    """An option of a metric with the values to compare, the paper's among them."""

    name: str
    metric: str
    option: str
    paper: str
    values: tuple[str, ...]

    def of(self, column: Column, value: str) -> Column:
        """Return a metric with a value of the option; the paper's value needs no option."""
        return column if value == self.paper else column.with_option(self.option, value)

    def keys(self, value: str) -> dict[str, str]:
        """Return what a row on one of its values begins with."""
        return {"axis": self.name, "metric": self.metric, "option": self.option, "value": value}

    @property
    def columns(self) -> dict[str, str]:
        """The names of the metrics by their values."""
        return {value: str(self.of(Column(self.metric), value)) for value in self.values}

    @property
    def title(self) -> str:
        """What the axis is called where it is read."""
        return f"{self.metric}: {option_title(self.option)}"


def plan(path: Path, overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each part of a file of axes; overrides may have other values of axes."""
    file = read_yaml(path, AxesFile)
    reject(overrides, FIXED, "the study decides it")
    given = dict(split_override(override) for override in overrides)
    settings = [one for one in overrides if split_override(one)[0] not in file.axes]
    axes = [axis_with(path, name, given.get(name, one.values)) for name, one in file.axes.items()]
    metrics = list(dict.fromkeys(metric for axis in axes for metric in axis.columns.values()))
    sweeps = resolve(path, "trials", settings, file.trials)
    return {
        key: Table((replace(sweep, metrics=_seeded(metrics, file.trials[key].seeds)),))
        for key, sweep in sweeps.items()
    }


def axis_names(path: Path) -> list[str]:
    """Return the names of the axes of a file."""
    return list(read_yaml(path, AxesFile).axes)


def axis_with(path: Path, name: str, values: str | Sequence[object]) -> Axis:
    """Return an axis of a file with some values: a list, or as typed."""
    known = read_yaml(path, AxesFile).axes
    if name not in known:
        raise ConfigError(f"unknown axis {name!r}; the axes are {', '.join(known)}")
    entry, given = known[name], _list(name, values) if isinstance(values, str) else values
    for value in map(_write, given):
        with naming(f"setting {name!r}: "):
            Column.parse(f"{entry.metric}({entry.option}={value})")
    axis = _axis(name, entry, given)
    if len(axis.values) < 2:
        raise ConfigError(f"setting {name!r} needs another value than the paper's {axis.paper}")
    return axis


def axes_of(path: Path, trials: Mapping[str, Sequence[str]]) -> list[Axis]:
    """Return the axes of a file with the values that the metrics of its tables of trials have."""
    file = read_yaml(path, AxesFile)
    once = [name for name, part in file.trials.items() if not part.seeds]
    columns = [Column.parse(metric) for name in once for metric in trials.get(name, ())]
    axes = []
    for name, entry in file.axes.items():
        values = [
            column.options[entry.option]
            for column in columns
            if column.name == entry.metric and list(column.options) == [entry.option]
        ]
        axes.append(_axis(name, entry, values))
    return axes


def seeded(metric: str, seed: int) -> str:
    """Return a metric registered with a seed of its own."""
    return str(Column.parse(metric).with_option("seed", seed))


def over_seeds(trials: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Return the columns of a metric under each seed of the registration; RAS has none."""
    return trials[[name for k in range(trials.shape[1]) if (name := seeded(metric, k)) in trials]]


def option_title(option: str) -> str:
    """Return what an option is called where it is read."""
    return TITLES.get(option, option)


def value_title(option: str, value: str) -> str:
    """Return what a value of an option is called where it is read."""
    return INFINITE.get(option, "∞") if value == "inf" else value


def _list(name: str, text: str) -> list[str]:
    values = [value.strip() for value in text.strip("[]").split(",")]
    if not (text.startswith("[") and text.endswith("]") and all(values)):
        raise ConfigError(f"setting {name!r} must be a list in brackets, for example [1, 2]")
    return values


def _axis(name: str, entry: _Axis, values: Sequence[object]) -> Axis:
    """Return an axis with the values in their order, the paper's among them."""
    paper = _write(entry.paper)
    ordered = sorted({*map(_write, values), paper}, key=float)
    return Axis(name, entry.metric, entry.option, paper, tuple(ordered))


def _seeded(metrics: list[str], seeds: int) -> list[str]:
    """Return metrics under each seed, but for those whose registration is not random."""
    if not seeds:
        return metrics
    random = [m for m in metrics if "seed" in type(Column.parse(m).values).model_fields]
    return [seeded(metric, seed) for seed in range(seeds) for metric in random]


def _write(value: object) -> str:
    """Write a number in one way, 1 for 1.0, so that it is compared with the paper's; or a word."""
    try:
        number = float(str(value))
    except ValueError:
        return str(value)
    return str(int(number)) if number.is_integer() else repr(number)
