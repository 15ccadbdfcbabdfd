"""A comparison against a saved one: what is new or gone, and which systems are certainly worse.

The runs of a system now and those that were saved are compared as two systems are, on the sequences
of both, with an interval of 95 % for each system.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..evaluation.evaluation import finite_or_none
from ..evaluation.settings import Settings
from ..metrics import metric
from ..texts import column_widths, padded, printable
from ..trajectories.files import FileError
from ..trajectories.files.text import read_text
from .benchmark import Run
from .comparison import Comparison
from .runs import COLUMNS, Outcome
from .summary import summarise

__all__ = ["Changes", "changes", "read_baseline"]

NOW, SAVED = "now", "saved"
NEEDED = {"sequence", "system", "run", "error", "metrics", "n", "lost", "unit", *COLUMNS}
ELSEWHERE = ("frames",)  # settings that are paths: what changed shows in d

Entry = dict[str, Any]  # of the JSON output
Runs = list[tuple[Run, Outcome]]


@dataclass(frozen=True)
class Changes:
    """What changed against a saved comparison, by one metric."""

    file: str
    metric: str
    notes: list[str]  # what is new or gone, and what does not compare
    systems: list[Entry]  # those that are in both

    @property
    def worse(self) -> bool:
        """Whether a system is certainly worse."""
        return any(entry["change"] == "worse" for entry in self.systems)

    def to_dict(self) -> Entry:
        """Return what the JSON output has of it."""
        return {**vars(self), "file": printable(self.file), "worse": self.worse}

    def table(self) -> list[list[str]]:
        """Return a header, and a row of texts for each system."""
        rows = [["system", SAVED, NOW, "difference", "95 % interval", "change"]]
        for entry in self.systems:
            saved, now = (_number(entry[key], ".4g") for key in (SAVED, NOW))
            difference, low, high = (
                _number(entry[key], "+.4g") for key in ("difference", "low", "high")
            )
            interval = "-" if entry["low"] is None else f"{low} to {high}"
            change = entry["change"] or "none that is certain"
            rows.append([printable(entry["system"]), saved, now, difference, interval, change])
        return rows

    def as_text(self) -> str:
        """Return the table for a terminal, and the notes."""
        rows = self.table()
        widths = column_widths(rows)
        lines = ["  ".join(map(padded, row, widths)).rstrip() for row in rows]
        return "\n".join([f"{self.metric} against {printable(self.file)}", *lines, *self.notes])


def read_baseline(file: str, settings: Settings) -> list[Entry]:
    """Return the results of a saved comparison, which must have been made with these settings."""
    text = read_text(file)
    try:
        saved = json.loads(text)
        results = saved["results"]
        known = all(result.keys() >= NEEDED for result in results) and results
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError):
        known = False
    if not known:
        raise FileError(file, "is not what `alignscores compare --json` prints")
    for name, value in json.loads(json.dumps(settings.to_dict())).items():
        if name not in ELSEWHERE and saved.get(name, value) != value:
            was = json.dumps(saved[name])
            raise FileError(file, f"has {name} {was}, not {json.dumps(value)}: nothing compares")
    return list(results)


def changes(
    comparison: Comparison, file: str, results: Sequence[Mapping[str, Any]], name: str
) -> Changes:
    """Compare all systems by a metric with the saved results of the same benchmark."""
    now, saved = comparison.summary.runs, [_saved_run(result, name) for result in results]
    notes = [
        f"{what}: {', '.join(map(printable, names))}"
        for first, second, new in ((now, saved, "new"), (saved, now, "gone"))
        for what, names in _only_in(first, second, new)
    ]
    for sequence in comparison.summary.sequences:
        units = [_unit(runs, sequence) for runs in (saved, now)]
        if all(units) and not math.isclose(*units, rel_tol=1e-6):
            notes.append(
                f"left out: sequence {printable(sequence)}, whose d was {units[0]:.4g} and is "
                f"{units[1]:.4g}"
            )
            now = [(run, outcome) for run, outcome in now if run.sequence != sequence]
    both = {_place(run) for run, _ in now} & {_place(run) for run, _ in saved}
    systems = []
    for system in comparison.summary.systems:
        pair = [
            (replace(run, system=which), outcome)
            for which, runs in ((NOW, now), (SAVED, saved))
            for run, outcome in runs
            if run.system == system and _place(run) in both
        ]
        if pair:
            systems.append({"system": system, **_change(pair, name, comparison)})
    return Changes(file, name, notes, systems)


def _saved_run(result: Mapping[str, Any], name: str) -> tuple[Run, Outcome]:
    """Return a saved run with its value of the metric; null stands for an infinite one."""
    value = {**result, **result["metrics"]}.get(name)
    run = Run(result["sequence"], result["system"], result["run"], result.get("file"))
    outcome = Outcome(
        {name: metric(name).worst if value is None else value},
        n=result["n"],
        unit=result["unit"] or math.nan,
        n_parts=result.get("parts", 1),
        error=result["error"] or "",
    )
    return run, outcome


def _only_in(first: Runs, second: Runs, new: str) -> list[tuple[str, list[str]]]:
    """Return the sequences, systems and runs that are in the first alone, each with what it is."""
    found = []
    told: set[Run] = set()
    for kind in ("sequence", "system"):
        known = {getattr(run, kind) for run, _ in second}
        runs = [run for run, _ in first if getattr(run, kind) not in known]
        if runs:
            found.append(
                (f"{new} {kind}s", list(dict.fromkeys(getattr(run, kind) for run in runs)))
            )
            told.update(runs)
    there = {(*_place(run), run.run) for run, _ in second}
    others = [run for run, _ in first if run not in told and (*_place(run), run.run) not in there]
    if others:
        found.append(
            (f"{new} runs", [f"{run.system} on {run.sequence}, {run.run}" for run in others])
        )
    return found


def _place(run: Run) -> tuple[str, str]:
    return run.system, run.sequence


def _unit(runs: Runs, sequence: str) -> float:
    """Return d of a sequence; 0 where no run on it was scored."""
    units = [outcome.unit for run, outcome in runs if run.sequence == sequence]
    return max((unit for unit in units if math.isfinite(unit)), default=0.0)


def _change(runs: Runs, name: str, comparison: Comparison) -> Entry:
    """Return how the runs of a system now differ from the saved ones."""
    extra = [] if name in COLUMNS else [name]
    summary = summarise(runs, extra, comparison.settings.form)
    means = {which: finite_or_none(summary.entries[which, None][name]) for which in (NOW, SAVED)}
    found = [
        entry
        for entry in summary.comparisons
        if (entry["metric"], entry["sequence"]) == (name, None)
    ]
    entry = found[0] if found else {}
    better = {entry.get("a"): "a", entry.get("b"): "b"}
    sign = 1 if entry.get("a") == NOW else -1
    ends = sorted(sign * entry.get(key, math.nan) for key in ("low", "high"))
    change = None
    if entry.get("better"):
        change = "better" if entry["better"] == better[NOW] else "worse"
    return {
        **means,
        "difference": finite_or_none(sign * entry.get("difference", math.nan)),
        "low": finite_or_none(ends[0]),
        "high": finite_or_none(ends[1]),
        "question": entry.get("question"),
        "change": change,
    }


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
