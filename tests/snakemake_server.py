"""Snakemake in forks of a server that has imported it: it takes longer to import than to plan."""

import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

__all__ = ["copied_project", "home", "run_snakemake"]

ROOT = Path(__file__).resolve().parents[1]
FORKS = get_context("forkserver")
WARM = "tests.snakemake_warm"
LATE = ("snakemake.report.html_reporter", "snakemake.sourcecache", "smart_open", "yte")
FORKS.set_forkserver_preload(["snakemake.cli", *LATE, WARM])

Run = Callable[[Sequence[str], Path, Path], int | None]


def home(folder):
    """Return the variables that make a folder the home: Snakemake needs one it can write to."""
    kinds = {"XDG_CACHE_HOME": "cache", "XDG_CONFIG_HOME": "config", "XDG_DATA_HOME": "data"}
    return {"HOME": str(folder), **{name: str(folder / purpose) for name, purpose in kinds.items()}}


def run_snakemake(arguments, folder, log):
    """Run it in a folder, have what it says written to a file, and return the exit code.

    Its home is next to the log.
    """
    process = FORKS.Process(target=_run, args=(arguments, folder, log))
    process.start()
    try:
        process.join()
    finally:  # where the test takes too long
        process.kill()
    return process.exitcode


@contextmanager
def copied_project(project):
    """Yield what does so in forks of a process that has imported a copy of the project."""
    ours, theirs = FORKS.Pipe()
    process = FORKS.Process(target=_serve, args=(project, theirs))
    process.start()
    theirs.close()  # so that the end of the process is an EOFError, and no wait for ever
    ours.recv()  # when it is ready, and leads a group of its own

    def run(*task):
        ours.send(task)
        code = ours.recv()
        return code

    try:
        yield run
    finally:
        os.killpg(process.ident or 0, signal.SIGKILL)
        process.join()


def _run(arguments, folder, log):
    os.environ |= home(log.parent / "home")
    os.chdir(folder)
    with log.open("w") as stream:
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
    from snakemake.cli import main

    main(list(arguments))


def _serve(project, tasks):
    os.setsid()
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None) or ""
        if ROOT in Path(file).parents and not Path(file).is_relative_to(sys.prefix):
            del sys.modules[name]
    sys.path.insert(0, str(project))
    import_module(WARM)
    forks = get_context("fork")
    tasks.send(None)
    while True:
        process = forks.Process(target=_run, args=tasks.recv())
        process.start()
        process.join()
        tasks.send(process.exitcode)
