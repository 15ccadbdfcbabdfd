"""What a figure draws: a table of trials, checked, as series over noise levels."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from experiments.statistics import SETTINGS

__all__ = ["FigureError", "Sweep", "write_value"]


class FigureError(ValueError):
    """Trials that a figure cannot be drawn from.

    Parameters
    ----------
    experiment : str
        Whose trials they are.
    problem : str
        What is wrong with their table, to be read behind its path.
    setting : str
        What to run the experiment with to get better ones.
    """

    def __init__(self, experiment: str, problem: str, setting: str = "") -> None:
        super().__init__(problem)
        self.experiment = experiment
        self.setting = setting


@dataclass(frozen=True, eq=False)
class Sweep:
    """Trials of an experiment as series over noise levels.

    Parameters
    ----------
    table : DataFrame
        One row a trial, as `experiments.sweep.sweep` returns them.
    metrics : sequence of str
        The columns to be drawn.
    series : str
        The key column whose values are the series.
    levels : tuple of str
        The key column along the x axis, and those that rise with it.

    Raises
    ------
    FigureError
        Where a metric is missing or no number, or a setting varies that would not be told apart.
    """

    table: pd.DataFrame
    metrics: Sequence[str]
    series: str
    levels: tuple[str, ...] = ("sigma_t",)

    def __post_init__(self) -> None:
        for column in (*SETTINGS, *self.metrics):
            if column not in self.table:
                self._refuse(f"has no column {column}", f"metrics=[{','.join(self.metrics)}]")
            if not np.isfinite(pd.to_numeric(self.table[column], errors="coerce")).all():
                self._refuse(f"has values of {column} that are no finite numbers")
        for column in SETTINGS:
            values = self.table[column].unique()
            if column not in (self.series, *self.levels) and len(values) > 1:
                self._refuse(
                    f"has {len(values)} values of {column}, of which the figure can show one",
                    f"{column}=[{values[0]:g}]",
                )
        if len(self._noise) > self._noise[self.levels[0]].nunique():
            self._refuse(
                f"varies {' and '.join(self.levels)} independently of each other", "noise=paired"
            )

    def _refuse(self, problem: str, setting: str = "") -> None:
        raise FigureError(str(self.table["experiment"].iloc[0]), problem, setting)

    @property
    def _noise(self) -> pd.DataFrame:
        return self.table[list(self.levels)].drop_duplicates().sort_values(self.levels[0])

    @cached_property
    def values(self) -> list[float]:
        """The values of the series, ascending."""
        return sorted(self.table[self.series].unique())

    @cached_property
    def ticks(self) -> list[str]:
        """The noise levels, ascending, as labels with a line for each quantity."""
        return [
            "\n".join(map(write_value, self.levels, row))
            for row in self._noise.itertuples(index=False, name=None)
        ]

    @cached_property
    def even(self) -> bool:
        """Whether the noise levels rise in equal steps."""
        steps = np.diff(self._noise.to_numpy(dtype=float), axis=0)
        return bool(np.allclose(steps, steps[:1]))

    @cached_property
    def trials(self) -> int:
        """The number of trials of a series at a level."""
        return int(self.table.groupby([self.series, self.levels[0]]).size().max())

    def spread(self, metric: str) -> NDArray[np.float64]:
        """Return smallest, lower quartile, mean, upper quartile, largest: (5, series, levels)."""
        groups = self.table.groupby([self.series, self.levels[0]])[metric]
        lower, upper = groups.quantile(0.25), groups.quantile(0.75)
        statistics = [groups.min(), lower, groups.mean(), upper, groups.max()]
        return np.stack([statistic.unstack().to_numpy(dtype=float) for statistic in statistics])


def write_value(column: str, value: float) -> str:
    """Write a value of a key column.

    Examples
    --------
    >>> from figures.tables import write_value
    >>> write_value("sigma_t", 0.1), write_value("sigma_r_deg", 10.0)
    ('0.1', '10°')
    """
    return f"{value:g}°" if column == "sigma_r_deg" else f"{value:g}"
