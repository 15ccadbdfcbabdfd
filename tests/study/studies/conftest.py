"""The claims, and trials that are made up written to files."""

import inspect
import re

import pytest

from studies.statements import load_claims

CLAIMS = load_claims(3)  # of the paper, decided by three studies; read once, which takes long


def undescribed(function, table):
    """Return the columns that a docstring does not name: the documentation shows it."""
    described = set(re.findall(r"\w+", inspect.getdoc(function) or ""))
    names = [re.sub("_(error|p)$", "", str(column)) for column in table.columns]
    return [name for name in names if name not in described]


@pytest.fixture
def written(tmp_path):
    """Write trials under names, and return the paths."""
    from experiments.tables import write_trials

    def write(trials):
        for name, made in trials.items():
            path = tmp_path / f"{name}.csv"
            for written in (path, path.with_suffix(".json")):
                written.unlink(missing_ok=True)
            write_trials(path, made.table, made.record.sweeps)
        return [str(tmp_path / f"{name}.csv") for name in trials]

    return write
