"""What `compare` says of runs whose truth is known holds as often as it says."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from benchmarks.certainty import CASES, EQUAL, FAILS, Case, leave_out, lines, simulate


@pytest.mark.parametrize(
    "case",
    [
        Case(EQUAL, systems=4),
        Case("drift", correlation=None, runs=3),
        Case("errors last long", correlation=0.2, runs=10),
        Case("drift", sequences=5, correlation=None, runs=1),
        Case("both fail", sequences=3, failing=(0.3,)),
    ],
    ids=lambda case: case.name,
)
def test_nominal_95_percent_hold_and_equal_systems_are_seldom_told_apart(case: Case) -> None:
    found = {question: one for question, one in simulate(case, 400).items() if one.answered}
    assert set(found) == {
        *(["new_runs"] if case.runs > 1 else []),
        *(["new_sequences"] if case.sequences > 1 else []),
    }
    for one in found.values():
        assert one.held / one.answered >= 0.92
        assert one.held_with_failures / one.answered >= 0.92
        assert one.ahead / one.answered <= 0.08


@pytest.mark.parametrize("runs", [3, 10])
def test_a_system_that_is_better_but_fails_is_not_ahead_by_its_means(runs: int) -> None:
    """Its runs score more by less than it loses in the tenth of them that fail."""
    case = Case(FAILS, scales=(0.95, 1), failing=(0.1, 0), correlation=None, runs=runs)
    found = simulate(case, 300)["new_runs"]
    assert found.held / 300 >= 0.92
    assert found.held_with_failures / 300 >= 0.92
    assert found.ahead_with_failures / 300 <= 0.08


def test_one_run_on_one_sequence_has_no_answer() -> None:
    found = simulate(Case("one run", runs=1), 5)
    assert not any(one.answered for one in found.values())
    assert list(lines(CASES[0], found)) == []


def test_the_interval_of_some_runs_holds_the_others() -> None:
    rng = np.random.default_rng(0)
    rows = [
        {"change": "as it is", "sequence": sequence, "system": system, "TAS": rng.normal(spread)}
        for sequence, system, spread in product("qr", "abc", [0.1] * 10)
    ]
    assert 0.92 <= leave_out(pd.DataFrame(rows), "TAS", 1000) <= 0.99
