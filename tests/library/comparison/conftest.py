"""The command ``alignscores compare``."""

import pytest


@pytest.fixture
def run(run_compare):
    """(arguments) -> exit code, stdout, stderr."""
    return run_compare
