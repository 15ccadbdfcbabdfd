"""How far long computations are, for whoever shows it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["show", "shown_by"]


show: ContextVar[Callable[[str], None]] = ContextVar("show", default=lambda text: None)


@contextmanager
def shown_by(function: Callable[[str], None]) -> Iterator[None]:
    """Have a function show progress."""
    token = show.set(function)
    try:
        yield
    finally:
        show.reset(token)
