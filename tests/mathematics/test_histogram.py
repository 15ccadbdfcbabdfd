"""The cumulative frequency and the score that is its area, against double loops."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alignscores.histogram import cumulative_frequency, equal_steps, score_of

# A coarse grid, so that errors often lie exactly at a threshold.
ERRORS = st.lists(
    st.one_of(st.integers(0, 12).map(lambda k: k / 8), st.just(math.inf)), min_size=1, max_size=30
)


@given(errors=ERRORS, count=st.sampled_from([1, 4, 8, 100]))
def test_score_is_the_mean_over_cameras(errors, count):
    """The area is the mean over the cameras of the share of thresholds above their error."""
    thresholds = equal_steps(1.0, count, "largest")
    score = score_of(np.array(errors), thresholds)
    shares = [sum(error < threshold for threshold in thresholds) / count for error in errors]
    assert score == pytest.approx(sum(shares) / len(shares), abs=1e-12)
    assert 0 <= score <= 1
    assert type(score) is float


def test_an_error_at_a_threshold_is_not_below_it():
    """The comparison is strict: errors at all 100 thresholds leave 99 + 98 + ... + 0 counts."""
    thresholds = equal_steps(2.0, 100, "largest")
    assert cumulative_frequency(thresholds.copy(), thresholds).tolist() == list(range(100))
    assert score_of(thresholds.copy(), thresholds) == 0.495
