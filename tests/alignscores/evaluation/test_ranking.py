"""The order of the estimates, and which of them are tied."""

from types import SimpleNamespace

import pytest

from alignscores.evaluation.ranking import are_ranked, in_rank_order, ranking_notes, ranks


def estimate(mean, sd, repeat=4, *, parts=()):
    return SimpleNamespace(pas=mean, pas_sd=sd, tas_seeds=[mean] * repeat, parts=parts)


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
    ("parts", "order", "expected"),
    [
        ((), [1, 2, 0], [(1, 1), (2, 2), (3, 3)]),
        ((1, 2), [0, 1, 2], [None] * 3),
    ],
)
def test_what_estimates_are_ranked_by(parts, order, expected):
    """The PAS; but nothing where they are in different numbers of parts."""
    scored = [estimate(0.7, None), estimate(0.9, None, parts=parts), estimate(0.8, None)]
    assert are_ranked(scored) == (not parts)
    assert in_rank_order(scored) == [scored[index] for index in order]
    assert ranks(in_rank_order(scored)) == expected


def test_no_estimates_have_no_order():
    assert (in_rank_order([]), ranks([])) == ([], [])


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


def test_why_scores_do_not_compare_is_said():
    one, two, five = (estimate(0.5, None, parts=range(n)) for n in (0, 2, 5))
    assert ranking_notes([]) == ranking_notes([one, one]) == ranking_notes([two, two]) == []
    for some, numbers in (([two, one, one], "from 1 to 2"), ([five, two], "from 2 to 5")):
        assert ranking_notes(some) == [
            f"the scores do not compare and stand in the order given: {numbers} parts are each "
            "aligned on their own, and more of them fit better"
        ]
