"""The command ``alignscores``: score trajectory files, ``alignscores FORMAT REF EST [EST ...]``."""

from .main import main

__all__ = ["main"]
