"""Run sweeps and write their table: ``python -m experiments.run experiment=outliers [key=value]``.

Every table of trials is made by this program; Snakemake passes it the resolved settings.
"""

import signal

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    # The system ends the process, at any moment; tables are renamed into place, whole.
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from .command import ConfigError, problems, run_command
from .config import (
    EXECUTION,
    Execution,
    Sweep,
    experiment_names,
    load,
    load_execution,
    split_override,
)
from .tables import SWEEPS, write_trials

__all__ = ["main", "resolved"]

HELP = """\
settings are Hydra overrides:
  experiment=NAME    %s
  trials=50          trials a cell
  seed=0             root of all randomness
  n_jobs=-1          processes, -1 for one a core; the results do not depend on it
  sigma_t=[0.05]     any other key of configs/config.yaml and configs/experiment/NAME.yaml

writes results/trials/NAME.csv, one row a trial, and NAME.json, what it rests on
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one experiment, or the sweeps that are given, and return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.run",
        description="Run one experiment of the simulation study.",
        epilog=HELP % " | ".join(experiment_names()),
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("overrides", nargs="*", default=[], metavar="key=value")
    parser.add_argument("--table", type=Path, metavar="FILE.csv", help="where to write instead")
    parser.add_argument(
        "--sweeps",
        metavar="JSON",
        help="resolved settings to run instead; overrides may then set only how: "
        + ", ".join(EXECUTION),
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    from .sweep import run_sweeps

    sweeps, execution = resolved(options)
    if options.sweeps is not None and options.table is None:
        raise ConfigError("--sweeps needs --table: where to write")
    path = options.table or Path(execution.results_dir) / "trials" / f"{sweeps[0].name}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)  # rather fail before the trials than after
    write_trials(path, run_sweeps(sweeps, execution), sweeps)
    return [path]


def resolved(options: Namespace) -> tuple[tuple[Sweep, ...], Execution]:
    """Return what to run, and how: beside ``--sweeps`` overrides may only set the latter."""
    if options.sweeps is None:
        sweep, execution = load(options.overrides)
        return (sweep,), execution
    for override in options.overrides:
        if split_override(override)[0] not in EXECUTION:
            raise ConfigError(f"{override} cannot be set beside --sweeps, which has it")
    try:
        return SWEEPS.validate_json(options.sweeps), load_execution(options.overrides)
    except ValidationError as error:
        raise ConfigError(f"--sweeps: {' '.join(problems(error)[0]).strip()}") from None


if __name__ == "__main__":
    sys.exit(main())
