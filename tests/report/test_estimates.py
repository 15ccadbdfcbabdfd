"""Statistics of claims: where their intervals lie, and how they are written."""

from math import isinf, nan

import pytest

from report.estimates import Estimate
from studies.claims.claims import load_claims

CLAIMS = load_claims().claims


def estimate(name, low, mean, high):
    return Estimate(CLAIMS[name], mean, low, high, "inconclusive", low, high, "open")


@pytest.mark.parametrize(
    ("name", "low", "high", "outside"),
    [
        ("outliers-range-maa", -77.0, -74.4, False),  # the paper's -74 is anything to -74.5
        ("outliers-range-maa", -77.0, -74.6, True),
        ("outliers-range-maa", -73.4, -71.0, True),
        ("outliers-tas-discerns", 0.2, 0.5, False),
        ("outliers-tas-discerns", 0.2, 0.49, True),
        ("outliers-ate-blind", 0.51, 0.9, True),
    ],
)
def test_an_interval_and_where_the_claim_holds(name, low, high, outside):
    plot = estimate(name, low, (low + high) / 2, high).plot
    first, last = plot["holds"]
    assert (plot["high"] < first or plot["low"] > last) == outside
    assert (first == 0, last == 100) == tuple(map(isinf, CLAIMS[name].interval))
    assert 0 < plot["low"] < plot["mean"] < plot["high"] < 100


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("outliers-range-maa", "+0.2\u202f%", "−74\u202f%"),  # a change
        ("outliers-tas-steadier", "+0.2\u202fpoints", "below 0\u202fpoints"),
        ("length-tas-much-below-dte", "0.2\u202f%", "below 50\u202f%"),
        ("outliers-dte-degrades-slower", "+0.250\u202fτ", "at least 0.05\u202fτ"),
        ("outliers-ate-discerns", "0.250\u202fτ", "at least 0.5\u202fτ"),
    ],
)
def test_numbers_have_the_sign_and_the_unit_of_the_statistic(name, value, expected):
    found = estimate(name, 0.2, 0.25, 0.3)
    assert (found.value, found.expected) == (value, expected)


@pytest.mark.parametrize("values", [(nan, 0.25, 0.3), (0.2, nan, 0.3), (0.2, 0.25, nan)])
def test_what_is_undefined_in_a_replicate_has_no_number(values):
    found = estimate("outliers-range-maa", *values)
    assert found.value == "undefined"
    assert found.interval == found.key == ""
    assert found.plot is None
