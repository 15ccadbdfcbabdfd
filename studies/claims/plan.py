"""What the claims need: the cells of each experiment, and the metrics to evaluate there."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from experiments.command import ConfigError
from experiments.config import Selection, Sweep, split_override
from experiments.grid import Cell, cells

from ..paper import load_experiment
from ..study import reject
from .claims import Claim, Claims, within

FIXED = ("experiment", "metrics", "replicate")  # settings that the claims decide


def replicates(
    claims: Claims, overrides: Sequence[str], numbers: Iterable[int]
) -> list[tuple[Sweep, ...]]:
    """Return the sweeps of replicate studies, those that the claims need."""
    reject(dict(map(split_override, overrides)), FIXED, "the claims decide what is run")
    needed = {number: list(claims.needed(number)) for number in numbers}
    different = {len(own): own for own in needed.values()}  # the first ones have more readings
    planned = {n: plan(own, overrides) for n, own in different.items()}
    return [
        tuple(replace(sweep, replicate=number) for sweep in planned[len(own)])
        for number, own in needed.items()
    ]


def plan(claims: Iterable[Claim], overrides: Sequence[str] = ()) -> list[Sweep]:
    """Collect what the claims need: a sweep for each experiment and way to read it."""
    selections_of: dict[tuple[str, tuple[str, ...]], tuple[Sweep, list[Selection]]] = {}
    for claim in claims:
        if claim.trials not in selections_of:
            experiment, settings = claim.trials
            sweep = load_experiment([f"experiment={experiment}", *overrides, *settings])
            selections_of[claim.trials] = sweep, []
        sweep, wanted = selections_of[claim.trials]
        needed_cells(claim, sweep)
        wanted += [selection for selection in _selections(claim) if selection not in wanted]
    sweeps = []
    for (_, settings), (sweep, wanted) in selections_of.items():
        metrics = list(dict.fromkeys(metric for one in wanted for metric in one.metrics))
        changes = " ".join(settings)
        sweeps.append(replace(sweep, changes=changes, metrics=metrics, selections=wanted))
    return sweeps


def _selections(claim: Claim) -> list[Selection]:
    """Return the cells that a claim takes, those before and after a change apart."""
    parts = (claim.before, claim.after) if claim.before or claim.after else ({},)
    return [Selection(list(claim.metrics), within(claim.where, part)) for part in parts]


def needed_cells(claim: Claim, sweep: Sweep) -> list[Cell]:
    """Return the cells that a claim takes; a `ConfigError` names what is missing."""
    wheres = [selection.where for selection in _selections(claim)]
    needed = [cell for cell in cells(sweep) if any(cell.matches(where) for where in wheres)]
    for part in (claim.where, claim.at, claim.before, claim.after):
        for key, values in part.items():
            missing = sorted(set(values) - _levels(needed, key))
            if missing:
                raise ConfigError(
                    f"claim {claim.id!r} needs trials of {sweep.name} with {key} {missing[0]:g}, "
                    "which these settings leave out"
                )
    least = claim.rule.least_levels
    for key in claim.level:
        levels = _levels(needed, key)
        if len(levels) < least:
            raise ConfigError(
                f"claim {claim.id!r} compares levels of {key}, at least {least} of them, and these "
                f"settings of {sweep.name} have {len(levels)}"
            )
    return needed


def _levels(needed: Sequence[Cell], key: str) -> set[float]:
    return {getattr(cell, key) for cell in needed}
