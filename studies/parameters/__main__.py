"""Parameter studies: ``python -m studies.parameters {threshold,registration,times} ...``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import Trials, read_table, read_trials, to_csv, write_files

from . import registrations, thresholds
from .axes import STUDIES, Axis, axes_of, check_parts, is_seeded
from .effects import effects
from .times import measure

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the tables and the findings of a study, or its run times; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.parameters",
        description="Compare the values of a study's axes, from the tables of its trials.",
    )
    parser.add_argument("study", choices=STUDIES)
    parser.add_argument("parts", nargs="+", type=Path, metavar="PART.csv")
    parser.add_argument(
        "--times", type=Path, required=True, metavar="FILE.csv", help="run times: read, or written"
    )
    parser.add_argument(
        "--output", type=Path, metavar="PATH", help="without extension; without it, measure times"
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    parts = {path.stem: read_trials(path) for path in options.parts}
    metrics = [part.record.metrics for part in parts.values()]
    axes = axes_of(options.study, next((m for m in metrics if not is_seeded(m)), []))
    check_parts(options.study, axes, parts)
    if options.output is None:
        sweeps = [part.sweep for part in parts.values() if is_seeded(part.record.metrics)]
        files = {options.times: to_csv(measure(axes, sweeps))}
    else:
        write = _thresholds if options.study == "threshold" else _registrations
        files = write(options.output, axes, parts, options.times)
    write_files(files)
    return list(files)


def _thresholds(
    output: Path, axes: Sequence[Axis], parts: dict[str, Trials], times: Path
) -> dict[Path, bytes]:
    table = effects(axes, {name: part.table for name, part in parts.items()})
    files = {
        output.with_name(f"{output.name}_{kind}.csv"): to_csv(rows)
        for kind, rows in table.groupby(table["axis"].str.partition("_")[0], sort=False)
    }
    text = thresholds.to_markdown(
        axes, table, read_table(times, dtype={"value": str}), parts["outliers"].sweep.trials
    )
    return {**files, output.with_name(f"{output.name}.md"): text.encode()}


def _registrations(
    output: Path, axes: Sequence[Axis], parts: dict[str, Trials], times: Path
) -> dict[Path, bytes]:
    (axis,) = axes
    table = registrations.compare(axis, parts)
    text = registrations.to_markdown(axis, table, read_table(times))
    return {
        output.with_name(f"{output.name}.csv"): to_csv(table),
        output.with_name(f"{output.name}.md"): text.encode(),
    }


if __name__ == "__main__":
    sys.exit(main())
