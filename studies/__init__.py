"""What is asked of trials: a folder for each study, with its description in ``__init__.py``."""
