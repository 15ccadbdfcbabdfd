"""Run one replicate of what the claims need: ``python -m experiments.replicate replicate=3``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

import pandas as pd

from .claims import Claim, Claims, load_claims
from .command import run_command
from .config import Config, ConfigError, load
from .statistics import STATISTICS
from .sweep import Cell, cells, sweep
from .tables import provenance, write_table

__all__ = ["KEYS", "cells_of", "main", "plan", "replicate_path", "rows", "run"]

OWN = ("experiment", "metrics", "replicates")  # settings that the claims themselves decide
KEYS = ("experiment", "settings", *(key.name for key in fields(Cell)), "replicate", "trial")
FIRST = "outliers"  # whose settings stand for what all experiments share

Trials = tuple[str, tuple[str, ...]]  # an experiment and settings that differ from its own
Plan = dict[Trials, tuple[Config, dict[Cell, list[str]]]]


def plan(claims: Claims, overrides: Sequence[str] = ()) -> Plan:
    """Collect the cells that the claims need, and the metrics to evaluate in each.

    Raises
    ------
    ConfigError
        Where a setting is wrong, or leaves a claim without the cells it needs.

    Examples
    --------
    >>> from experiments.claims import load_claims
    >>> from experiments.replicate import plan
    >>> config, wanted = plan(load_claims())["combined", ()]
    >>> config.name, len(wanted)
    ('combined', 35)
    """
    for override in overrides:
        key = override.partition("=")[0].strip()
        if key in OWN:
            raise ConfigError(f"setting {key!r} is not open here: the claims decide what is run")
    result: Plan = {}
    for claim in claims:
        if claim.trials not in result:
            experiment, settings = claim.trials
            config = _load([f"experiment={experiment}", *overrides, *settings])
            result[claim.trials] = config, {}
        config, wanted = result[claim.trials]
        for cell in cells_of(claim, config):
            metrics = wanted.setdefault(cell, [])
            metrics += [metric for metric in claim.metrics if metric not in metrics]
    return result


def _load(overrides: Sequence[str]) -> Config:
    """Say which experiment a setting does not suit."""
    try:
        return load(overrides)
    except ConfigError as error:
        raise ConfigError(f"{error} ({' '.join(overrides)})") from None


def cells_of(claim: Claim, config: Config) -> list[Cell]:
    """Return the cells of the grid that a claim takes, and make sure that they can decide it."""
    grid = [cell for cell in cells(config) if _matches(cell, claim.where)]
    found = dict.fromkeys(
        cell for part in (claim.before, claim.after) for cell in grid if _matches(cell, part)
    )
    for part in (claim.where, claim.before, claim.after):
        for key, values in part.items():
            missing = sorted(set(values) - {getattr(cell, key) for cell in found})
            if missing:
                raise ConfigError(
                    f"claim {claim.id!r} needs trials of {config.name} with {key} {missing[0]:g}, "
                    "which these settings leave out"
                )
    least = STATISTICS[claim.statistic].least_levels
    for key in claim.level:
        levels = {getattr(cell, key) for cell in found}
        if len(levels) < least:
            raise ConfigError(
                f"claim {claim.id!r} compares levels of {key}, at least {least} of them, and these "
                f"settings of {config.name} have {len(levels)}"
            )
    return list(found)


def _matches(cell: Cell, where: object) -> bool:
    assert isinstance(where, dict)
    return all(getattr(cell, key) in values for key, values in where.items())


def run(planned: Plan) -> pd.DataFrame:
    """Run the trials that the claims need.

    Parameters
    ----------
    planned : mapping
        What `plan` returns.

    Returns
    -------
    DataFrame
        One row a trial, as `experiments.sweep.sweep` has them, with a column ``settings`` that
        tells what differs from the experiment's own; values that no claim needs are empty.
    """
    tables = []
    for (_, settings), (config, wanted) in planned.items():
        table = sweep(config, wanted)
        table.insert(1, "settings", " ".join(settings))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def rows(planned: Plan) -> pd.DataFrame:
    """Return the keys of all rows that `run` makes, and in which of them it fills each metric."""
    filled = [
        {"experiment": experiment, "settings": " ".join(settings), **asdict(cell)}
        | {"replicate": config.replicate, "trial": trial}
        | dict.fromkeys(metrics, True)
        for (experiment, settings), (config, wanted) in planned.items()
        for cell, metrics in wanted.items()
        for trial in range(config.trials)
    ]
    table = pd.DataFrame(filled)
    return table.where(table.notna(), False)


def replicate_path(config: Config) -> Path:
    """Return the path of the table of one replicate."""
    return Path(config.results_dir) / "replicates" / f"{config.replicate}.csv"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/replicates/<replicate>.csv``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.replicate",
        description="Run the trials that the claims need, in one replicate of the study.",
        epilog="settings are those of python -m experiments.run",
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    planned = plan(load_claims(), options.overrides)
    config = load([f"experiment={FIRST}", *options.overrides])
    path = replicate_path(config)
    path.parent.mkdir(parents=True, exist_ok=True)  # rather fail before the trials than after
    write_table(path, run(planned), provenance(config))
    return [path]


if __name__ == "__main__":
    sys.exit(main())
