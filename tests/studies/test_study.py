"""The paper's experiments as a study, and the settings of a table as they are handed on."""

from dataclasses import replace

import pytest

from experiments.config import ConfigError, Selection, experiment_names, load_sweep
from experiments.tables import SWEEPS
from studies.study import Table, load_experiments


def test_the_experiments_share_their_settings() -> None:
    study = load_experiments(["trials=5", "seed=3"])
    assert study.name == "experiments"
    assert list(study.tables) == experiment_names()
    for name, table in study.tables.items():
        assert table.sweeps == (load_sweep([f"experiment={name}", "trials=5", "seed=3"]),)


def test_a_setting_that_does_not_suit_an_experiment_is_named_with_it() -> None:
    settings = r"experiment=collinear volume_per_camera=0\.1"
    with pytest.raises(ConfigError, match=rf"'volume_per_camera' applies to .* \({settings}\)$"):
        load_experiments(["volume_per_camera=0.1"]).tables["collinear"]


def test_settings_of_a_table_are_handed_on_whole_and_have_a_digest_of_their_own() -> None:
    sweep = load_sweep(["experiment=combined"])
    variants = [
        replace(sweep, sigma_t=[0.1 + 0.2, 1e-9]),
        replace(sweep, trials=51),
        replace(sweep, differs="x=1"),
        replace(sweep, only=[Selection(["PAS"], {"sigma_t": [0.05]})]),
    ]
    tables = [Table((one,)) for one in (sweep, *variants)] + [Table((sweep, *variants))]
    for table in tables:
        assert SWEEPS.validate_json(table.json) == table.sweeps
        assert table.digest == Table(SWEEPS.validate_json(table.json)).digest
    assert len({table.digest for table in tables}) == len(tables)
