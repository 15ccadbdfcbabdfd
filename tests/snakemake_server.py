"""Snakemake in forks of a server that has imported it: it takes longer to import than to plan."""

import os
import sys
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path

__all__ = ["run_snakemake"]

ROOT = Path(__file__).resolve().parents[1]
FORKS = get_context("forkserver")
LATE = ("snakemake.report.html_reporter", "snakemake.sourcecache", "smart_open", "yte")
FORKS.set_forkserver_preload(["snakemake.cli", *LATE, "tests.snakemake_warm"])


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
    if str(ROOT / "Snakefile") not in arguments:
        _forget_the_project()
    from snakemake.cli import main

    main(list(arguments))


def _forget_the_project() -> None:
    """Have a copy of the project import its own modules."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None) or ""
        if ROOT in Path(file).parents and not Path(file).is_relative_to(sys.prefix):
            del sys.modules[name]
