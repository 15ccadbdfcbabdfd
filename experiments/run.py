"""Run one experiment: ``python -m experiments.run experiment=outliers [key=value ...]``.

It writes ``results/trials/outliers.csv``, a row a trial, and the record of what it rests on.
Settings are Hydra's overrides: ``--help`` lists them, ``--cfg job`` prints them as composed, and
``--multirun`` runs each combination of ``key=value1,value2``, a table each in ``results/multirun``.
"""

import signal

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    # The system ends the process, at any moment; tables are renamed into place, whole.
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import os
import sys
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from .command import ConfigError, run_in_one_line
from .config import CONFIG_DIR, checked, container, hydra_errors, register_defaults

__all__ = ["main"]

register_defaults()


@hydra.main(config_path=str(CONFIG_DIR), config_name="config", version_base="1.3")
def main(config: DictConfig) -> None:
    """Run the experiment that Hydra has composed."""
    if code := run_in_one_line("experiments.run", lambda: [_run(config)]):
        sys.exit(code)


def _run(config: DictConfig) -> Path:
    from .sweep import run_sweeps
    from .tables import write_trials

    sweep, execution = checked(container(config))
    job = HydraConfig.get()
    folder = execution.results_dir if job.mode == RunMode.RUN else job.runtime.output_dir
    path = Path(folder) / "trials" / f"{execution.table}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)  # rather fail before the trials than after
    write_trials(path, run_sweeps([sweep], execution.n_jobs), [sweep])
    return path


if __name__ == "__main__":
    os.environ["HYDRA_FULL_ERROR"] = "1"  # raise errors, so that one line of them is printed
    try:
        with hydra_errors(" ".join(sys.argv[1:])):
            main()
    except ConfigError as error:
        sys.exit(f"experiments.run: {error}")
