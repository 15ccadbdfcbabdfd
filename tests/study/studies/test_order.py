"""The ruler for order against values worked out by hand."""

import math
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from studies.order import Order, Task, estimate, neighbouring_levels, orders, trials_needed


def order(*levels):
    """Return the order of neighbouring levels of the ATE."""
    samples = [pd.DataFrame({"ATE": values}) for values in levels]
    return estimate(Task(samples, list(pairwise(range(len(levels))))).shares("ATE"))


def table_of(**columns):
    """Three levels of noise, with as many trials of each."""
    table = pd.DataFrame({name: np.asarray(values) for name, values in columns.items()})
    settings = {"n_cameras": 100, "n_outliers": 0, "sigma_r_deg": 3.0}
    return table.assign(sigma_t=np.repeat([1, 2, 3], len(table) // 3), **settings)


# Of the pairs (1, 2), (1, 3), (2, 2), (2, 3) three are right and one ties; of those of the second
# and third level, (2, 1), (2, 3), (3, 1), (3, 3), one is right and one ties.
ORDERED = [[1, 2], [2, 3], [1, 3]]


def test_order_is_the_share_of_right_pairs_of_neighbours():
    assert order(*ORDERED[:2]).probability == pytest.approx(3.5 / 4)
    assert order(*ORDERED).probability == pytest.approx((3.5 / 4 + 1.5 / 4) / 2)
    assert order(*ORDERED[::-1]).probability == pytest.approx(1 - (3.5 + 1.5) / 8)
    assert orders(table_of(TAS=-np.ravel(ORDERED)), "TAS", "sigma_t") == pytest.approx([0.625])


def test_no_rising_rescaling_changes_the_order():
    values = np.random.default_rng(0).normal([[0], [1], [2]], size=(3, 20))
    result = order(*values)
    for rescaled in (np.exp(values), values**3, -1 / np.exp(values)):
        assert order(*rescaled) == result
        table = table_of(ATE=values.ravel(), DTE=rescaled.ravel())
        task = neighbouring_levels(table, "sigma_t")
        assert estimate(task.shares("ATE") - task.shares("DTE")) == Order(0, 0)


@pytest.mark.parametrize("paired", [False, True])
def test_the_error_of_an_order_is_its_scatter_from_study_to_study(paired):
    rng = np.random.default_rng(1)
    estimates = []
    for _ in range(400):
        noise = rng.normal([[0], [1], [1.5]], size=(3, 100))
        other = noise + rng.normal(scale=0.5, size=noise.shape)
        task = neighbouring_levels(table_of(ATE=noise.ravel(), DTE=other.ravel()), "sigma_t")
        estimates.append(estimate(task.shares("ATE") - paired * task.shares("DTE")))
    scatter = np.std([each.probability for each in estimates])
    assert np.mean([each.error for each in estimates]) == pytest.approx(scatter, rel=0.1)
    assert order([1], [2]).error == math.inf  # one trial tells nothing of it


def test_trials_needed_find_the_difference_as_often_as_they_should():
    """A normal shift of 0.8 is ordered with a probability of 0.714."""
    probability = float(stats.norm.cdf(0.8 / np.sqrt(2)))
    n = trials_needed(probability)
    assert n == np.ceil((1.959964 + 0.841621) ** 2 / (6 * (probability - 0.5) ** 2))
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(2, 1000, int(n))) + np.array([0.8, 0])[:, None, None]
    significant = stats.mannwhitneyu(*samples, axis=1).pvalue < 0.05
    assert significant.mean() == pytest.approx(0.8, abs=0.05)
    assert trials_needed(0.4) == math.inf


def test_what_has_no_value_cannot_be_put_in_order():
    """A tie with everything: neither refusing the better nor refusing the worse is rewarded."""
    assert order([np.nan, 1.0], [2.0, 2.0]).probability == 0.75
    assert order([1.0, 1.0], [np.nan, 0.0]).probability == 0.25
    assert order(*[[np.nan] * 2] * 2).probability == 0.5


def test_an_interval_and_a_p_value_come_of_one_error():
    estimate = Order(0.6, 0.05)
    assert estimate.interval == pytest.approx((0.502, 0.698), abs=1e-3)
    assert Order(-0.1, 0.05).p_value == Order(0.1, 0.05).p_value == pytest.approx(0.0455, abs=1e-4)
    # Without an error a difference is certain, and none is none.
    assert (Order(0.1, 0).p_value, Order(0, 0).p_value) == (0, 1)
