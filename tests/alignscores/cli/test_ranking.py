"""The order of the estimates, and which of them are tied."""

from types import SimpleNamespace

from alignscores.cli.ranking import ranks


def estimate(mean, sd, repeat=4):
    return SimpleNamespace(pas=mean, pas_sd=sd, tas_seeds=[mean] * repeat)


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


def test_real_ties(run, score):
    """The same estimate, once from another seed on, is no better than itself."""
    estimates = ["tum/estimate.txt", "tum/estimate.txt", "tum/reference.txt"]
    results = score("tum", "tum/reference.txt", *estimates, "--unit", 0.6)
    assert [result["rank"] for result in results] == [[1, 1], [2, 3], [2, 3]]
    _, out, _ = run("tum", "tum/reference.txt", *estimates, "--unit", 0.6)
    assert [line.split()[-10] for line in out.splitlines()[1:4]] == ["1", "2-3", "2-3"]
    assert "ranks in common: tied, PAS less than 2 standard errors apart over the seeds\n" in out
