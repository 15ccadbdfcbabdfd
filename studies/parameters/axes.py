"""Axes of a parameter study: options of the metrics, with the values that are compared.

All values of all axes are evaluated on the same cameras, those of some experiments.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from experiments.command import CommandError, ConfigError
from experiments.config import CONFIG_DIR, SETTINGS, read_yaml, split_override
from experiments.metrics import Column
from experiments.tables import TableError, Trials

from ..study import Section, Settings, Study, Table, TableName, resolve
from . import KINDS

__all__ = ["STUDIES", "Axis", "AxisValue", "axes_of", "axis_names", "axis_with", "check_parts"]
__all__ += ["is_seeded", "load_parameters", "option_title", "seeded", "study_file", "value_title"]

STUDIES = ("threshold", "registration")
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


class _File(Section):
    axes: dict[str, _Axis]
    trials: dict[TableName, Part]


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

    def column(self, value: str) -> Column:
        """Return the metric with this value of the option; the paper's value needs no option.

        Examples
        --------
        >>> from studies.parameters.axes import Axis
        >>> axis = Axis("tas_max_threshold", "TAS", "max_threshold", "1", ("0.5", "1"))
        >>> str(axis.column("0.5")), str(axis.column("1"))
        ('TAS(max_threshold=0.5)', 'TAS')
        """
        column = Column(self.metric)
        return column if value == self.paper else column.with_option(self.option, value)

    @property
    def columns(self) -> dict[str, str]:
        """The names of the metrics by their values."""
        return {value: str(self.column(value)) for value in self.values}

    @property
    def title(self) -> str:
        """What the axis is called where it is read."""
        return f"{self.metric}: {option_title(self.option)}"


def load_parameters(name: str, overrides: Sequence[str] = ()) -> Study:
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
        A table for each part; in one with seeds each trial is registered with so many seeds.

    Raises
    ------
    ConfigError
        In one line, where something is missing, unknown or impossible.

    Examples
    --------
    >>> from studies.parameters.axes import load_parameters
    >>> study = load_parameters("threshold", ["trials=5"])
    >>> study.name, study.tables["length"].sweeps[0].trials
    ('threshold_study', 5)
    """
    file = _read(name)
    axes, settings = _override(file.axes, overrides)
    columns = [Column.parse(text) for text in _metrics(axes)]
    tables = {}
    for key, part in file.trials.items():
        sweep = resolve(study_file(name), f"trials.{key}", settings, part)
        metrics = _seeded(columns, part.seeds) if part.seeds else list(map(str, columns))
        tables[key] = Table((replace(sweep, metrics=metrics),))
    return Study(f"{name}_study", tables)


def axis_names() -> list[str]:
    """Return the names of the axes of all studies."""
    return [axis for name in STUDIES for axis in _read(name).axes]


def axis_with(name: str, values: str | Sequence[object]) -> Axis:
    """Return an axis of any study with other values: a list, or as it is given on a command line.

    Raises
    ------
    ConfigError
        Where there is no such axis, or the values are no list, or impossible.

    Examples
    --------
    >>> from studies.parameters.axes import axis_with
    >>> axis_with("tas_max_threshold", "[0.5,2]").values
    ('0.5', '1', '2')
    """
    known = {key: entry for study in STUDIES for key, entry in _read(study).axes.items()}
    if name not in known:
        raise ConfigError(f"unknown axis {name!r}; the axes are {', '.join(known)}")
    return _with(name, known[name], values)


def axes_of(name: str, metrics: Sequence[str]) -> list[Axis]:
    """Return the axes of a study with the values that metrics of its trials have.

    Parameters
    ----------
    name : str
        One of `STUDIES`.
    metrics : sequence of str
        The metrics of a table of its trials.

    Examples
    --------
    >>> from studies.parameters.axes import axes_of
    >>> axis, *_ = axes_of("threshold", ["TAS", "TAS(max_threshold=0.5)"])
    >>> axis.name, axis.paper, axis.values
    ('tas_max_threshold', '1', ('0.5', '1'))
    """
    columns = [Column.parse(metric) for metric in metrics]
    axes = []
    for axis, entry in _read(name).axes.items():
        values = [
            column.options[entry.option]
            for column in columns
            if column.name == entry.metric and list(column.options) == [entry.option]
        ]
        axes.append(_axis(axis, entry, values))
    return axes


def check_parts(name: str, axes: Sequence[Axis], parts: Mapping[str, Trials]) -> None:
    """Make sure that all parts of a study are there, and have all values of its axes.

    Raises
    ------
    CommandError, TableError
        Where they are not, or have not.
    """
    missing = [part for part in _read(name).trials if part not in parts]
    if missing:
        raise CommandError(f"the {name} study needs the trials of {', '.join(missing)}, too")
    columns = [Column.parse(metric) for metric in _metrics(axes)]
    for trials in parts.values():
        found = trials.record.metrics
        wanted = _seeded(columns, 1) if is_seeded(found) else map(str, columns)
        for metric in wanted:
            if metric not in found:
                raise TableError(trials.path, f"has no column {metric}")


def is_seeded(metrics: Sequence[str]) -> bool:
    """Tell whether metrics are registered with several seeds each."""
    return any("seed" in Column.parse(metric).options for metric in metrics)


def seeded(metric: str, seed: int) -> str:
    """Return a metric registered with a seed of its own.

    Examples
    --------
    >>> from studies.parameters.axes import seeded
    >>> seeded("TAS", 3), seeded("TAS(order=0.2)", 3)
    ('TAS(seed=3)', 'TAS(order=0.2, seed=3)')
    """
    return str(Column.parse(metric).with_option("seed", seed))


def option_title(option: str) -> str:
    """Return what an option is called where it is read.

    Examples
    --------
    >>> from studies.parameters.axes import option_title
    >>> option_title("order"), option_title("registration")
    ('m as share of n', 'registration')
    """
    return TITLES.get(option, option)


def value_title(option: str, value: str) -> str:
    """Return what a value of an option is called where it is read.

    Examples
    --------
    >>> from studies.parameters.axes import value_title
    >>> value_title("prescreen", "inf"), value_title("prescreen", "0.3")
    ('off', '0.3')
    """
    return INFINITE.get(option, "∞") if value == "inf" else value


def study_file(name: str) -> Path:
    """Return the file of a study."""
    return CONFIG_DIR / "study" / f"{name}.yaml"


def _read(name: str) -> _File:
    if name not in STUDIES:
        raise ConfigError(f"unknown study {name!r}; the studies are {', '.join(STUDIES)}")
    return read_yaml(study_file(name), _File)


def _override(
    entries: Mapping[str, _Axis], overrides: Sequence[str]
) -> tuple[list[Axis], list[str]]:
    """Return the axes, and the settings among the overrides."""
    others = set(axis_names()) - set(entries)
    known = [key for key in SETTINGS if key not in FIXED]
    values, settings = {}, []
    for override in overrides:
        key, value = split_override(override)
        if key in entries:
            values[key] = value
        elif key in known:
            settings.append(override)
        elif key not in others:
            raise ConfigError(
                f"unknown setting {key!r}; the axes of this study are {', '.join(entries)}; the "
                f"settings are {', '.join(known)}"
            )
    axes = [_with(name, entry, values.get(name, entry.values)) for name, entry in entries.items()]
    return axes, settings


def _with(name: str, entry: _Axis, values: str | Sequence[object]) -> Axis:
    if isinstance(values, str):
        values = _list(name, values)
    return _checked(_axis(name, entry, values))


def _list(name: str, text: str) -> list[str]:
    values = [value.strip() for value in text.strip("[]").split(",")]
    if not (text.startswith("[") and text.endswith("]") and all(values)):
        raise ConfigError(f"setting {name!r} must be a list in brackets, for example [1, 2]")
    return values


def _axis(name: str, entry: _Axis, values: Sequence[object]) -> Axis:
    """Make an axis of what the file has for it and of its values; numbers are sorted."""
    paper = _write(entry.paper)
    written = list(dict.fromkeys([*map(_write, values), paper]))
    axis = Axis(name, entry.metric, entry.option, paper, tuple(written))
    try:
        return replace(axis, values=tuple(sorted(written, key=float)))
    except ValueError:  # words, the paper's first
        return replace(axis, values=tuple(sorted(written, key=lambda value: value != paper)))


def _checked(axis: Axis) -> Axis:
    if axis.name.partition("_")[0] not in KINDS:
        kinds = ", ".join(f"{kind}_" for kind in KINDS)
        raise ConfigError(f"axis {axis.name!r} must have a name that starts with {kinds}")
    for value in axis.values:
        try:
            Column.parse(f"{axis.metric}({axis.option}={value})")
        except ConfigError as error:
            raise ConfigError(f"setting {axis.name!r}: {error}") from None
    if len(axis.values) < 2:
        raise ConfigError(
            f"setting {axis.name!r} needs another value than the paper's {axis.paper}"
        )
    return axis


def _metrics(axes: Sequence[Axis]) -> list[str]:
    """Return the metrics of all values of all axes, each once."""
    return list(dict.fromkeys(metric for axis in axes for metric in axis.columns.values()))


def _seeded(columns: Sequence[Column], seeds: int) -> list[str]:
    """Return the metrics under each seed, without those whose registration is not random."""
    random = [str(c) for c in columns if "seed" in type(c.values).model_fields]
    return [seeded(metric, seed) for seed in range(seeds) for metric in random]


def _write(value: object) -> str:
    """Write a number in one way, 1 for 1.0, so that it is compared with the paper's; or a word."""
    try:
        number = float(str(value))
    except ValueError:
        return str(value)
    return str(int(number)) if number.is_integer() else repr(number)
