"""What a figure of the paper draws: trials as curves over noise levels, checked."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from alignscores.arrays import Floats
from experiments.grid import CELL_SETTINGS
from experiments.tables import TableError, Trials


@dataclass(frozen=True, eq=False)
class Curves:
    """Trials of an experiment as series, the values of one setting, over the levels of others."""

    trials: Trials
    metrics: Sequence[str]
    series: str
    levels: tuple[str, ...] = ("sigma_t",)

    def __post_init__(self) -> None:
        table = self.trials.table
        for metric in self.metrics:
            self._require(metric in table, f"has no column {metric}")
            finite = np.isfinite(pd.to_numeric(table[metric], errors="coerce")).all()
            self._require(finite, f"has values of {metric} that are not finite")
        for setting in CELL_SETTINGS:
            count = 1 if setting in (self.series, *self.levels) else table[setting].nunique()
            self._require(count == 1, f"has {count} values of {setting}; the figure can show one")
        self._require(
            self._noise[self.levels[0]].is_unique,
            f"varies {' and '.join(self.levels)} independently of each other",
        )

    def _require(self, condition: bool, problem: str) -> None:
        if not condition:
            raise TableError(self.trials.path, problem)

    @cached_property
    def _noise(self) -> pd.DataFrame:
        levels = self.trials.table[list(self.levels)]
        return levels.drop_duplicates().sort_values(self.levels[0])

    @cached_property
    def values(self) -> list[float]:
        """The values of the series, ascending."""
        return sorted(self.trials.table[self.series].unique())

    @cached_property
    def ticks(self) -> list[str]:
        """The noise levels, ascending, as labels with a line for each quantity."""
        return [
            "\n".join(map(write_value, self.levels, row))
            for row in self._noise.itertuples(index=False, name=None)
        ]

    def spread(self, metric: str) -> Floats:
        """Return the smallest value, the mean and the largest: (3, series, levels)."""
        groups = self.trials.table.groupby([self.series, self.levels[0]])[metric]
        return np.stack([groups.agg(name).unstack() for name in ("min", "mean", "max")])


def write_value(setting: str, value: float) -> str:
    """Write a value of a setting."""
    return f"{value:g}°" if setting == "sigma_r_deg" else f"{value:g}"
