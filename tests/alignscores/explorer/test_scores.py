"""What the pages compute in a browser is what Python computes, on random errors."""

import json
from fractions import Fraction
from itertools import pairwise, product
from math import ceil, inf, isnan

import numpy as np
import pytest

from alignscores import AlignmentScore, ScoreProfile
from alignscores.explorer import source
from alignscores.explorer.document import document
from alignscores.histogram import equal_steps

CALLS = """
const number = (value) => (Number.isFinite(value) ? value : String(value));
const read = (values) => values.map((value) => (value === null ? Infinity : value));
const cases = JSON.parse(document.getElementById("data").textContent);
tell(cases.map(({ call, errors, levels, options, ...rest }) => {
  const S = AlignmentScores;
  const own = { ...options };
  if (own.thresholds === null) own.thresholds = Infinity;
  switch (call) {
    case "score": return number(S.score(Float64Array.from(read(errors)), rest.unit, own));
    case "profile": return S.profile(read(errors), rest.units, own);
    case "half": return number(S.half(read(errors), own));
    case "quantile": return S.quantile(errors, rest.q);
    case "pas": return S.pas(rest.tas, rest.ras, rest.weight);
    case "order": return S.order(levels.map((level) => level.map((v) => (v === null ? NaN : v))));
  }
}));
"""


def ask(browser, cases):
    """Return what the scripts answer; infinities travel as null, and come back as text."""
    cases = json.loads(json.dumps(cases).replace("Infinity", "null").replace("NaN", "null"))
    page = document("arithmetic", "", styles=(), scripts=[source("scores.js")], data=cases)
    answers = browser.run(page, CALLS)
    return [float(answer) if isinstance(answer, str) else answer for answer in answers]


def random_errors(rng, thresholds):
    """Errors on both sides of the thresholds and exactly on them, zeros and failures."""
    n = int(rng.integers(1, 120))
    errors = thresholds[-1] * rng.lognormal(-1, 1.5, size=n)
    kinds = rng.integers(8, size=n)
    errors = np.where(kinds < 2, rng.choice(thresholds, size=n), errors)
    errors[kinds == 2] = 0.0
    errors[kinds == 3] = inf
    return errors


def test_scores_are_those_of_python_to_the_last_bit(browser):
    rng = np.random.default_rng(0)
    cases, expected = [], []
    for _ in range(600):
        unit, largest = rng.lognormal(0, 4), float(rng.choice([1.0, 10.0, rng.lognormal()]))
        count = int(rng.choice([1, 3, 7, 10, 100, 999]))
        thresholds = unit * equal_steps(largest, count, "_")
        errors = random_errors(rng, thresholds)
        options = {"thresholds": count, "maxThreshold": largest}
        cases.append({"call": "score", "errors": list(errors), "unit": unit, "options": options})
        expected.append(AlignmentScore(errors, thresholds).score)
    assert len({round(value, 3) for value in expected}) > 200
    assert ask(browser, cases) == expected


def test_errors_beside_a_threshold_by_a_bit_are_counted_as_in_python(browser):
    cases, expected = [], []
    for unit in (1.0, 0.3, 1e-300, 5e-324, 1e300):
        for count in (3, 100):
            thresholds = unit * equal_steps(1.0, count, "_")
            beside = [np.nextafter(thresholds, way) for way in (0, inf)]
            errors = np.concatenate([thresholds, *beside])
            options = {"thresholds": count}
            case = {"call": "score", "errors": list(errors), "unit": unit, "options": options}
            cases.append(case)
            expected.append(AlignmentScore(errors, thresholds).score)
    assert ask(browser, cases) == expected


def test_with_infinitely_many_thresholds_the_score_is_the_area_under_a_line(browser):
    rng = np.random.default_rng(1)
    cases, expected = [], []
    for _ in range(50):
        unit = rng.lognormal(0, 2)
        errors = random_errors(rng, unit * equal_steps(2.0, 100, "_"))
        options = {"thresholds": inf, "maxThreshold": 2.0}
        cases.append({"call": "score", "errors": list(errors), "unit": unit, "options": options})
        expected.append(np.clip(1 - errors / (2 * unit), 0, None).mean())
    np.testing.assert_allclose(ask(browser, cases), expected, rtol=1e-12, atol=0)


def test_cameras_without_an_error_count_in_the_total_and_none_has_no_score(browser):
    errors = [0.1, 0.2, 0.9]
    cases = [
        {"call": "score", "errors": errors, "unit": 1.0, "options": {"total": 5}},
        {"call": "score", "errors": [*errors, inf, inf], "unit": 1.0, "options": {}},
        {"call": "score", "errors": [], "unit": 1.0, "options": {}},
    ]
    less, same, nothing = ask(browser, cases)
    assert (
        less
        == same
        == AlignmentScore(np.array([*errors, inf, inf]), equal_steps(1, 100, "_")).score
    )
    assert isnan(nothing)


def test_profiles_and_where_they_cross_are_those_of_python(browser):
    rng = np.random.default_rng(2)
    cases, expected = [], []
    units = np.geomspace(1e-3, 1e3, 40)
    for _ in range(60):
        count = int(rng.choice([1, 10, 100]))
        errors = random_errors(rng, rng.lognormal(0, 2) * equal_steps(1.0, count, "_"))
        profile = ScoreProfile(units, np.sort(errors)[None], count)
        options = {"thresholds": count}
        cases.append(
            {"call": "profile", "errors": list(errors), "units": list(units), "options": options}
        )
        expected.append(list(profile.scores))
        for score in (0.25, 0.5, 1.0):
            own = options | {"reach": score}
            cases.append({"call": "half", "errors": list(errors), "options": own})
            expected.append(profile.unit_at(score))
    assert inf in expected
    assert ask(browser, cases) == expected


def test_a_perfect_estimate_is_half_right_at_no_distance(browser):
    assert ask(browser, [{"call": "half", "errors": [0.0, 0.0, 1.0], "options": {}}]) == [0.0]


def test_quantiles_are_order_statistics(browser):
    rng = np.random.default_rng(3)
    cases, expected = [], []
    for n in (1, 4, 7, 10, 20, 100):
        values = np.sort(rng.random(n))
        for q in (0.05, 0.07, 0.3, 0.55, 0.75, 1.0):
            cases.append({"call": "quantile", "errors": list(values), "q": q})
            expected.append(values[ceil(Fraction(str(q)) * n) - 1])
    assert ask(browser, cases) == expected


def test_the_pas_weighs_as_python_does(browser):
    cases, expected = [], []
    for weight in (0.0, 0.05, 0.3, 0.5, 1.0):
        cases.append({"call": "pas", "tas": 0.123, "ras": 0.987, "weight": weight})
        expected.append(weight * 0.123 + (1 - weight) * 0.987)
    assert ask(browser, cases) == expected


def test_the_order_of_levels_is_the_share_of_right_pairs_of_neighbours(browser):
    """Of two trials that tie, or of which one has no value, either may be the first."""
    rng = np.random.default_rng(4)
    cases, expected = [], []
    for _ in range(40):
        levels = [
            rng.integers(6, size=rng.integers(1, 12)).astype(float)  # with ties
            for _ in range(rng.integers(2, 8))
        ]
        levels[0][0] = np.nan
        cases.append({"call": "order", "levels": [list(level) for level in levels]})
        shares = [
            np.mean([0.5 + 0.5 * (a < b) - 0.5 * (a > b) for a, b in product(*neighbours)])
            for neighbours in pairwise(levels)
        ]
        expected.append(np.mean(shares))
    np.testing.assert_allclose(ask(browser, cases), expected, rtol=1e-12)


@pytest.mark.parametrize(
    "name", ["scores.js", "charts.js", "controls.js", "tables.js", "style.css"]
)
def test_the_files_need_no_network(name):
    text = source(name)
    addresses = [word for word in text.split('"') if "://" in word]
    assert set(addresses) <= {"http://www.w3.org/2000/svg"}  # a name, which nothing fetches
    assert "@import" not in text
    assert "fetch(" not in text
