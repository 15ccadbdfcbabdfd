"""The calibration's shortcuts: many draws at once have the p-values that `compare` gives each."""

import numpy as np
import pandas as pd
import pytest

from alignscores import compare
from alignscores.comparison.baseline import changes
from alignscores.comparison.statistics import permutation_test
from studies.calibration import Case, tails


@pytest.mark.parametrize(
    ("case", "rounding"),
    [
        (Case(2, (3, 3)), 1e-12),
        (Case(1, (5, 5), n_best_runs=1, copies=5), 1e-12),
        (Case(2, (5, 7), scale=3.0), 0.02),  # other random permutations
    ],
)
def test_many_draws_are_tested_as_each_of_them_is(case, rounding):
    runs = case.draw(np.random.default_rng(0), 6)
    better, worse = tails(runs)
    for draw in range(6):
        test = permutation_test([(a[draw], b[draw]) for a, b in runs])
        assert (better[draw], worse[draw]) == pytest.approx((test.better, test.worse), abs=rounding)


def test_the_gate_has_the_p_value_of_the_system_that_is_worst():
    """By Holm's method the least of two p-values is doubled."""
    rng = np.random.default_rng(0)
    saved, now = (rng.normal(size=(2, 2, 5)) - shift for shift in (0, 1))
    index = pd.MultiIndex.from_product(
        [["a", "b"], ["s", "t"], list("01234")], names=["system", "sequence", "run"]
    )
    tables = [pd.Series(runs.ravel(), index, name="PAS").reset_index() for runs in (saved, now)]
    before, after = (compare(table) for table in tables)
    systems = zip(now, saved, strict=True)
    p = [tails([(a[None], b[None]) for a, b in zip(*system, strict=True)])[1] for system in systems]
    changed = changes(after, "saved.csv", before.runs)
    assert changed.systems["p_worse"].min() == pytest.approx(2 * np.min(p), abs=0.01)
