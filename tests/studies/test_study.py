"""The paper's experiments as a study, and the settings of a table as they are handed on."""

import pytest

from experiments.config import ConfigError, experiment_names, load_sweep
from studies.paper import plan
from studies.study import found, plans


def test_the_experiments_share_their_settings() -> None:
    tables = plans(["trials=5", "seed=3", "n_jobs=1", "replicates=2"])["paper"].tables
    assert list(tables) == experiment_names()
    for name, table in tables.items():
        assert table.sweeps == (load_sweep([f"experiment={name}", "trials=5", "seed=3"]),)


def test_a_setting_that_does_not_suit_an_experiment_is_named_with_it() -> None:
    settings = r"experiment=collinear volume_per_camera=0\.1"
    with pytest.raises(ConfigError, match=rf"'volume_per_camera' applies to .* \({settings}\)$"):
        plan(["volume_per_camera=0.1"])["collinear"]


def test_the_studies_have_the_order_of_the_report() -> None:
    assert [study.name for study in found()] == [
        *("paper", "claims", "head_to_head", "threshold_study", "beyond", "real"),
    ]
