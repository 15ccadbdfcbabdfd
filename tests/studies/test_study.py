"""The studies, and the settings of their tables."""

from experiments.config import experiment_names, load_sweep
from studies import paper
from studies.study import find_studies


def test_the_experiments_share_their_settings():
    tables = paper.plan(["trials=5", "seed=3"])
    assert list(tables) == experiment_names()
    for name, settings in tables.items():
        sweep = load_sweep(settings)
        assert (sweep.name, sweep.trials, sweep.seed) == (name, 5, 3)


def test_the_studies_have_the_order_of_the_report():
    assert list(find_studies()) == [
        *("paper", "claims", "head_to_head", "threshold_study", "beyond", "real"),
    ]
