"""The studies: a folder for each, with its description in ``__init__.py``."""
