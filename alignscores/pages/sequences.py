"""The page of trajectories of each sequence: one run of each system against the reference."""

from typing import Any

from ..comparison.comparison import Comparison, settings_of_run
from ..comparison.runs import reference_of
from ..comparison.summary import Result, Summary
from ..evaluation.evaluation import LOST
from ..evaluation.notes import collected_warnings
from ..evaluation.settings import Settings
from ..metrics import metric
from ..texts import printable
from ..trajectories.files import Trajectory
from .estimates import Estimate, page_data

__all__ = ["reference_on", "sequences_data"]


def sequences_data(comparison: Comparison, by: str) -> dict[str, dict[str, Any]]:
    """Return the data of the page of each sequence with a scored run.

    It shows one run of each system: of the scored ones the one in the middle by a metric.
    """
    summary = comparison.summary
    data = {}
    for sequence in summary.sequences:
        estimates = [
            _estimate(chosen, summary)
            for system in summary.systems
            if (chosen := _middle(summary, by, system, sequence))
        ]
        if not estimates:
            continue
        reference, settings = reference_on(comparison, sequence)
        data[sequence] = page_data(
            f"{summary.sequence_names[sequence]}: one run of each system",
            reference,
            estimates,
            settings,
            summary.unit(sequence),
        )
    return data


def reference_on(comparison: Comparison, sequence: str) -> tuple[Trajectory, Settings]:
    """Return the reference of a sequence, and the settings of a scored run there."""
    scored = (result.run for result in comparison.summary.results if not result.failed)
    run = next(run for run in scored if run.sequence == sequence)
    settings = settings_of_run(comparison.benchmark, run, comparison.settings)
    with collected_warnings():  # the comparison has printed them
        return reference_of(comparison.benchmark.references[sequence], settings), settings


def _middle(summary: Summary, by: str, system: str, sequence: str) -> Result | None:
    """Return the scored run in the middle, of two the lesser one; None where there is none."""
    scored = [result for result in summary.of(system, sequence) if not result.failed]
    larger = metric(by).family.larger_is_better
    scored.sort(key=lambda result: result.outcome.scores[by], reverse=larger)
    return scored[len(scored) // 2] if scored else None


def _estimate(result: Result, summary: Summary) -> Estimate:
    run, outcome = result.run, result.outcome
    entry = summary.entries[run.system, run.sequence]
    notes = [printable(note) for note in outcome.all_notes]
    if entry.failed:
        notes.insert(0, f"of its {entry.runs} runs, {entry.failed} failed or are missing")
    name = summary.system_names[run.system] + (
        f", run {printable(run.run)}" if entry.runs > 1 else ""
    )
    return Estimate(
        name=name,
        rows=outcome.rows,
        lost=outcome.statuses == LOST,
        position_errors=outcome.position_errors,
        rotation_errors=outcome.rotation_errors,
        positions=outcome.positions,
        half=(outcome.scores["half_distance"], outcome.scores["half_angle"]),
        ate=outcome.ate,
        tracked=1 - outcome.lost,
        notes=[f"{name}: {note}" for note in notes],
    )
