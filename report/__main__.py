"""Write the report: ``python -m report [key=value ...]``."""

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from experiments.claims import load_claims
from experiments.config import ConfigError, load
from experiments.replicate import FIRST
from experiments.tables import write_files

from .inputs import InputError, read_inputs
from .page import render

__all__ = ["main"]

HELP = """\
settings are Hydra overrides, the ones that the workflow was run with; and replicates=20:
  results_dir=results   where the tables and figures are, and where the page goes

snakemake report makes all that the page needs, and the page
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/report.html``; return the exit code: 1 for files, 2 for settings."""
    parser = argparse.ArgumentParser(
        prog="python -m report",
        description="Write verdicts, figures and evidence on one self-contained page.",
        epilog=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("overrides", nargs="*", metavar="key=value")
    overrides = parser.parse_args(arguments).overrides
    number = [o.partition("=")[2] for o in overrides if o.startswith("replicates=")]
    others = [o for o in overrides if not o.startswith("replicates=")]
    try:
        n_replicates = load_claims(_whole(number[-1])).replicates if number else None
        config = load([f"experiment={FIRST}", *others])
        claims = load_claims()
    except ConfigError as error:
        return _fail(2, str(error))
    results = Path(config.results_dir)
    try:
        inputs = read_inputs(results, claims, n_replicates)
    except InputError as error:
        takes_number = error.module == "experiments.verdicts"
        command = shlex.join([*error.module.split(), *(overrides if takes_number else others)])
        return _fail(1, f"{error}; run: python -m {command}")
    path = results / "report.html"
    try:
        write_files({path: render(inputs).encode()})
    except OSError as error:
        return _fail(1, f"cannot write {path}: {error.strerror}")
    print(path)
    return 0


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ConfigError(f"setting 'replicates' must be a whole number, not {text!r}") from None


def _fail(code: int, message: str) -> int:
    print(f"report: {message}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
