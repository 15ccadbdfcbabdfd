"""Axes: options of metrics, with the values that are compared on the same cameras."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from experiments.command import ConfigError
from experiments.config import load_sweep, read_yaml, to_overrides
from experiments.metrics import metric, split_options, with_options

from ..study import naming, reject

AXES = Path(__file__).with_name("axes.yaml")
FIXED = ("experiment", "metrics")  # settings that the study itself decides


@dataclass(frozen=True)
class _Axis:
    metric: str
    option: str
    paper: float | str
    values: list[float | str]


@dataclass(frozen=True)
class _File:
    axes: dict[str, _Axis]
    trials: dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Axis:
    """An option of a metric with the values to compare, the paper's among them."""

    name: str
    metric: str
    option: str
    paper: str
    values: tuple[str, ...]

    @classmethod
    def of(cls, name: str, entry: _Axis, values: object) -> Self:
        """Return an axis with its values in rising order; a wrong one is a `ConfigError`."""
        if not isinstance(values, list):
            raise ConfigError(
                f"setting {name!r} must be a list in brackets, for example [1, 2], of the values "
                "that threshold_study compares; a single value in all trials is "
                f"'{entry.metric.lower()}={{{entry.option}: {values}}}'"
            )
        for value in values:
            with naming(f"setting {name!r}: "):
                metric(with_options(entry.metric, {entry.option: _write(value)}))
        paper = _write(entry.paper)
        ordered = sorted({*map(_write, values), paper}, key=float)
        if len(ordered) < 2:
            raise ConfigError(f"setting {name!r} needs another value than the paper's {paper}")
        return cls(name, entry.metric, entry.option, paper, tuple(ordered))

    @property
    def columns(self) -> Mapping[str, str]:
        """The columns of the metric by the values; the paper's needs no option."""
        return {
            value: with_options(self.metric, {} if value == self.paper else {self.option: value})
            for value in self.values
        }


def axis_names() -> list[str]:
    """Return the names of the axes, by which other values can be set."""
    return list(read_yaml(AXES, _File).axes)


def plan(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of each table; there may be other values of axes."""
    file = read_yaml(AXES, _File)
    reject(settings, FIXED, "the study decides it")
    others = {key: value for key, value in settings.items() if key not in file.axes}
    axes = [Axis.of(name, one, settings.get(name, one.values)) for name, one in file.axes.items()]
    metrics = list(dict.fromkeys(metric for axis in axes for metric in axis.columns.values()))
    tables = {}
    for name, own in file.trials.items():
        tables[name] = {**own, "metrics": metrics, **others}
        load_sweep(to_overrides(tables[name]))  # a wrong setting ends here
    return tables


def axes_of(metrics: Iterable[str]) -> list[Axis]:
    """Return the axes with the values that the columns of a table have."""
    columns = list(map(split_options, metrics))
    axes = []
    for name, entry in read_yaml(AXES, _File).axes.items():
        own = [
            options[entry.option]
            for metric, options in columns
            if metric == entry.metric and list(options) == [entry.option]
        ]
        axes.append(Axis.of(name, entry, own))
    return axes


def _write(value: object) -> str:
    """Write a number in one way, 1 for 1.0, so that it is compared with the paper's."""
    try:
        return f"{float(str(value)):.12g}"
    except ValueError:
        return str(value)
