"""The grid of a sweep: its cells, and what is evaluated in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import product

from .config import Sweep

__all__ = ["CELL_SETTINGS", "KEY_COLUMNS", "Cell", "cells", "evaluations"]


@dataclass(frozen=True)
class Cell:
    """One combination of settings; all trials of a sweep are run in every cell."""

    n_cameras: int
    n_outliers: int
    sigma_t: float
    sigma_r_deg: float

    def matches(self, where: Mapping[str, Sequence[float]]) -> bool:
        """Return whether each setting named has one of its values."""
        return all(getattr(self, key) in values for key, values in where.items())


def cells(sweep: Sweep) -> list[Cell]:
    """Return the cells of a sweep's grid in the order of its result table."""
    noise = (
        list(zip(sweep.sigma_t, sweep.sigma_r_deg, strict=True))
        if sweep.noise == "paired"
        else list(product(sweep.sigma_t, sweep.sigma_r_deg))
    )
    return [
        Cell(n, k, sigma_t, sigma_r)
        for n, k, (sigma_t, sigma_r) in product(sweep.n_cameras, sweep.n_outliers, noise)
    ]


def evaluations(sweep: Sweep) -> dict[Cell, list[str]]:
    """Return the cells that are run, and the metrics that are evaluated in each."""
    grid = cells(sweep)
    if not sweep.selections:
        return dict.fromkeys(grid, sweep.metrics)
    metrics_of: dict[Cell, list[str]] = {}
    for selection in sweep.selections:
        for cell in (cell for cell in grid if cell.matches(selection.where)):
            metrics = metrics_of.setdefault(cell, [])
            metrics += [metric for metric in selection.metrics if metric not in metrics]
    return metrics_of


CELL_SETTINGS = tuple(setting.name for setting in fields(Cell))
KEY_COLUMNS = ("experiment", "geometry", *CELL_SETTINGS, "replicate", "trial")
"""The first columns of a table of trials, which identify the trial."""
