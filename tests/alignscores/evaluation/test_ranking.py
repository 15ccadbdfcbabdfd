"""The order of the estimates, and which of them are tied."""

import pytest

from alignscores.evaluation.ranking import in_rank_order, ranks

from ..conftest import write_poses
from .test_scoring import scene


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


@pytest.mark.parametrize("n_parts", [[1, 1], [1, 2]])
def test_estimates_in_different_numbers_of_parts_are_not_ranked(score, run, tmp_path, n_parts):
    reference, (names, poses), _ = scene()
    poses[4, :3, 3] = 0
    write_poses["colmap"](tmp_path / "gt", *reference)
    for k, n in enumerate(n_parts):
        for part in range(n):
            rows = slice(part * 22 // n, (part + 1) * 22 // n)
            write_poses["colmap"](tmp_path / f"est{k}" / str(part), names[rows], poses[rows])
    files = "colmap", tmp_path / "gt", tmp_path / "est0", tmp_path / "est1"
    ranked = n_parts == [1, 1]
    assert [bool(result["rank"]) for result in score(*files)] == [ranked] * 2
    note = "do not compare and stand in the order given: from 1 to 2 parts are each aligned on"
    assert (note in run(*files)[2]) == (not ranked)
