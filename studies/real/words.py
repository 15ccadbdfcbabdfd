"""What repeated runs say of metrics, in words."""

import numpy as np
import pandas as pd

from ..words import document, listed, markdown_table

ALIKE = 0.95  # correlation of the runs by two metrics, of which one says nothing new
DONE = {  # what was done to the estimates, by the name of the change
    "every_2nd": "keeping every 2nd pose",
    "every_5th": "keeping every 5th pose",
    "frames_lost": "losing a tenth of the poses",
    "time_lost": "losing a tenth of the time",
    "wild_stretch": "throwing a tenth of the way about",
    "scale": "another scale",
    "seed": "another seed",
}
MUCH = 1.0  # standard deviations of runs, by which a change moves one


def changes_of(table: pd.DataFrame) -> list[str]:
    """Return the columns of what moves a metric."""
    return [str(name) for name in table if str(name).startswith("moves_")]


def sentences(table: pd.DataFrame, pairs: pd.DataFrame, agreement: pd.DataFrame) -> list[str]:
    """Say which metric needs the fewest runs, which say the same, and what moves them."""
    found = [_scope(pairs), _fewest(table), _alike(agreement), _against(pairs)]
    found += [_moved(table, column) for column in changes_of(table)]
    return [sentence for sentence in found if sentence]


def _scope(pairs: pd.DataFrame) -> str:
    places = pairs.drop_duplicates(["sequence", "a", "b"])
    systems = sorted({*places["a"], *places["b"]})
    n_sequences = places["sequence"].nunique()
    return (
        f"{len(places)} pairs of systems and sequences with three or more runs of each: "
        f"{', '.join(systems)} on {n_sequences} sequence{'s' if n_sequences > 1 else ''}."
    )


def _fewest(table: pd.DataFrame) -> str:
    told = [
        f"{row['metric']} ({_runs(row['runs'])} runs, {row['order']:.0f} % in the right order)"
        for _, row in table.head(3).iterrows()
    ]
    return f"Fewest runs tell two systems apart, in the median, by {listed(told)}."


def _alike(agreement: pd.DataFrame) -> str:
    pairs = agreement[(agreement["metric"] < agreement["other"])]
    alike = pairs[pairs["correlation"] >= ALIKE].sort_values("correlation", ascending=False)
    told = [f"{row.metric} and {row.other} ({row.correlation:.2f})" for row in alike.itertuples()]
    if not told:
        return f"No two metrics order the runs alike (no rank correlation reaches {ALIKE})."
    return f"These order the runs alike, so that one of two is enough: {listed(told)}."


def _against(pairs: pd.DataFrame) -> str:
    """Say where a metric is certain of the order that most of the certain ones turn round."""
    told = pairs[pairs["told"]]
    found = []
    for (sequence, a, b), group in told.groupby(["sequence", "a", "b"], sort=False):
        votes = group["better"].value_counts()
        if len(votes) > 1 and votes.iloc[0] > votes.iloc[1]:
            against = group.loc[group["better"] != votes.index[0], "metric"]
            found.append(f"{listed(list(against))} on {sequence} ({a} or {b})")
    return f"Certain against most of the others: {'; '.join(found)}." if found else ""


def _moved(table: pd.DataFrame, column: str) -> str:
    change = DONE[column.removeprefix("moves_")].capitalize()
    moved = table[table[column] >= MUCH].sort_values(column, ascending=False)
    if moved.empty:
        return f"{change} moves none by as much as another run."
    told = [f"{row['metric']} ({row[column]:.1f})" for _, row in moved.iterrows()]
    return f"{change} moves {listed(told)} by more than another run."


def to_markdown(table: pd.DataFrame, pairs: pd.DataFrame, agreement: pd.DataFrame) -> str:
    """Write the table of all metrics, and the sentences."""
    changes = changes_of(table)
    names = [name.removeprefix("moves_").replace("_", " ") for name in changes]
    header = ["metric", "runs needed", "told, %", "order, %", "by others, %", "between, %", *names]
    rows = []
    for _, row in table.iterrows():
        cells = [row["metric"], _runs(row["runs"])]
        cells += [f"{row[name]:.0f}" for name in ("told", "order", "agrees", "between")]
        rows.append([*cells, *(f"{row[name]:.2f}" for name in changes)])
    return document(markdown_table(header, rows), sentences(table, pairs, agreement))


def _runs(count: float) -> str:
    return f"{count:.0f}" if np.isfinite(count) else "> 50"
