"""The version of the package; a module of its own, as its other modules tell it."""

__all__ = ["__version__"]

__version__ = "2.0.0.dev0"
