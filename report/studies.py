"""The studies as they are read: what choices cost and gain, registrations, scenarios."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import pandas as pd

from experiments.config import SETTINGS, Sweep
from experiments.metrics import Column
from experiments.tables import Record
from figures import FIGURES
from studies.parameters import registrations, thresholds
from studies.parameters.axes import Axis, value_title
from studies.parameters.effects import COMPARED, EFFECTS
from studies.scenarios.findings import POWERS, SCORES
from studies.statistics import LEAST_POWER

from .estimates import write_number
from .inputs import Parameters
from .origin import NONE, write_levels

__all__ = ["Beyond", "Registrations", "Thresholds"]

LABELS = {
    "geometry": "cameras",
    "error": "errors",
    "outlier_side": "side of the outliers’ cube",
    "n_cameras": "number of cameras",
    "n_outliers": "numbers of outliers",
    "sigma_t": "sigma_t",
    "sigma_r_deg": "sigma_r_deg, degrees",
}
MAIN = ("geometry", "error", "outliers", "n_cameras", "n_outliers", "sigma_t", "sigma_r_deg")
DIGITS = {  # of the statistics of the registrations; three of all others
    "median standard deviation": 5,
    "largest standard deviation": 4,
    "scattered inputs": 0,
    registrations.DEPENDENCE: 1,
}


@dataclass(frozen=True)
class Cell:
    """A number, and where it certainly is better or worse than the paper's value's, that word."""

    text: str
    mark: str = ""


@dataclass(frozen=True)
class Value:
    """A value of an option with its effects and run times."""

    text: str
    is_paper: bool
    effects: Sequence[Cell]
    times: Sequence[str]


class Thresholds:
    """What the paper's values cost and gain."""

    def __init__(self, study: Parameters) -> None:
        self._table, self._times = study.table, study.times
        self.choices = thresholds.choices(study.axes, study.table)
        self.lead = thresholds.lead(self.choices)
        self.method = thresholds.method(study.trials)
        self.nothing, self.terms = thresholds.NOTHING, thresholds.TERMS
        self.effects = [EFFECTS[name] for name in COMPARED]
        self.cameras = sorted(study.times["n_cameras"].unique())

    def values(self, axis: Axis) -> list[Value]:
        """Return the values of an axis with their effects and run times."""
        table, times = (
            rows[rows["axis"] == axis.name].set_index("value")
            for rows in (self._table, self._times)
        )
        return [
            Value(
                value_title(axis.option, value),
                value == axis.paper,
                [_cell(table, name, value, axis.paper) for name in COMPARED],
                [f"{milliseconds:.2f} ms" for milliseconds in times.loc[[value], "milliseconds"]],
            )
            for value in axis.values
        ]


def _cell(table: pd.DataFrame, name: str, value: str, paper: str) -> Cell:
    effect = EFFECTS[name]
    ours, theirs = (float(table[name][each]) for each in (paper, value))
    if not isfinite(theirs):
        return Cell(NONE)
    marked = value != paper and thresholds.differs(ours, theirs, float(table[f"{name}_p"][value]))
    mark = "better" if (theirs > ours) == effect.larger_is_better else "worse"
    return Cell(effect.write(theirs), mark if marked else "")


@dataclass(frozen=True)
class Group:
    """Statistics of the same trials: words, and a number for each registration."""

    title: str
    figure: str  # of the same experiment; empty where there is none
    rows: Sequence[tuple[str, Sequence[str]]]


class Registrations:
    """The paper's registration and the refined one."""

    def __init__(self, study: Parameters) -> None:
        (axis,) = study.axes
        self._table, self._times = study.table, study.times
        self.values, self.paper, self.trials = axis.values, axis.paper, study.trials
        self.spread = registrations.spread(axis, study.table)
        self.meaning = registrations.meaning(axis, study.table)
        self.repeatable = registrations.REPEATABLE
        self._summary = registrations.summarise(axis, study.table)
        metrics = (metric for record in study.records.values() for metric in record.metrics)
        seeds = {Column.parse(metric).options.get("seed") for metric in metrics} - {None}
        n_inputs = len(registrations.gain(axis, study.table))
        self._inputs_title = f"{n_inputs} inputs, {len(seeds)} seeds each"

    @property
    def groups(self) -> list[Group]:
        """All statistics of the summary, and the run times."""
        groups = [self._group(part, numbers) for part, numbers in self._summary.items()]
        times = [
            (f"{n} cameras", [f"{milliseconds:.2f} ms" for milliseconds in rows["milliseconds"]])
            for n, rows in self._times.groupby("n_cameras")
        ]
        return [*groups, Group("Processor time of one evaluation", "", times)]

    def _group(self, part: str, statistics: Mapping[str, "pd.Series[float]"]) -> Group:
        rows = []
        for name, numbers in statistics.items():
            digits = DIGITS.get(name, 3)
            texts = [f"{numbers[value]:.{digits}f}" for value in self.values]
            rows.append((f"{name[0].upper()}{name[1:]}", texts))
        if not part:
            return Group(self._inputs_title, "", rows)
        figure = part if part in FIGURES else ""
        return Group(f"Experiment {part.replace('_', ' ')}", figure, rows)

    @property
    def inputs(self) -> list[tuple[str, Sequence[str]]]:
        """Each input with the mean and the standard deviation of its scores over the seeds."""
        scene = ["part", "geometry", "n_cameras", "n_outliers", "sigma_t", "trial"]
        several = self._table["trial"].nunique() > 1
        rows: list[tuple[str, Sequence[str]]] = []
        for _, group in self._table.groupby(scene, sort=False):
            first, of = group.iloc[0], group.set_index("statistic")
            where = registrations.GEOMETRIES.get(first["geometry"], first["geometry"])
            words = f"{first['n_cameras']:.0f} {where}, {first['n_outliers']:.0f} outliers, "
            words += f"sigma_t {first['sigma_t']:g}"
            words += f", trial {1 + first['trial']:.0f}" if several else ""
            texts = [
                f"{of[value]['mean']:.4f} ± {of[value]['standard deviation']:.4f}"
                for value in self.values
            ]
            rows.append((words, texts))
        return rows


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
        return self.tau < LEAST_POWER

    @property
    def number(self) -> str:
        """The rank correlation."""
        return write_number(self.tau, 2, signed=False) if self.is_defined else NONE


@dataclass(frozen=True)
class Scenario:
    """A scenario with what each metric still orders there."""

    name: str
    settings: Sequence[tuple[str, str]]
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

    def __init__(self, name: str, findings: pd.DataFrame, records: Mapping[Path, Record]) -> None:
        self.name = name
        self.least_power = LEAST_POWER
        self.metrics = list(dict.fromkeys(findings["metric"]))
        self.scores = [metric for metric in self.metrics if metric in SCORES]
        first, *_ = (record.sweep for record in records.values())
        self.trials = first.trials
        self.scenarios = [
            _scenario(path.stem, record.sweep, first, findings[findings["scenario"] == path.stem])
            for path, record in records.items()
        ]

    def failing(self, metric: str) -> list[Scenario]:
        """Return where a metric does not order everything."""
        return [scenario for scenario in self.scenarios if scenario.failures(metric)]


def _scenario(name: str, sweep: Sweep, first: Sweep, rows: pd.DataFrame) -> Scenario:
    powers = {
        str(row["metric"]): [Power(level, float(row[column])) for level, column in POWERS.items()]
        for row in rows.to_dict("records")
    }
    return Scenario(name, _settings(sweep, first), powers, str(rows["finding"].iloc[0]))


def _settings(sweep: Sweep, first: Sweep) -> list[tuple[str, str]]:
    """Return the main settings of the first scenario, and of another what differs from them."""
    others = (key for key in SETTINGS if key not in ("metrics", "replicate"))
    differing = [key for key in others if getattr(sweep, key) != getattr(first, key)]
    keys = MAIN if sweep is first else differing
    return [(LABELS.get(key, key.replace("_", " ")), _write(getattr(sweep, key))) for key in keys]


def _write(value: object) -> str:
    if isinstance(value, list):
        return write_levels(value)
    return f"{value:g}" if isinstance(value, float) else str(value).replace("_", " ")
