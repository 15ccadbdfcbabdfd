"""The studies as they are read: what choices cost and gain, registrations, scenarios."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any

import pandas as pd

from experiments import registration_study
from experiments.config import HOW
from experiments.effects import EFFECTS, Effect
from experiments.findings import DISCERNS, JUDGED, LEVELS
from experiments.study import Axis, option_title, write_value
from experiments.threshold_study import CERTAIN, RELEVANT, TOLD, costs_and_gains, differs
from figures import FIGURES

from .estimates import write_number
from .inputs import Tables
from .origin import write_levels

__all__ = ["Beyond", "Registrations", "Thresholds"]

NONE = "–"
LABELS = {
    "geometry": "cameras",
    "error": "errors",
    "outliers": "outliers",
    "outlier_side": "side of the outliers’ cube",
    "n_cameras": "number of cameras",
    "n_outliers": "numbers of outliers",
    "sigma_t": "sigma_t",
    "sigma_r_deg": "sigma_r_deg, degrees",
}
FIRST = ("geometry", "error", "outliers", "n_cameras", "n_outliers", "sigma_t", "sigma_r_deg")
UNTOLD = ("name", "metrics", "replicate", *HOW)
STATISTICS = {  # of the registrations: what they are called, digits
    "median standard deviation": ("Standard deviation over the seeds, median of the inputs", 5),
    "largest standard deviation": ("Standard deviation over the seeds, largest", 4),
    "scattered inputs": (
        f"Inputs on which it is above {registration_study.REPEATS:g}",
        0,
    ),
    "mean score": ("Mean score", 3),
    "dependence on cameras, %": ("Dependence on the number of cameras, in % of the range", 1),
}
GEOMETRIES = {"cube": "in a cube", "line": "on a line", "uneven": "in clusters"}


@dataclass(frozen=True)
class Cell:
    """A number, and where it certainly is better or worse than the paper's value's, that word."""

    text: str
    mark: str = ""


@dataclass(frozen=True)
class Value:
    """A value of an option with its effects."""

    text: str
    is_paper: bool
    cells: Sequence[Cell]


@dataclass(frozen=True)
class Choice:
    """A value that the paper chose, with what it costs and gains against others."""

    name: str
    title: str
    name_of_option: str
    paper: str
    others: str
    costs: Sequence[str]
    gains: Sequence[str]
    values: Sequence[Value]


class Thresholds:
    """The parameter study."""

    def __init__(self, tables: Tables, trials: int) -> None:
        self._tables, self.trials = tables, trials
        self.certain, self.relevant = CERTAIN, 100 * RELEVANT
        self.cameras = sorted(tables.times["n_cameras"].unique())
        self.effects: list[Effect] = [EFFECTS[name] for name in TOLD]

    @cached_property
    def choices(self) -> list[Choice]:
        """The paper's values."""
        return [self._choice(axis) for axis in self._tables.study.axes.values()]

    def _choice(self, axis: Axis) -> Choice:
        costs, gains = costs_and_gains(axis, self._tables.results)
        return Choice(
            name=axis.name,
            title=f"{axis.metric}: {option_title(axis.option)}",
            name_of_option=f"{option_title(axis.option)} ({axis.metric})",
            paper=write_value(axis.option, axis.paper),
            others=", ".join(write_value(axis.option, v) for v in axis.values if v != axis.paper),
            costs=costs,
            gains=gains,
            values=[self._value(axis, value) for value in axis.values],
        )

    def _value(self, axis: Axis, value: str) -> Value:
        table, times = (
            rows[rows["axis"] == axis.name].set_index("value")
            for rows in (self._tables.results, self._tables.times)
        )
        cells = [_cell(table, name, value, axis.paper) for name in TOLD]
        for n in self.cameras:
            milliseconds = times.loc[times["n_cameras"] == n, "milliseconds"]
            cells.append(Cell(f"{milliseconds[value]:.2f} ms"))
        return Value(write_value(axis.option, value), value == axis.paper, cells)


def _cell(table: pd.DataFrame, name: str, value: str, paper: str) -> Cell:
    effect = EFFECTS[name]
    ours, theirs = (float(table[name][each]) for each in (paper, value))
    if not isfinite(theirs):
        return Cell(NONE)
    told = value != paper and differs(ours, theirs, float(table[f"{name}_error"][value]))
    mark = "better" if (theirs > ours) == effect.larger_is_better else "worse"
    return Cell(effect.write(theirs), mark if told else "")


@dataclass(frozen=True)
class Group:
    """Statistics of the same trials: words, and a number for each registration."""

    title: str
    figure: str  # of the same experiment; empty where there is none
    rows: Sequence[tuple[str, Sequence[str]]]


class Registrations:
    """The paper's registration and the refined one."""

    def __init__(self, tables: Tables, trials: int) -> None:
        self._tables, self.trials = tables, trials
        self._axis = tables.study.axes[registration_study.AXIS]
        self._summary = registration_study.summarise(self._axis, tables.results)
        self.values = list(self._axis.values)
        self.paper = self._axis.paper
        self.refined = next(value for value in self.values if value != self.paper)
        self.repeats = registration_study.REPEATS
        self.gain = registration_study.level(self._axis, tables.results)
        self.seeds = max(part.seeds for part in tables.study.parts.values())

    @cached_property
    def scattered(self) -> "pd.Series[float]":
        """On how many inputs the second digit is uncertain, for each registration."""
        return self._summary[""]["scattered inputs"]

    @property
    def gains(self) -> str:
        """How much higher the refined mean scores are."""
        median, least, most = (
            write_number(value, digits, signed=True)
            for value, digits in (
                (self.gain.median(), 3),
                (self.gain.min(), 4),
                (self.gain.max(), 3),
            )
        )
        return f"{median} in the median, {least} to {most}"

    @cached_property
    def groups(self) -> list[Group]:
        """All statistics of the summary, and the run times."""
        groups = [self._group(part, numbers) for part, numbers in self._summary.items()]
        times = [
            (f"{n} cameras", [f"{ms[value]:.2f} ms" for value in self.values])
            for n, ms in self._times.items()
        ]
        return [*groups, Group("Processor time of one evaluation", "", times)]

    def _group(self, part: str, statistics: Mapping[str, "pd.Series[float]"]) -> Group:
        written = []
        for name, numbers in statistics.items():
            words, digits = STATISTICS.get(name, (f"{name[0].upper()}{name[1:]}", 3))
            written.append((words, [f"{numbers[value]:.{digits}f}" for value in self.values]))
        if not part:
            return Group(f"{len(self.gain)} inputs, {self.seeds} seeds each", "", written)
        figure = part if part in FIGURES else ""
        return Group(f"Experiment {part.replace('_', ' ')}", figure, written)

    @cached_property
    def inputs(self) -> list[tuple[str, Sequence[str]]]:
        """Each input with the mean and the standard deviation of its scores over the seeds."""
        keys = ["part", "geometry", "n_cameras", "n_outliers", "sigma_t", "trial"]
        table = self._tables.results
        of_seeds = table[table["statistic"].isin(["mean", "standard deviation"])]
        several = of_seeds["trial"].nunique() > 1
        rows: list[tuple[str, Sequence[str]]] = []
        for _, group in of_seeds.groupby(keys, sort=False):
            of = group.set_index("statistic")
            scene = group.iloc[0]
            where = GEOMETRIES.get(scene["geometry"], scene["geometry"])
            words = f"{scene['n_cameras']:.0f} {where}, {scene['n_outliers']:.0f} outliers, "
            words += f"sigma_t {scene['sigma_t']:g}"
            words += f", trial {1 + scene['trial']:.0f}" if several else ""
            texts = [
                f"{of[value]['mean']:.4f} ± {of[value]['standard deviation']:.4f}"
                for value in self.values
            ]
            rows.append((words, texts))
        return rows

    @cached_property
    def _times(self) -> dict[int, "pd.Series[float]"]:
        return {
            int(str(n)): rows.set_index("value")["milliseconds"]
            for n, rows in self._tables.times.groupby("n_cameras")
        }


@dataclass(frozen=True)
class Power:
    """How well a metric orders the levels of noise, or the numbers of outliers."""

    level: str
    tau: float

    @property
    def is_defined(self) -> bool:
        """Whether there are levels to be ordered."""
        return isfinite(self.tau)

    @property
    def fails(self) -> bool:
        """Whether it does not order them."""
        return self.tau < DISCERNS

    @property
    def number(self) -> str:
        """The rank correlation."""
        return write_number(self.tau, 2, signed=False) if self.is_defined else NONE


@dataclass(frozen=True)
class Scenario:
    """A scenario with what each metric still orders there."""

    name: str
    setting: Sequence[tuple[str, str]]
    powers: Mapping[str, Sequence[Power]]
    finding: str

    @property
    def title(self) -> str:
        """The name as it is read."""
        return self.name.replace("_", " ")

    def failures(self, metric: str) -> list[Power]:
        """Return what a metric does not order."""
        return [power for power in self.powers.get(metric, ()) if power.fails]


class Beyond:
    """What the paper leaves out."""

    def __init__(
        self, name: str, findings: pd.DataFrame, configs: Mapping[str, Mapping[str, Any]]
    ) -> None:
        self.name = name
        self.discerns = DISCERNS
        self.metrics = list(dict.fromkeys(findings["metric"]))
        self.judged = [metric for metric in self.metrics if metric in JUDGED]
        first, *_ = configs.values()
        self.trials = first["trials"]
        self.scenarios = [
            _scenario(scenario, config, first, findings[findings["scenario"] == scenario])
            for scenario, config in configs.items()
        ]

    def failing(self, metric: str) -> list[Scenario]:
        """Return where a metric does not order everything."""
        return [scenario for scenario in self.scenarios if scenario.failures(metric)]


def _scenario(
    name: str, config: Mapping[str, Any], first: Mapping[str, Any], rows: pd.DataFrame
) -> Scenario:
    powers = {
        str(row["metric"]): [
            Power(level, float(row[column]))
            for level, column in zip(LEVELS, ("noise_power", "outlier_power"), strict=True)
        ]
        for row in rows.to_dict("records")
    }
    return Scenario(name, _setting(config, first), powers, str(rows["finding"].iloc[0]))


def _setting(config: Mapping[str, Any], first: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Tell the settings of the first scenario, and of another one what differs from them."""
    differing = [key for key in config if key not in UNTOLD and config[key] != first.get(key)]
    told = FIRST if config is first else differing
    return [(LABELS.get(key, key.replace("_", " ")), _write(config[key])) for key in told]


def _write(value: object) -> str:
    if isinstance(value, list):
        return write_levels(value)
    return f"{value:g}" if isinstance(value, float) else str(value).replace("_", " ")
