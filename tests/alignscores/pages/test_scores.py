"""What the pages compute in a browser is what Python computes, on random errors."""

import json
from math import inf

import numpy as np

from alignscores import AlignmentScore
from alignscores.histogram import equal_steps
from alignscores.pages.document import document

CALLS = """
const number = (value) => (Number.isFinite(value) ? value : String(value));
const read = (values) => values.map((value) => (value === null ? Infinity : value));
const cases = JSON.parse(document.getElementById("data").textContent);
tell(cases.map(({ call, errors, options, ...rest }) => {
  const S = AlignmentScores;
  const own = { ...options };
  switch (call) {
    case "score": return number(S.score(Float64Array.from(read(errors)), rest.unit, own));
  }
}));
"""


def ask(browser, cases):
    """Return what the scripts answer; infinities travel as null, and come back as text."""
    cases = json.loads(json.dumps(cases).replace("Infinity", "null").replace("NaN", "null"))
    page = document("arithmetic", "", styles=(), scripts=["scores.js"], data=cases)
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
