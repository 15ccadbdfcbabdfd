"""Run one experiment: ``python -m experiments.run experiment=outliers [key=value ...]``.

It writes ``outputs/<date>/<time>/outliers.csv``, a row a trial, and the record of what it rests on;
``output=FILE`` names another file. No file is ever replaced. Settings are Hydra's overrides:
``--help`` lists them, ``--cfg job`` prints them as composed, and ``--multirun`` runs each
combination of ``key=value1,value2``, a folder each in ``multirun/<date>/<time>/``.
"""

import os
import sys
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from alignscores.streams import discard_output

from .command import INTERRUPTED, CommandError, ConfigError, run_in_one_line
from .config import CONFIG_DIR, as_dict, checked, hydra_errors, register_defaults

__all__ = ["main"]

register_defaults()


@hydra.main(config_path=str(CONFIG_DIR), config_name="config", version_base="1.3")
def main(config: DictConfig) -> None:
    """Run the experiment that Hydra has composed."""
    if code := run_in_one_line("experiments.run", lambda: [_run(config)]):
        sys.exit(code)


def _run(config: DictConfig) -> Path:
    from .sweep import run_sweeps
    from .tables import refuse_to_replace, write_trials

    sweep, execution = checked(as_dict(config))
    job = HydraConfig.get()
    if execution.output is None:
        path = Path(os.path.relpath(job.runtime.output_dir)) / f"{sweep.name}.csv"
    elif job.mode == RunMode.RUN:
        path = Path(execution.output)
    else:
        raise ConfigError("setting 'output': names one file, and --multirun writes several")
    refuse_to_replace(path)  # rather before the trials than after
    write_trials(path, run_sweeps([sweep], execution.n_jobs), [sweep])
    return path


if __name__ == "__main__":
    os.environ["HYDRA_FULL_ERROR"] = "1"  # raise errors, so that one line of them is printed
    try:
        with hydra_errors(" ".join(sys.argv[1:])):
            main()
    except CommandError as error:
        sys.exit(f"experiments.run: {error}")
    except BrokenPipeError:  # of Hydra's --help, by a reader such as `| head`
        discard_output()
        sys.exit(1)
    except OSError as error:
        sys.exit(f"experiments.run: cannot write {error.filename}: {error.strerror}")
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
