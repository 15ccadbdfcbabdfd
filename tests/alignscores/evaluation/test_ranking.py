"""The order of the estimates, and which of them are tied."""

from math import inf
from types import SimpleNamespace

import numpy as np
import pytest

from alignscores import tas_profile
from alignscores.evaluation.ranking import TIED_HALF, in_rank_order, ranked_by, ranks
from alignscores.profile import HALF_UNITS


def estimate(mean, sd, repeat=4, *, unit=1.0, half=1.0, parts=()):
    return SimpleNamespace(
        pas=mean,
        pas_sd=sd,
        tas_seeds=[mean] * repeat,
        result=SimpleNamespace(tas=SimpleNamespace(unit=unit)),
        half_distance=half,
        parts=parts,
    )


def test_means_within_two_standard_errors_are_tied():
    """Of the difference: 2 sqrt((0.03^2 + 0.04^2) / 4) = 0.05."""
    first = estimate(0.8, 0.03)
    assert ranks([first, estimate(0.751, 0.04)]) == [(1, 2), (1, 2)]
    assert ranks([first, estimate(0.749, 0.04)]) == [(1, 1), (2, 2)]


def test_ties_are_not_transitive():
    assert ranks([estimate(score, 0.02) for score in (0.9, 0.88, 0.86)]) == [(1, 2), (1, 3), (2, 3)]


def test_a_single_seed_ties_equal_scores_alone():
    assert ranks([estimate(score, None, 1) for score in (0.9, 0.9, 0.8)]) == [
        (1, 2),
        (1, 2),
        (3, 3),
    ]


@pytest.mark.parametrize(
    ("largest_unit", "parts", "by", "order", "expected"),
    [
        (1.03, (), "PAS", [0, 1, 2, 3], [(1, 1), (2, 2), (3, 3), (4, 4)]),
        (1.04, (), "half_distance", [3, 1, 2, 0], [(1, 1), (2, 3), (2, 3), (4, 4)]),
        (1.0, (1, 2), None, [0, 1, 2, 3], [None] * 4),
    ],
)
def test_what_estimates_are_ranked_by(largest_unit, parts, by, order, expected):
    """Half-score distances where d differs: infinite ones last, equal ones tied."""
    scored = [
        estimate(0.9, None, half=inf),
        estimate(0.8, None, half=2.0, parts=parts),
        estimate(0.7, None, half=2.001),
        estimate(0.6, None, half=1.0, unit=largest_unit),
    ]
    assert ranked_by(scored) == by
    assert in_rank_order(scored) == [scored[index] for index in order]
    assert ranks(in_rank_order(scored)) == expected


def test_one_estimate_is_tied_with_itself_from_any_unit():
    """The search for its half-score distance starts from d, which depends on the frame rate."""
    rng = np.random.default_rng(0)
    differences = []
    for _ in range(6):
        truth = np.cumsum(rng.normal(size=(20, 3)), axis=0)
        estimate = truth + 0.05 * rng.standard_t(4, size=truth.shape)
        estimate[:4] = rng.random((4, 3))
        starts = np.geomspace(0.02, 2, 8)
        halves = [tas_profile(truth, estimate, start * HALF_UNITS).half for start in starts]
        differences.append(max(halves) / min(halves) - 1)
    assert 1e-3 < max(differences) < TIED_HALF


def test_nothing_ranks_estimates_that_never_reach_one_half():
    scored = [estimate(0.1, None, half=inf, unit=unit) for unit in (1.0, 2.0)]
    assert ranks(scored) == [(1, 2), (1, 2)]
    assert (ranked_by([]), in_rank_order([]), ranks([])) == (None, [], [])


def test_real_ties(run, score):
    """The same estimate, once from another seed on, is no better than itself."""
    estimates = ["tum/estimate.txt", "tum/estimate.txt", "tum/reference.txt"]
    options = "--unit", 0.6, "--registration", "pcr99"
    results = score("tum", "tum/reference.txt", *estimates, *options)
    assert [result["rank"] for result in results] == [[1, 1], [2, 3], [2, 3]]
    _, out, _ = run("tum", "tum/reference.txt", *estimates, *options)
    assert [line[16:].split()[0] for line in out.splitlines()[1:4]] == ["1", "2-3", "2-3"]
    assert "ranks in common: tied, PAS less than 2 standard errors apart over the seeds\n" in out
    _, out, _ = run("tum", "tum/reference.txt", *estimates)
    assert "ranks in common: tied, of equal PAS\n" in out
