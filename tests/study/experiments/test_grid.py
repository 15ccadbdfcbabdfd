"""The grid of each experiment, and what is evaluated in its cells."""

from experiments.config import experiment_names, load_sweep
from experiments.grid import cells


def test_the_eight_experiments_of_the_paper_are_there():
    grids = {name: len(cells(load_sweep([f"experiment={name}"]))) for name in experiment_names()}
    assert grids == {
        "collinear": 70,
        "combined": 50,
        "maa_vs_pas_collinear": 70,
        "maa_vs_pas_length": 70,
        "maa_vs_pas_outliers": 70,
        "outliers": 70,
        "rotations": 70,
        "trajectory_length": 70,
    }


def test_noise_rises_together_where_it_is_paired():
    grid = cells(load_sweep(["experiment=maa_vs_pas_outliers", "n_outliers=[0]"]))
    assert [round(100 * cell.sigma_t) for cell in grid] == list(range(1, 11))
    assert [cell.sigma_r_deg for cell in grid] == list(range(1, 11))
