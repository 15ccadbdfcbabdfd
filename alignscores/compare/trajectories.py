"""The page of one's own files of each sequence: one run of each system against the reference."""

import argparse
from collections.abc import Mapping
from typing import Any

from ..cli.names import printable
from ..cli.notes import collected_warnings
from ..cli.page import Estimate, page_data
from .benchmark import Run
from .runs import Outcome, larger_is_better, read_reference
from .summary import Summary

__all__ = ["trajectories"]


def trajectories(
    summary: Summary,
    by: str,
    names: Mapping[str, str],
    references: Mapping[str, tuple[str, argparse.Namespace]],
) -> dict[str, dict[str, Any]]:
    """Return what the scripts of the page of one's own files read, of each sequence.

    Sequences of which no run was scored are left out.

    Parameters
    ----------
    summary : Summary
        What is shown.
    by : str
        Metric by which the run of a system is chosen: of those that were scored, the middle one.
    names : mapping of str to str
        Names of systems and sequences as they are shown.
    references : mapping of str to (str, Namespace)
        Reference of each sequence, and the options of its runs.

    Raises
    ------
    ValueError
        Where a reference cannot be read any more.
    """
    found = {}
    for sequence in summary.sequences:
        file, options = references[sequence]
        estimates = [
            _estimate(*chosen, summary, names)
            for system in summary.systems
            if (chosen := _middle(summary, by, system, sequence))
        ]
        if not estimates:
            continue
        unit = next(one.unit for run, one in summary.runs if run.sequence == sequence and one.n)
        with collected_warnings():  # the command has told them
            reference = read_reference(file, options.format)
        found[sequence] = page_data(
            f"{names[sequence]}: one run of each system",
            reference,
            printable(file),
            estimates,
            argparse.Namespace(**{**vars(options), "unit": unit}),
        )
    return found


def _middle(summary: Summary, by: str, system: str, sequence: str) -> tuple[Run, Outcome] | None:
    """Return the scored run in the middle, of two the lesser one; None where there is none."""
    scored = [
        ({**result, **result["metrics"]}[by], run, outcome)
        for result, (run, outcome) in zip(summary.results, summary.runs, strict=True)
        if (run.system, run.sequence) == (system, sequence) and outcome.n
    ]
    scored.sort(key=lambda one: one[0], reverse=larger_is_better(by))
    return scored[len(scored) // 2][1:] if scored else None


def _estimate(run: Run, outcome: Outcome, summary: Summary, names: Mapping[str, str]) -> Estimate:
    entry = summary.entries[run.system, run.sequence]
    notes = [printable(note) for note in outcome.notes]
    if failed := entry["failed_runs"]:
        notes.insert(0, f"of its {entry['runs']} runs, {failed} failed or are missing")
    name = names[run.system] + (f", run {printable(run.run)}" if entry["runs"] > 1 else "")
    scores = outcome.scores
    return Estimate(
        name=name,
        file=printable(run.file or ""),
        rows=outcome.rows,
        statuses=outcome.statuses,
        position_errors=outcome.position_errors,
        rotation_errors=outcome.rotation_errors,
        positions=outcome.positions,
        tas=(scores["TAS"], None),
        pas=(scores["PAS"], None),
        half=(scores["half_distance"], scores["half_angle"]),
        notes=[f"{name}: {note}" for note in notes],
    )
