"""The cumulative frequency and the score that is its area, against double loops."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alignscores import AlignmentScore
from alignscores.histogram import equal_steps

# A coarse grid, so that errors often lie exactly at a threshold.
ERRORS = st.lists(
    st.one_of(st.integers(0, 12).map(lambda k: k / 8), st.just(math.inf)), min_size=1, max_size=30
)


@given(errors=ERRORS, count=st.sampled_from([1, 4, 8, 100]))
def test_score_is_the_mean_over_cameras(errors, count):
    """The area is the mean over the cameras of the share of thresholds above their error."""
    thresholds = equal_steps(1.0, count, "largest")
    result = AlignmentScore(np.array(errors), thresholds)
    shares = [sum(error < threshold for threshold in thresholds) / count for error in errors]
    assert result.score == pytest.approx(sum(shares) / len(shares), abs=1e-12)
    assert 0 <= result.score <= 1
    assert float(result) == result.score
    assert type(result.score) is float


def test_an_error_at_a_threshold_is_not_below_it():
    """The comparison is strict: errors at all 100 thresholds leave 99 + 98 + ... + 0 counts."""
    thresholds = equal_steps(2.0, 100, "largest")
    result = AlignmentScore(thresholds.copy(), thresholds)
    assert result.cumulative_frequency.tolist() == list(range(100))
    assert result.score == 0.495
