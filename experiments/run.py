"""Run one experiment: ``python -m experiments.run experiment=outliers [key=value ...]``."""

import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence
from pathlib import Path

from .command import run_command
from .config import Config, experiment_names, load

__all__ = ["main", "run"]

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
    """Run one experiment and write its table of trials; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.run",
        description="Run one experiment of the simulation study.",
        epilog=HELP % " | ".join(experiment_names()),
        formatter_class=RawDescriptionHelpFormatter,
    )
    return run_command(parser, lambda options: [run(load(options.overrides))], arguments)


def run(config: Config, path: Path | None = None) -> Path:
    """Run an experiment and write its table of trials; return where, see `trials_path`."""
    from .sweep import sweep
    from .tables import trials_path, write_trials

    path = path or trials_path(config)
    path.parent.mkdir(parents=True, exist_ok=True)  # rather fail before the trials than after
    return write_trials(config, sweep(config), path)


if __name__ == "__main__":
    sys.exit(main())
