"""How far long computations are, for whoever shows it."""

from collections.abc import Callable
from contextvars import ContextVar

__all__ = ["show"]


show: ContextVar[Callable[[str], None]] = ContextVar("show", default=lambda text: None)
