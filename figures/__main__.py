"""Draw one figure from the tables of trials: ``python -m figures NAME [key=value ...]``."""

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from experiments.command import run_command
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
    parser = ArgumentParser(
        prog="python -m figures",
        description="Draw a figure of the paper from the tables of trials.",
        epilog=HELP % " | ".join([*FIGURES, *STUDIES]),
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", metavar="NAME")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    name = options.name
    if name not in (*FIGURES, *STUDIES):
        names = ", ".join([*FIGURES, *STUDIES])
        raise ConfigError(f"unknown figure {name!r}; the figures are {names}")
    module = import_module(f"figures.{name}")
    from .output import write_figure

    figure, results = (_of_study if name in STUDIES else _of_trials)(
        name, module, options.overrides
    )
    title = (module.__doc__ or name).partition("\n")[0]
    return write_figure(figure, results / "figures" / name, title)


def _of_trials(name: str, module: Any, overrides: Sequence[str]) -> tuple[Any, Path]:
    """Draw a figure of the paper; return it and the folder of the results."""
    from .tables import FigureError

    configs = {
        experiment: load([f"experiment={experiment}", *overrides])
        for experiment in FIGURES[name] or (HISTOGRAM_EXPERIMENT,)
    }
    tables = [
        read_trials(configs[experiment], command=_command(experiment, overrides))
        for experiment in FIGURES[name]
    ]
    try:
        figure = module.draw(*(tables or configs.values()))
    except FigureError as error:
        command = _command(error.experiment, overrides, error.setting)
        problem = f"{error}; set {error.setting} here, too" if error.setting else str(error)
        raise TableError(trials_path(configs[error.experiment]), problem, command) from None
    return figure, Path(next(iter(configs.values())).results_dir)


def _of_study(name: str, module: Any, overrides: Sequence[str]) -> tuple[Any, Path]:
    """Draw the figure of a parameter study, likewise."""
    import pandas as pd

    from experiments.effects import read_table

    study = load_study(name.removesuffix("_study"), overrides)
    table = pd.concat([read_table(study, kind) for kind in STUDIES[name]], ignore_index=True)
    return module.draw(table), study.results


def _command(experiment: str, overrides: Sequence[str], setting: str = "") -> list[str]:
    """Return what runs an experiment with these settings, one of them replaced by another."""
    others = [override for override in overrides if _key(override) != _key(setting)]
    settings = [setting] if setting else []
    return ["experiments.run", f"experiment={experiment}", *others, *settings]


def _key(override: str) -> str:
    return override.partition("=")[0].strip()


if __name__ == "__main__":
    sys.exit(main())
