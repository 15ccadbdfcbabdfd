"""Figures of the parameter studies."""

import importlib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.effects import EFFECTS
from experiments.study import STUDIES as STUDY_NAMES
from experiments.study import load_study
from figures import FIGURES, STUDIES, registration_study, threshold_study
from figures.__main__ import main


@pytest.fixture
def effects() -> pd.DataFrame:
    """A table of the threshold study, made up."""
    rng = np.random.default_rng(0)
    rows = [
        {
            "axis": axis.name,
            "metric": axis.metric,
            "option": axis.option,
            "value": value,
            "paper": "yes" if value == axis.paper else "no",
        }
        | {name: rng.uniform(0.3, 0.9) for name in EFFECTS}
        | {f"{name}_error": np.nan if value == axis.paper else 0.01 for name in EFFECTS}
        for axis in load_study("threshold").axes.values()
        for value in axis.values
    ]
    return pd.DataFrame(rows)


@pytest.fixture
def registrations() -> pd.DataFrame:
    """A table of the registration study, made up."""
    rows = []
    for part in load_study("registration").parts.values():
        for n in part.config.n_cameras:
            for k in part.config.n_outliers:
                row = {"part": part.name, "geometry": part.config.geometry}
                row |= {"n_cameras": n, "n_outliers": k, "pcr99": 0.8, "refined": 0.9}
                if not part.seeds:
                    rows.append(row | {"statistic": "τ with noise"})
                    continue
                for sigma in part.config.sigma_t:
                    for name, low in (("mean", 0.5), ("smallest", 0.4), ("largest", 0.7)):
                        row |= {"sigma_t": sigma, "trial": 0, "pcr99": low, "refined": 0.8}
                        rows.append(row | {"statistic": name})
    return pd.DataFrame(rows)


def test_studies_are_no_figures_of_the_paper() -> None:
    assert not set(STUDIES) & set(FIGURES)
    assert set(STUDIES) == {f"{name}_study" for name in STUDY_NAMES}
    for name in STUDIES:
        assert importlib.import_module(f"figures.{name}").__all__ == ["draw"]


def test_threshold_study_shows_every_value_of_every_axis(effects: pd.DataFrame) -> None:
    figure = threshold_study.draw(effects)
    panels = figure.axes
    assert len(panels) == 6
    labels = panels[0].get_yticklabels()
    assert len(labels) == len(effects) + effects["axis"].nunique()
    bold = [label.get_text() for label in labels if label.get_fontweight() == "bold"]
    assert [text for text in bold if ":" not in text] == [
        axis.paper for axis in load_study("threshold").axes.values()
    ]
    assert "exact area" in [label.get_text() for label in labels]
    for panel, effect in zip(
        panels,
        (
            "noise_power",
            "outlier_power",
            "majority_power",
            "noise_range_of_means",
            "camera_dependence",
            "seed_noise",
        ),
        strict=True,
    ):
        dots = [line for line in panel.lines if line.get_marker() == "o"]
        drawn = {
            (round(x, 9), y)
            for line in dots
            for x, y in zip(*map(np.asarray, line.get_data()), strict=True)
        }
        assert {x for x, _ in drawn} == set(effects[effect].round(9))
        assert len({y for _, y in drawn}) == len(effects)  # no two in one row


def test_threshold_study_without_effects_of_what_does_not_vary(effects: pd.DataFrame) -> None:
    effects[["outlier_power", "outlier_power_smallest", "outlier_power_error"]] = np.nan
    few = effects[effects["axis"] == "pas_weight"].reset_index(drop=True)
    for table in (effects, few):
        figure = threshold_study.draw(table)
        figure.draw_without_rendering()


def test_registration_study_has_a_panel_for_each_set_of_inputs(registrations: pd.DataFrame) -> None:
    figure = registration_study.draw(registrations)
    shown = [axes for axes in figure.axes if axes.axison]
    titles = [axes.get_title(loc="left") for axes in shown]
    assert titles[:3] == [f"In a cube, {n} cameras" for n in (37, 100, 500)]
    assert titles[3:6] == [f"On a line, {n} cameras" for n in (37, 100, 500)]
    assert titles[6:9] == [f"In clusters, {n} cameras" for n in (37, 100, 500)]
    assert len(titles) == 12
    bars = [line for line in shown[0].lines if len(line.get_ydata()) == 2][:2]
    assert [list(bar.get_ydata()) for bar in bars] == [[0.4, 0.7], [0.8, 0.8]]


def test_registration_study_with_several_inputs_of_a_kind(registrations: pd.DataFrame) -> None:
    more = registrations[registrations["trial"].notna()].assign(trial=1)
    figure = registration_study.draw(pd.concat([registrations, more], ignore_index=True))
    first = figure.axes[0]
    ticks = [label.get_text() for label in first.get_xticklabels()]
    assert ticks == ["0", "0", "11", "11", "18", "18", "33", "33"] * 2


def test_registration_study_of_one_experiment(registrations: pd.DataFrame) -> None:
    part = registrations["part"].isin(["line_37", "collinear"])
    figure = registration_study.draw(registrations[part])
    figure.draw_without_rendering()
    assert len([axes for axes in figure.axes if axes.axison]) == 2


def test_drawn_from_the_tables(
    effects: pd.DataFrame, registrations: pd.DataFrame, tmp_path: Path
) -> None:
    folder = tmp_path / "tables"
    folder.mkdir()
    for kind, rows in effects.groupby(effects["axis"].str.partition("_")[0]):
        rows.to_csv(folder / f"threshold_study_{kind}.csv", index=False)
    registrations.to_csv(folder / "registration_study.csv", index=False)
    for name in STUDIES:
        assert main([name, f"results_dir={tmp_path}"]) == 0
        files = [tmp_path / "figures" / f"{name}.{kind}" for kind in ("pdf", "png")]
        assert all(path.stat().st_size > 10_000 for path in files)


def test_missing_tables_end_in_the_command_that_makes_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["threshold_study", f"results_dir={tmp_path}"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "threshold_study_tas.csv does not exist" in line
    assert line.endswith(f"run: python -m experiments.threshold_study results_dir={tmp_path}")
    assert main(["threshold_study", "tas_quantile=[2]"]) == 2
    assert "quantile must be above 0" in capsys.readouterr().err
