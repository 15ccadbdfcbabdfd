"""Results are as frozen in ``tests/command/golden/*.json``; `make` says what they are."""

import json
from math import nan

import pytest

from tests.files import REAL

from .make import FOLDER, RESULTS


def numbers(results):
    """Return each number by its key and its place in a list; NaN is an undefined one."""
    return {
        f"{key}[{index}]": nan if number is None else number
        for key, value in results.items()
        for index, number in enumerate(value if isinstance(value, list) else [value])
    }


def like(results):
    """Return what equals the same numbers up to 1e-9, which is left to processors and compilers."""
    return pytest.approx(numbers(results), rel=1e-9, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize("name", RESULTS)
def test_results_are_as_frozen(name, tmp_path):
    if name == "real_runs" and not REAL.is_dir():
        pytest.skip(f"no real trajectories at {REAL}")
    frozen = json.loads((FOLDER / f"{name}.json").read_text())
    assert numbers(RESULTS[name](tmp_path)) == like(frozen)


@pytest.mark.parametrize(
    "change", [{"a": 0.500001}, {"b": [2.0, 400.000001, None]}, {"b": [2.0, 400.0, 0.0]}, {"c": 8}]
)
def test_a_small_change_of_any_number_is_seen(change):
    frozen = {"a": 0.5, "b": [2.0, 400.0, None], "c": 7}
    assert numbers(frozen) == like(frozen)
    assert numbers(frozen | change) != like(frozen)
    assert numbers({"a": 0.5}) != like(frozen)
