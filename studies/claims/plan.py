"""What the claims need: the cells of each experiment, and the metrics to evaluate there."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from experiments.command import ConfigError
from experiments.config import Selection, Sweep
from experiments.grid import Cell, cells

from ..paper import load_experiment
from ..study import Table, reject
from .claims import Claim, Claims

FIXED = ("experiment", "metrics", "replicate")  # settings that the claims decide


def replicates(claims: Claims, overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each replicate study, of all sweeps that the claims need."""
    reject(overrides, FIXED, "the claims decide what is run")
    first, others = (plan(claims.needed(k), overrides) for k in (0, claims.replicates_of_readings))
    return {
        str(number): Table(
            tuple(
                replace(sweep, replicate=number)
                for sweep in (first if number < claims.replicates_of_readings else others)
            )
        )
        for number in range(claims.replicates)
    }


def plan(claims: Iterable[Claim], overrides: Sequence[str] = ()) -> list[Sweep]:
    """Collect what the claims need: a sweep for each experiment and way to read it."""
    sweeps: dict[tuple[str, tuple[str, ...]], Sweep] = {}
    selections: dict[tuple[str, tuple[str, ...]], list[Selection]] = {}
    for claim in claims:
        if claim.trials not in sweeps:
            experiment, settings = claim.trials
            sweeps[claim.trials] = load_experiment(experiment, [*overrides, *settings])
        needed_cells(claim, sweeps[claim.trials])
        wanted = selections.setdefault(claim.trials, [])
        wanted += [selection for selection in _selections(claim) if selection not in wanted]
    return [
        replace(
            sweep,
            changes=" ".join(key[1]),
            metrics=list(
                dict.fromkeys(m for selection in selections[key] for m in selection.metrics)
            ),
            selections=selections[key],
        )
        for key, sweep in sweeps.items()
    ]


def _selections(claim: Claim) -> list[Selection]:
    """Return the cells that a claim takes, those before and after a change apart."""
    both = []
    for part in (claim.before, claim.after) if claim.before or claim.after else ({},):
        where = {
            key: [value for value in values if value in part.get(key, values)]
            for key, values in {**part, **claim.where}.items()
        }
        both.append(Selection(list(claim.metrics), where))
    return both


def needed_cells(claim: Claim, sweep: Sweep) -> list[Cell]:
    """Return the cells that a claim takes; a `ConfigError` names what is missing."""
    wheres = [selection.where for selection in _selections(claim)]
    found = [cell for cell in cells(sweep) if any(cell.matches(where) for where in wheres)]
    for part in (claim.where, claim.at, claim.before, claim.after):
        for key, values in part.items():
            missing = sorted(set(values) - _levels(found, key))
            if missing:
                raise ConfigError(
                    f"claim {claim.id!r} needs trials of {sweep.name} with {key} {missing[0]:g}, "
                    "which these settings leave out"
                )
    least = claim.rule.least_levels
    for key in claim.level:
        levels = _levels(found, key)
        if len(levels) < least:
            raise ConfigError(
                f"claim {claim.id!r} compares levels of {key}, at least {least} of them, and these "
                f"settings of {sweep.name} have {len(levels)}"
            )
    return found


def _levels(found: Sequence[Cell], key: str) -> set[float]:
    return {getattr(cell, key) for cell in found}
