"""Compare results with the published ones: ``python -m experiments.check results``.

``experiments/published`` has the settings of the paper's experiments, the means of each cell and
the tables of the studies, to six digits. A table of trials must also fit its record: there any
changed digit is noticed, in other tables one of the first five. Of the claims each that differs is
named, with what differs.
"""

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import TypeAdapter

from .command import CommandError, run_command
from .config import Sweep, flat
from .grid import CELL_SETTINGS
from .tables import read_record, read_table, read_trials, to_csv, write_files

__all__ = ["main"]

PUBLISHED = Path(__file__).with_name("published")
DIGITS = 6
TOLERANCE = 1e-5  # relative: the last digits of a trial depend on the processor
N_SHOWN = 3  # differences of a table
TARGETS = {  # of Snakemake, that make what `snakemake figures` does not
    "claims": ("claims.csv", "tables/criteria.csv", "tables/readings.csv"),
    "readings": ("tables/minus59.csv",),
}
NOT_SET = ("changes", "selections")  # of a sweep: they are in no file of settings


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare the tables in a folder; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.check",
        description="Compare results of the study with the published ones.",
    )
    parser.add_argument("results", type=Path, metavar="RESULTS", help="the folder of results")
    parser.add_argument("--publish", action="store_true", help="publish these results instead")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[str]:
    names = ["trials/*.csv", "claims.csv", "tables/*.csv"]
    paths = [path for name in names for path in sorted(options.results.glob(name))]
    if options.publish:
        files = {PUBLISHED / p.relative_to(options.results): to_csv(_read(p)) for p in paths}
        for path in paths:
            if path.parent.name == "trials":
                published = PUBLISHED / path.relative_to(options.results).with_suffix(".json")
                files[published] = (json.dumps(_settings(path), indent=2) + "\n").encode()
        return [f"published {path}" for path in write_files(files)]
    published = [path.relative_to(PUBLISHED) for path in sorted(PUBLISHED.rglob("*.csv"))]
    present = [name for name in published if options.results / name in paths]
    if not present:
        raise CommandError(f"{options.results} has no published table; run: snakemake figures")
    differing = {}
    for name in present:
        path = options.results / name
        if name.parent.name == "trials" and (
            others := list(_other_settings(path, PUBLISHED / name))
        ):
            differing[path] = f"other settings: {_list(others)}"
        elif differences := list(_differences(_read(path), PUBLISHED / name)):
            is_short = name.name != "claims.csv"
            differing[path] = _list(differences) if is_short else "; ".join(differences)
    if differing:
        texts = [f"{path} ({differences})" for path, differences in differing.items()]
        raise CommandError(f"not as published: {', '.join(texts)}")
    n = len(present)
    lines = [f"{options.results / name} is as published" for name in present]
    return [*lines, f"{n} of {n} compared tables agree{_missing(published, present)}"]


def _missing(published: Sequence[Path], present: Sequence[Path]) -> str:
    """Return which published tables do not exist here, by the target that makes them."""
    made: dict[str, list[str]] = {}
    for name in (path.as_posix() for path in published if path not in present):
        target = next((target for target, names in TARGETS.items() if name in names), "figures")
        made.setdefault(f"snakemake {target}", []).append(name)
    texts = [f"{', '.join(names)} (by {target})" for target, names in made.items()]
    return f"; not made yet: {'; '.join(texts)}" if texts else ""


def _list(differences: Sequence[str]) -> str:
    n_more = len(differences) - N_SHOWN
    return "; ".join([*differences[:N_SHOWN], *([f"{n_more} more"] if n_more > 0 else [])])


def _read(path: Path) -> pd.DataFrame:
    """Read a table as it is published: rounded, of trials the mean of each cell."""
    if path.parent.name == "trials":
        trials = read_trials(path)
        table = trials.table.groupby(list(CELL_SETTINGS))[trials.record.metrics].mean()
        table = table.reset_index()
    else:
        table = read_table(path)
    return table.map(lambda cell: float(f"{cell:.{DIGITS}g}") if isinstance(cell, float) else cell)


def _settings(path: Path) -> dict[str, Any]:
    """Return the settings of a table of trials, as they are published."""
    (sweep,) = read_record(path).sweeps
    settings = TypeAdapter(Sweep).dump_python(sweep)
    return flat({key: value for key, value in settings.items() if key not in NOT_SET})


def _other_settings(path: Path, published: Path) -> Iterator[str]:
    """Yield the settings of a table of trials that differ from the published one's."""
    if path.parent.name != "trials":
        return
    theirs = json.loads(published.with_suffix(".json").read_bytes())
    for key, ours in _settings(path).items():
        if key in theirs and ours != theirs[key]:
            yield f"{key} {_write(ours)}, published {_write(theirs[key])}"


def _write(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _differences(table: pd.DataFrame, path: Path) -> Iterator[str]:
    """Yield where a table differs from the published one."""
    published = pd.read_csv(path)
    if list(table) != list(published) or len(table) != len(published):
        yield f"{table.shape} rows and columns, published {published.shape}"
        return
    names = table["id"] if "id" in table else [f"row {n + 1}" for n in range(len(table))]
    differences: dict[int, list[str]] = {}
    for column in table:
        ours, theirs = table[column], published[column]
        if pd.api.types.is_numeric_dtype(ours) and pd.api.types.is_numeric_dtype(theirs):
            same = np.isclose(ours, theirs, rtol=TOLERANCE, atol=TOLERANCE / 10, equal_nan=True)
        else:
            same = (ours == theirs) | (ours.isna() & theirs.isna())
        for row in np.flatnonzero(~np.asarray(same)).tolist():
            text = f"{column} is {ours[row]}, published {theirs[row]}"
            differences.setdefault(row, []).append(text)
    for index, texts in sorted(differences.items()):
        yield f"{names[index]}, {', '.join(texts)}"


if __name__ == "__main__":
    sys.exit(main())
