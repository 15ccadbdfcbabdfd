"""The paper's experiments as a study, and the settings of a table as they are handed on."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.config import ConfigError, Selection, experiment_names, load_sweep
from experiments.tables import SWEEPS
from studies.frame_rate.rates import FRAME_RATE, load_frame_rate
from studies.parameters.axes import load_parameters, study_file
from studies.parameters.maps import MAPS, load_maps
from studies.study import Study, Table, load_experiments
from studies.today.questions import TODAY, load_today


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
        replace(sweep, changes="x=1"),
        replace(sweep, selections=[Selection(["PAS"], {"sigma_t": [0.05]})]),
    ]
    tables = [Table((one,)) for one in (sweep, *variants)] + [Table((sweep, *variants))]
    for table in tables:
        assert SWEEPS.validate_json(table.json) == table.sweeps
        assert table.digest == Table(SWEEPS.validate_json(table.json)).digest
    assert len({table.digest for table in tables}) == len(tables)


@pytest.mark.parametrize(
    ("name", "file", "load", "section", "first"),
    [
        ("frame_rate.rates.FRAME_RATE", FRAME_RATE, load_frame_rate, "scenarios", "car"),
        ("today.questions.TODAY", TODAY, load_today, "questions", "outliers"),
        ("parameters.maps.MAPS", MAPS, load_maps, "maps", "tas.parts.cube_30"),
        (
            "parameters.axes.study_file",
            study_file("threshold"),
            lambda: load_parameters("threshold"),
            "trials",
            "outliers",
        ),
    ],
)
def test_the_file_of_a_study_is_named_with_the_key_at_fault(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    name: str,
    file: Path,
    load: Callable[[], Study],
    section: str,
    first: str,
) -> None:
    path = tmp_path / "own.yaml"
    monkeypatch.setattr(f"studies.{name}", (lambda _: path) if "study_file" in name else path)
    text = file.read_text()
    for old, new, problem in (
        (f"\n{section}:", f"\n{section}s:", f"{section} is missing; {section}s is unknown"),
        (f"\n{section}:", f"\nown: 5\n{section}:", "own is unknown"),
        ("maa_vs_pas_outliers", "[a]", f"{section}.{first}: "),
        ("experiment: maa", "n_jobs: 1, experiment: maa", "may not set n_jobs"),
        ("experiment: maa", "seed: many, experiment: maa", "'seed': should be a valid integer"),
    ):
        if "\n  experiment" in text and old.startswith("experiment"):
            new = new.replace(", ", "\n  ")
        path.write_text(text.replace(old, new, 1))
        with pytest.raises(ConfigError) as caught:
            load()
        assert str(caught.value).startswith(f"{path}: ")
        assert problem in str(caught.value)
        assert "\n" not in str(caught.value)
