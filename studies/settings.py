"""Common to the studies' plans: errors that name a setting."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager

from experiments.command import ConfigError
from experiments.config import Sweep, load_sweep


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
