"""Snakemake in forks of a server that has imported it: it takes longer to import than to plan."""

import os
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path

__all__ = ["run_snakemake"]

FORKS = get_context("forkserver")
# With what is imported late, but nothing of the project: some tests plan a copy of it.
LATE = ("snakemake.report.html_reporter", "snakemake.sourcecache", "smart_open", "yte")
FORKS.set_forkserver_preload(
    ["snakemake.cli", *LATE, "hydra", "pandas", "pydantic", "scipy.spatial"]
)


def run_snakemake(arguments: Sequence[str], folder: Path, log: Path) -> int | None:
    """Run it in a folder, have what it says written to a file, and return the exit code."""
    process = FORKS.Process(target=_run, args=(arguments, folder, log))
    process.start()
    try:
        process.join()
    finally:  # where the test takes too long
        process.kill()
    return process.exitcode


def _run(arguments: Sequence[str], folder: Path, log: Path) -> None:
    os.chdir(folder)
    with log.open("w") as stream:
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
    from snakemake.cli import main

    main(list(arguments))
