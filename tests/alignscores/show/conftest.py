"""The browser of the pages."""

from ..pages.conftest import browse, chromium

__all__ = ["browse", "chromium"]
