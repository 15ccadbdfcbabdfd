"""Statistics of claims: where their intervals lie, and how they are written."""

from dataclasses import FrozenInstanceError, replace
from math import isinf

import pytest

from report.estimates import Estimate
from studies.claims.claims import load_claims


@pytest.mark.parametrize(
    ("name", "low", "high", "outside"),
    [
        ("outliers-range-maa", -77.0, -74.4, False),  # the paper's -74 is anything to -74.5
        ("outliers-range-maa", -77.0, -74.6, True),
        ("outliers-range-maa", -73.6, -71.0, False),
        ("outliers-range-maa", -73.4, -71.0, True),
        ("outliers-range-maa", -73.5, -71.0, False),
        ("outliers-tas-discerns", 0.2, 0.5, False),
        ("outliers-tas-discerns", 0.2, 0.49, True),
        ("outliers-ate-blind", 0.4, 0.9, False),
        ("outliers-ate-blind", 0.5, 0.9, False),
        ("outliers-ate-blind", 0.51, 0.9, True),
    ],
)
def test_an_interval_beside_where_the_claim_holds(name, low, high, outside):
    mean = (low + high) / 2
    claim = load_claims().claims[name]
    estimate = Estimate(claim, mean, low, high, "inconclusive", low, high, "open")
    assert estimate.is_outside == outside
    plot = estimate.plot
    assert plot is not None
    first, last = plot["holds"]
    assert (plot["high"] < first or plot["low"] > last) == outside
    assert first < last
    assert (first == 0, last == 100) == tuple(isinf(bound) for bound in claim.interval)
    assert 0 < plot["low"] < plot["mean"] < plot["high"] < 100


def test_an_interval_that_holds_all_has_a_margin_on_either_side():
    claim = load_claims().claims["outliers-range-maa"]
    plot = Estimate(claim, -74.0, -77.0, -71.0, "inconclusive", -75, -73, "open").plot
    assert plot is not None
    assert (plot["mean"], plot["low"] + plot["high"]) == (50.0, 100.0)


def test_claims_of_tau_are_drawn_from_0_to_1():
    claim = load_claims().claims["outliers-tas-discerns"]
    plot = Estimate(claim, 0.5, 0.0, 1.0, "inconclusive", 0, 1, "open").plot
    assert plot is not None
    assert (plot["mean"], plot["low"] + plot["high"]) == (50.0, 100.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("outliers-tas-steadier", "+0.5\u202fpoints"),
        ("outliers-range-maa", "+0.5\u202f%"),  # a change, too
        ("outliers-dte-degrades-slower", "+0.500\u202fτ"),
        ("length-tas-much-below-dte", "0.5\u202f%"),
        ("outliers-ate-discerns", "0.500\u202fτ"),
    ],
)
def test_the_unit_is_that_of_the_statistic(name, value):
    claim = load_claims().claims[name]
    assert Estimate(claim, 0.5, 0.4, 0.6, "inconclusive", 0.4, 0.6, "open").value == value


@pytest.mark.parametrize(
    ("name", "expected", "key"),
    [
        ("outliers-range-maa", "−74\u202f%", "0 -74"),
        ("outliers-tas-discerns", "at least 0.5\u202fτ", "3 0.5"),
    ],
)
def test_a_number_of_the_paper_is_sorted_before_the_criteria(name, expected, key):
    estimate = Estimate(load_claims().claims[name], 0, 0, 0, "inconclusive", 0, 0, "open")
    assert (estimate.expected, estimate.expected_key) == (expected, key)


def test_a_percentage_of_another_metric_is_no_change():
    claim = load_claims().claims["length-tas-much-below-dte"]
    estimate = Estimate(claim, 50.2, 45, 55.5, "inconclusive", 49, 51.2, "open")
    assert (estimate.interval, estimate.mean_interval) == ("[45.0, 55.5]", "[49.0, 51.2]")


def estimate(name, low, mean, high, verdict="inconclusive"):
    return Estimate(load_claims().claims[name], mean, low, high, verdict, low, high, "open")


def test_the_plot_of_a_number_and_of_a_criterion():
    """The paper's -74 holds to half a point; correlations have one scale, from 0 to 1."""
    assert estimate("outliers-range-maa", -77.0, -74.0, -71.0).plot == {
        **{"low": 6.9, "mean": 50.0, "high": 93.1},
        **{"holds": (42.8, 57.2), "marks": [50.0]},
    }
    assert estimate("outliers-tas-discerns", 0.2, 0.345, 0.49).plot == {
        **{"low": 24.1, "mean": 36.6, "high": 49.1},
        **{"holds": (50.0, 100.0), "marks": [50.0]},
    }


@pytest.mark.parametrize(
    ("name", "expected", "key", "expected_key"),
    [
        ("outliers-range-maa", "−74\u202f%", "0 0.25", "0 -74"),
        ("outliers-tas-steadier", "below 0\u202fpoints", "1 0.25", "2 0"),
        ("length-tas-much-below-dte", "below 50\u202f%", "0 0.25", "1 50"),
        ("outliers-dte-degrades-slower", "at least 0.05\u202fτ", "2 0.25", "3 0.05"),
    ],
)
def test_what_is_expected_and_the_order_of_rows(name, expected, key, expected_key):
    """Numbers of the paper come before criteria, those before each other by their units."""
    found = estimate(name, 0.2, 0.25, 0.3)
    assert (found.expected, found.key, found.expected_key) == (expected, key, expected_key)


@pytest.mark.parametrize("undefined", range(3))
def test_what_is_undefined_in_a_replicate_has_no_number(undefined):
    values = [0.2, 0.25, 0.3]
    values[undefined] = float("nan")
    found = estimate("outliers-range-maa", *values)
    assert found.value == found.number == "undefined"
    assert found.interval == found.mean_interval == found.key == ""
    assert found.plot is None
    assert not found.is_outside


@pytest.mark.parametrize(("paper", "expected"), [(12.0, "+12"), (-12.0, "−12"), (0.0, "0")])
def test_a_number_of_the_paper_has_its_sign(paper, expected):
    claim = replace(load_claims().claims["outliers-range-maa"], paper=paper)
    found = Estimate(claim, 0, 0, 0, "inconclusive", 0, 0, "open").expected
    assert found == f"{expected}\u202f%"


@pytest.mark.parametrize(
    ("verdict", "holds"),
    [("reproduced", True), ("inconclusive", False), ("not reproduced", False)],
)
def test_a_claim_holds_where_it_is_reproduced(verdict, holds):
    assert estimate("outliers-range-maa", 0.2, 0.25, 0.3, verdict).holds == holds


def test_estimates_do_not_change():
    found = estimate("outliers-range-maa", 0.2, 0.25, 0.3)
    with pytest.raises(FrozenInstanceError):
        found.mean = 0.5
