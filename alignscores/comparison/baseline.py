"""A comparison against saved runs: what is new or gone, and which systems are better or worse.

The runs of a system now and those that were saved are compared as two systems are.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ..io import FileError
from ..texts import first_few, printable
from .comparison import Comparison, for_json, read_runs
from .statistics import holm
from .summary import checked_runs, compare_systems, completed, records, values_of
from .tables import TEXT, TableStyle, number
from .verdict import contrast_text, difference_text, p_text

__all__ = ["GATE_LEVEL", "Changes", "changes", "changes_table", "means_of_both", "read_baseline"]

GATE_LEVEL = 0.01  # of ``worse``: among 50 builds of equal systems, 0.5 are expected to fail


@dataclass(frozen=True, eq=False)
class Changes:
    """What changed against saved runs, by a metric.

    `systems` has a row for each system: its means on the sequences of both, `wins` of the new runs,
    the difference with its interval, one-sided p-values by Holm's method over the systems, and what
    is significant at `level`. `p_smallest` is the least p-value that so many runs can have.
    """

    file: str
    by: str
    larger: bool
    level: float
    systems: pd.DataFrame
    new: list[str]
    gone: list[str]  # where there were runs, or more runs
    saved: pd.DataFrame
    now: pd.DataFrame

    @property
    def without_power(self) -> list[str]:
        """Why systems cannot be significantly worse, whatever their runs are."""
        lines = []
        for row in records(self.systems[~(self.systems["p_smallest"] <= self.level)]):
            reason = "too few to test"
            if math.isfinite(row["p_smallest"]):
                reason = f"p is at least {row['p_smallest']:.2g}"
            lines.append(
                f"{row['system']}: worse cannot be significant at {self.level:g} with "
                f"{row['runs_now']} against {row['runs_saved']} runs ({reason}); more runs are "
                "needed, or a higher level"
            )
        return lines

    @property
    def is_void(self) -> bool:
        """Whether no system that is in both can be significantly worse."""
        return len(self.systems) > 0 and not (self.systems["p_smallest"] <= self.level).any()

    @property
    def notes(self) -> list[str]:
        """What is new or gone, and who cannot be worse."""
        lists = (("new", self.new), ("gone", self.gone))
        lines = [f"{what}: {first_few(entries)}" for what, entries in lists if entries]
        return lines + self.without_power

    def to_dict(self) -> dict[str, Any]:
        """Return what the JSON output has of it."""
        entry = {"file": printable(self.file), "metric": self.by, "level": self.level}
        return entry | {"notes": self.notes, "systems": for_json(self.systems)}


def read_baseline(file: str, by: str) -> pd.DataFrame:
    """Return the runs of a saved comparison."""
    try:
        return checked_runs(read_runs(file), by)
    except FileError:
        raise
    except ValueError as error:
        raise FileError(file, str(error)) from None


def changes(
    comparison: Comparison, file: str, saved: pd.DataFrame, level: float = GATE_LEVEL
) -> Changes:
    """Compare all systems with their saved runs; these must have been scored in the same way.

    A value that a system has in the saved runs or now, and lacks in a run, is the worst one.
    """
    by, larger = comparison.by, comparison.larger
    both = pd.concat(
        [saved.assign(when="saved"), comparison.runs.assign(when="now")], ignore_index=True
    )
    _check_settings(both, file)
    both = completed(both, by, "larger" if larger else "smaller")
    saved, now = (both[both["when"] == when] for when in ("saved", "now"))
    before, after = values_of(saved, by, larger), values_of(now, by, larger)
    rows = [
        {"system": system, **row}
        for system in comparison.runs["system"].unique()
        if system in before and system in after
        if (row := compare_systems(after[system], before[system], comparison.design))
    ]
    whens = pd.DataFrame({when: both["when"].eq(when) for when in ("saved", "now")})
    counts = whens.groupby([both["system"], both["sequence"]], sort=False).sum()
    new, gone = [], []
    for row in records(counts.reset_index()):
        where, n, n_saved = f"{row['system']} on {row['sequence']}", row["now"], row["saved"]
        if not n_saved:
            new.append(where)
        elif n < n_saved:
            gone.append(f"{where} ({n} of {n_saved} runs left)" if n else where)
    return Changes(file, by, larger, level, _systems(rows, level), new, gone, saved, now)


def _systems(rows: list[dict[str, Any]], level: float) -> pd.DataFrame:
    """Return the table of the systems; those whose runs can reach the level are tested."""
    tests = [row["test"] for row in rows]
    testable = np.array([test.possible and test.smallest <= level for test in tests], dtype=bool)
    worse, better = (
        holm(np.where(testable, [getattr(test, tail) for test in tests], np.nan)).tolist()
        for tail in ("worse", "better")
    )
    names = ["system", "mean_b", "mean_a", "wins", "difference", "low", "high", "runs_b", "runs_a"]
    table = pd.DataFrame(rows, columns=names).rename(
        columns={"mean_a": "now", "mean_b": "saved", "runs_a": "runs_now", "runs_b": "runs_saved"}
    )
    smallest = np.array([test.smallest if test.possible else math.nan for test in tests])
    adjusted = holm(np.where(testable, smallest, np.nan))
    table["p_smallest"] = np.where(testable, adjusted, smallest)
    table["p_worse"], table["p_better"] = worse, better
    table["change"] = pd.Series(
        [
            "worse" if p_worse <= level else "better" if p_better <= level else None
            for p_worse, p_better in zip(worse, better, strict=True)
        ],
        dtype=object,
    )
    return table


def _check_settings(both: pd.DataFrame, file: str) -> None:
    """Check that the saved runs of a system on a sequence were scored with the same settings."""
    texts = both.groupby(["system", "sequence", "when"], sort=False)["settings"].first().unstack()
    different = texts.dropna()[lambda table: table["saved"] != table["now"]]
    for row in records(different.reset_index())[:1]:
        saved, now = (row[when] or "default settings" for when in ("saved", "now"))
        where = f"{row['system']} on {row['sequence']}"
        raise FileError(file, f"the baseline used {saved}, this run {now} ({where})")


def changes_table(changed: Changes, style: TableStyle = TEXT) -> pd.DataFrame:
    """Return the table of the systems as texts."""
    rows = []
    n_tests = changed.systems["p_worse"].count()
    for row in records(changed.systems):
        p = row["p_better"] if row["change"] == "better" else row["p_worse"]
        interval = (row[name] for name in ("difference", "low", "high"))
        difference = difference_text(*interval, significant=bool(row["change"]))
        change = f"{row['change'] or 'not significant'} ({p_text(p, n_tests)})"
        if contrast := contrast_text(row["wins"], row["difference"], changed.larger):
            change += f", {contrast}"
        rows.append(
            {
                "system": style.escape(row["system"]),
                "saved": number(row["saved"]),
                "now": number(row["now"]),
                "wins": f"{row['wins']:.0%}",
                "difference": difference if math.isfinite(row["difference"]) else "-",
                "change": "too few runs" if math.isnan(p) else change,
            }
        )
    return pd.DataFrame(rows, columns=["system", "saved", "now", "wins", "difference", "change"])


def means_of_both(changed: Changes, name: str) -> pd.DataFrame:
    """Return the means of a metric, saved and now, on the sequences of both, by system."""
    means = {
        when: table.groupby(["system", "sequence"], sort=False)[name].mean()
        for when, table in (("saved", changed.saved), ("now", changed.now))
    }
    return pd.DataFrame(means).dropna().groupby("system", sort=False).mean().reset_index()
