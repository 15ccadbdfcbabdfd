"""Common to the studies' plans: the paper's experiments, and errors that name a setting."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from experiments.command import ConfigError
from experiments.config import EXPERIMENTS, Sweep, load_sweep


def paper_experiments(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of each experiment of the paper."""
    return {name: {"experiment": name, **settings} for name in EXPERIMENTS}


def load_experiment(overrides: Sequence[str]) -> Sweep:
    """Compose an experiment of the paper; a `ConfigError` names it with all settings."""
    with naming(after=f" ({' '.join(overrides)})"):
        return load_sweep(overrides)


@contextmanager
def naming(before: str = "", after: str = "") -> Iterator[None]:
    """Raise what is wrong with a setting or a file as a `ConfigError` that names it."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise ConfigError(f"{before}{error}{after}") from None


def reject(settings: Collection[str], fixed: Sequence[str], reason: str) -> None:
    """Raise a `ConfigError` for settings that a study decides on its own."""
    for key in fixed:
        if key in settings:
            raise ConfigError(f"setting {key!r} cannot be set: {reason}")
