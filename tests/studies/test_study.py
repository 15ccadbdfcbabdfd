"""The studies, and the settings of their tables."""

import pytest

from experiments.config import ConfigError
from studies import paper
from studies.study import find_studies


def test_the_studies_have_the_order_of_the_report():
    assert list(find_studies()) == [
        *("paper", "claims", "head_to_head", "threshold_study", "beyond", "real"),
    ]


def test_a_setting_that_does_not_suit_an_experiment_is_named_with_it():
    settings = r"experiment=collinear volume_per_camera=0\.1"
    with pytest.raises(ConfigError, match=rf"'volume_per_camera' applies to .* \({settings}\)$"):
        paper.load_experiment(["experiment=collinear", "volume_per_camera=0.1"])
