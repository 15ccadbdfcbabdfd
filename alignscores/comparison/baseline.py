"""A comparison against a saved one: what is new or gone, and which systems are better or worse.

The runs of a system now and those that were saved are compared as two systems are.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..evaluation.settings import Settings
from ..io import FileError
from ..io.files import read_text
from ..metrics import metric
from ..texts import first_few, printable
from .benchmark import Run
from .runs import COLUMNS, Outcome
from .statistics import LEVEL, holm
from .summary import Pair, Result, Results, Summary, by_system, compared
from .tables import Cell, Table, number
from .verdicts import difference_text, p_text

__all__ = ["Change", "Changes", "changes", "read_baseline"]


Place = tuple[str, str]  # a system and a sequence


@dataclass(frozen=True, eq=False)
class Change:
    """The runs of a system now (a) and saved (b), with Holm's one-sided p-values over systems."""

    system: str
    pair: Pair
    worse: float
    better: float

    @property
    def change(self) -> str | None:
        """What is significant."""
        return "worse" if self.worse <= LEVEL else "better" if self.better <= LEVEL else None

    def to_dict(self) -> dict[str, Any]:
        """Return its entry of the JSON output."""
        now, saved = self.pair.means
        entry = {"system": self.system, "saved": saved, "now": now, "wins": self.pair.wins}
        entry |= self.pair.interval()
        return entry | {"p_worse": self.worse, "p_better": self.better, "change": self.change}


@dataclass(frozen=True, eq=False)
class Changes:
    """What changed against a saved comparison, by one metric."""

    file: str
    metric: str
    notes: list[str]  # what is new or gone
    gone: list[Place]  # where there was a run, and is none
    saved: Mapping[str, Results]  # by system
    systems: list[Change]
    may_be_worse: bool  # there are enough runs for a significant change

    def to_dict(self) -> dict[str, Any]:
        """Return what the JSON output has of it, in which numbers may not be finite."""
        entry = {"file": printable(self.file), "metric": self.metric, "notes": self.notes}
        return entry | {"systems": [one.to_dict() for one in self.systems]}

    def table(self) -> Table:
        """Return a row for each system."""
        header = ["system", "saved", "now", "wins", "difference", "change"]
        rows = []
        for one in self.systems:
            change = one.change or "not significant"
            p = one.better if one.change == "better" else one.worse
            texts = (
                one.system,
                number(one.pair.means[1]),
                number(one.pair.means[0]),
                f"{one.pair.wins:.0%}",
                difference_text(one.pair.difference, significant=one.change is not None),
                "too few runs" if math.isnan(p) else f"{change} ({p_text(p)})",
            )
            rows.append(list(map(Cell, texts)))
        return Table(header, rows)


def read_baseline(file: str, settings: Settings) -> list[Result]:
    """Return the runs of a saved comparison, which must have been made with these settings."""
    text = read_text(file)
    try:
        saved = json.loads(text)
        results = [_saved_run(result) for result in saved["results"]]
    except (KeyError, OverflowError, RecursionError, TypeError, ValueError):
        raise FileError(file, "is not what `alignscores compare --json` prints") from None
    for name, value in json.loads(json.dumps(settings.to_dict())).items():
        if name not in ("frames", "reference_sigma") and saved.get(name, value) != value:
            was = json.dumps(saved[name])
            raise FileError(file, f"has {name} {was}, not {json.dumps(value)}: nothing compares")
    return results


def _saved_run(result: Mapping[str, Any]) -> Result:
    """Return a saved run; null means an infinite error."""
    texts = [result[name] for name in ("sequence", "system", "run")]
    texts += [result[name] or "" for name in ("file", "error")]
    if not all(isinstance(text, str) for text in texts):
        raise TypeError
    scores = {name: result[name] for name in COLUMNS} | result["metrics"]
    values = {name: metric(name).worst if v is None else float(v) for name, v in scores.items()}
    run = Run(result["sequence"], result["system"], result["run"], result["file"])
    return Result(run, Outcome(values, error=result["error"] or ""))


def changes(
    summary: Summary, file: str, saved: Sequence[Result], name: str, paired: bool = False
) -> Changes:
    """Compare all systems by a metric with the saved runs of the same benchmark."""
    places, were = (
        dict.fromkeys((result.run.system, result.run.sequence) for result in own)
        for own in (summary.results, saved)
    )
    gone = [key for key in were if key not in places]
    new = [key for key in places if key not in were]
    notes = [
        f"{what}: {first_few([f'{system} on {s}' for system, s in own])}"
        for what, own in (("new", new), ("gone", gone))
        if own
    ]
    before, after = by_system(saved), by_system(summary.results)
    pairs = {
        system: pair
        for system in summary.systems
        if system in before
        if (pair := compared(after[system], before[system], name, paired))
    }
    tests = [p.test if p.test.smallest <= LEVEL else None for p in pairs.values()]
    worse = holm([test.worse if test else math.nan for test in tests]).tolist()
    better = holm([test.better if test else math.nan for test in tests]).tolist()
    systems = list(map(Change, pairs, pairs.values(), worse, better))
    smallest = [test.smallest for test in tests if test]
    enough = bool(smallest) and min(smallest) * len(smallest) <= LEVEL
    return Changes(file, name, notes, gone, before, systems, enough)
