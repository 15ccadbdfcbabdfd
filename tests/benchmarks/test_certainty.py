"""What `compare` says of runs whose truth is known holds as often as it says."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.certainty import CASES, EQUAL, ERROR, FAILS, ONE, Case, leave_out, lines, simulate


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
        *([ONE] if case.sequences > 1 and case.runs > 1 else []),
    }
    for one in found.values():
        assert one.held / one.answered >= 0.92
        assert one.held_with_failures / one.answered >= 0.92
        assert max(one.wrong, one.wrong_by_mean) / one.answered <= 0.08


@pytest.mark.parametrize("sequences", [1, 5])
@pytest.mark.parametrize("runs", [3, 10])
def test_a_system_that_is_better_but_fails_is_seldom_ahead(sequences: int, runs: int) -> None:
    """Its runs score more by less than it loses in the tenth of them that fail."""
    case = Case(FAILS, scales=(0.9, 1), failing=(0.1, 0), sequences=sequences, runs=runs)
    for found in simulate(case, 300).values():
        if n := found.answered:
            assert found.held / n >= 0.92
            assert found.held_with_failures / n >= 0.92
            assert found.wrong / n <= 0.08
            assert found.wrong_by_mean / n <= 0.08


def test_what_differs_is_found() -> None:
    """A third less error with ten runs, and failures in 30 % with twenty."""
    better = simulate(Case("better", scales=(2 / 3, 1), runs=10), 200)["new_runs"]
    assert better.right / better.answered > 0.9
    steady = simulate(Case("fails", failing=(0.3, 0), runs=20), 200)["new_runs"]
    assert min(steady.right, steady.right_by_mean) / steady.answered > 0.8


@pytest.mark.parametrize("failing", [(0.0,), (0.3,), (0, 0.1)])
def test_errors_have_an_order_where_neither_they_nor_failures_contradict(failing: Any) -> None:
    case = Case("errors", scales=(1, 1.5), failing=failing, metric=ERROR, runs=5)
    found = simulate(case, 300)["new_runs"]
    assert found.held / found.answered >= 0.92
    assert found.wrong / found.answered <= 0.08
    assert found.right / found.answered > 0.5
    same = simulate(replace(case, scales=(1,), failing=(0.3,)), 300)["new_runs"]
    assert same.wrong / same.answered <= 0.08


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
