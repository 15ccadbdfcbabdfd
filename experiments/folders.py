"""Hydra's folders of results, ``outputs/<date>/<time>/``: each run has a new one."""

from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from omegaconf import DictConfig, read_write

from .config import to_overrides

__all__ = ["NewFolder"]


class NewFolder(Callback):
    """Number the folder of a run if it is taken: Hydra names folders by the second.

    ``configs/config.yaml`` tells Hydra to call it.
    """

    def on_run_start(self, config: DictConfig, **_: Any) -> None:
        """Create the folder of a run, and in it the one for Hydra's record."""
        if config.hydra.output_subdir is not None:  # otherwise nothing but the table is written
            self._create(config, "run", config.hydra.output_subdir)

    def on_multirun_start(self, config: DictConfig, **_: Any) -> None:
        """Create the folder of all runs."""
        self._create(config, "sweep", ".")

    def _create(self, config: DictConfig, mode: str, subfolder: str) -> None:
        first = config.hydra[mode].dir
        for number in count(1):
            folder = first if number == 1 else f"{first}-{number}"
            with suppress(FileExistsError):  # one of several runs in the same second creates it
                (Path(folder) / subfolder).mkdir(parents=True)
                break
        with read_write(config.hydra):
            config.hydra[mode].dir = folder
            # The jobs of a multirun are composed anew, with these overrides.
            config.hydra.overrides.hydra += to_overrides({f"hydra.{mode}.dir": folder})
