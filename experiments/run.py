"""Run one experiment: ``python -m experiments.run experiment=outliers [key=value ...]``."""

import argparse
import sys
from collections.abc import Sequence

from .config import Config, ConfigError, experiment_names, load

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
    parser = argparse.ArgumentParser(
        prog="python -m experiments.run",
        description="Run one experiment of the simulation study.",
        epilog=HELP % " | ".join(experiment_names()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("overrides", nargs="*", metavar="key=value")
    try:
        config = load(parser.parse_args(arguments).overrides)
    except ConfigError as error:
        print(f"experiments.run: {error}", file=sys.stderr)
        return 2
    return run(config, "experiments.run")


def run(config: Config, program: str) -> int:
    """Write the table of trials of an experiment and say where; return the exit code."""
    from .sweep import sweep
    from .tables import trials_path, write_trials

    path = trials_path(config)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)  # rather fail before the trials than after
        write_trials(config, sweep(config))
    except ConfigError as error:
        print(f"experiments.run: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"{program}: cannot write {path}: {error.strerror}", file=sys.stderr)
        return 1
    print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
