"""The version of the package, in a module that imports nothing."""

__all__ = ["__version__"]

__version__ = "2.0.0.dev0"
