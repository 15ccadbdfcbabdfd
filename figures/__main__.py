"""Draw one figure from the tables of trials: ``python -m figures NAME [key=value ...]``."""

import argparse
import shlex
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from experiments.config import ConfigError, load
from experiments.study import load_study
from experiments.tables import TableError, read_trials, trials_path

from . import FIGURES, HISTOGRAM_EXPERIMENT, STUDIES

__all__ = ["main"]

HELP = """\
figures: %s

settings are Hydra overrides, the ones that the experiments were run with:
  results_dir=results   where the tables of trials are, and where the figure goes

reads results/trials/EXPERIMENT.csv, or results/tables/NAME*.csv for a study,
writes results/figures/NAME.pdf and NAME.png
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw one figure; return the exit code: 1 for the files' fault, 2 for the command line's."""
    parser = argparse.ArgumentParser(
        prog="python -m figures",
        description="Draw a figure of the paper from the tables of trials.",
        epilog=HELP % " | ".join([*FIGURES, *STUDIES]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("overrides", nargs="*", metavar="key=value")
    options = parser.parse_args(arguments)
    name, overrides = options.name, options.overrides
    if name not in (*FIGURES, *STUDIES):
        names = ", ".join([*FIGURES, *STUDIES])
        return _fail(2, f"unknown figure {name!r}; the figures are {names}")

    module = import_module(f"figures.{name}")
    from .output import write_figure

    try:
        figure, results = (_of_study if name in STUDIES else _of_trials)(name, module, overrides)
    except ConfigError as error:
        return _fail(2, str(error))
    except TableError as error:
        return _fail(1, str(error))
    path = results / "figures" / name
    try:
        files = write_figure(figure, path, (module.__doc__ or name).partition("\n")[0])
    except OSError as error:
        return _fail(1, f"cannot write {path}: {error.strerror}")
    print(*files, sep="\n")
    return 0


def _of_trials(name: str, module: Any, overrides: Sequence[str]) -> tuple[Any, Path]:
    """Draw a figure of the paper; return it and the folder of the results."""
    configs = [
        load([f"experiment={experiment}", *overrides])
        for experiment in FIGURES[name] or (HISTOGRAM_EXPERIMENT,)
    ]
    try:
        tables = [read_trials(config) for config in configs if FIGURES[name]]
        return module.draw(*(tables or configs)), Path(configs[0].results_dir)
    except TableError as error:
        path = next(trials_path(config) for config in configs if config.name == error.experiment)
        problem = f"{path} {error}; run: {_run_command(error, overrides)}"
        raise TableError(error.experiment, problem) from None


def _of_study(name: str, module: Any, overrides: Sequence[str]) -> tuple[Any, Path]:
    """Draw the figure of a parameter study, likewise."""
    import pandas as pd

    from experiments.effects import read_table

    study = load_study(name.removesuffix("_study"), overrides)
    table = pd.concat([read_table(study, kind) for kind in STUDIES[name]], ignore_index=True)
    return module.draw(table), study.results


def _run_command(error: TableError, overrides: Sequence[str]) -> str:
    """Return the command that makes a table without this error."""
    others = [override for override in overrides if _key(override) != _key(error.setting)]
    setting = [error.setting] if error.setting else []
    experiment = f"experiment={error.experiment}"
    return shlex.join(["python", "-m", "experiments.run", experiment, *others, *setting])


def _key(override: str) -> str:
    return override.partition("=")[0].strip()


def _fail(code: int, message: str) -> int:
    print(f"figures: {message}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
