"""The maps of thresholds: which trials they are of, and what they say of trials that are known."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.command import ConfigError
from experiments.grid import Cell
from experiments.tables import Trials
from studies.threshold_study.maps import THRESHOLDS, compare, plan, sentences

from ..conftest import undescribed

MakeUp = Callable[..., Trials]

SMALL = ["tas_max_threshold=[0.5,2]", "registration_n_hypotheses=[100]", "trials=6"]


def test_values_are_settable_and_combined() -> None:
    study = plan(SMALL)
    (sweep,) = study["tas_line_30"].sweeps
    assert sweep.metrics == [
        *("TAS(max_threshold=0.5)", "TAS", "TAS(max_threshold=2)"),
        *("TAS(registration=refined)", "HalfDistance"),
    ]
    assert (sweep.geometry, sweep.n_cameras, sweep.trials) == ("line", [30], 6)
    pairs = list(zip(sweep.sigma_t[::2], sweep.sigma_t[1::2], strict=True))
    assert [high / low for low, high in pairs] == pytest.approx([1.15] * 9, rel=0.01)
    (sweep,) = study["registration_outliers_50"].sweeps
    assert len(sweep.metrics) == 5 * 3 * 2 + 1
    assert "TAS(order=0.2, prescreen=0.03, n_hypotheses=100)" in sweep.metrics


@pytest.fixture
def parts(make_up: MakeUp) -> dict[str, Trials]:
    """Threshold 2 orders noise, the paper's values do by chance, and m = 0.5 n inverts it."""

    def value(metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
        noise = cell.sigma_t + cell.sigma_r_deg
        if "max_threshold=2" in metric or metric == "HalfAngle":
            return -noise if metric != "HalfAngle" else noise
        if "order=0.5" in metric:
            return noise
        return float(rng.random())

    tables = plan([*SMALL, "ras_max_threshold_deg=[2]"])
    return {
        name: make_up(replace(table.sweeps[0], trials=6), value=value, seed=number)
        for number, (name, table) in enumerate(tables.items())
    }


def test_orders_and_differences_from_the_papers_value(parts: dict[str, Trials]) -> None:
    table = compare(parts)
    best = table[(table["map"] == "tas") & (table["max_threshold"] == 2)]
    assert (best["right_order"] == 100).all()
    paper = table[(table["map"] == "tas") & (table["metric"] == "TAS")]
    assert len(paper) == 9 * 9
    assert 30 < paper["right_order"].mean() < 70
    assert (paper["difference"] == 0).all()
    assert paper["p"].isna().all()
    np.testing.assert_allclose(best["difference"], 100 - paper["right_order"].to_numpy(), atol=1e-5)
    assert best["noise"].unique()[0] == pytest.approx(0.0125 * np.sqrt(1.15), rel=0.01)
    inverted = table[table["right_order"] == 0]
    assert set(inverted.loc[inverted["map"] == "registration", "metric"]) >= {"TAS(order=0.5)"}


def test_where_no_threshold_is_good_everywhere_none_is_named(
    parts: dict[str, Trials], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studies.threshold_study.maps.NEARLY_BEST", -1.0)  # better than the best
    tas, ras, _ = sentences(compare(parts))
    for sentence in (tas, ras):
        assert "None comes within -1 % of the best at every noise." in sentence
        assert "nan" not in sentence


def test_the_table_is_described_and_said_in_sentences(parts: dict[str, Trials]) -> None:
    table = compare(parts)
    assert undescribed(compare, table) == []
    text = "\n".join(sentences(table))
    assert "with the best of 3 thresholds at each noise, found afterwards" in text
    assert "TAS(order=0.5) −" in text
    assert "HalfAngle 100 %" in text


def test_an_axis_of_no_study_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "maps.yaml"
    text = THRESHOLDS.read_text()
    path.write_text(text.replace("values: { tas_max_threshold", "values: { tas_max_treshold"))
    monkeypatch.setattr("studies.threshold_study.maps.THRESHOLDS", path)
    with pytest.raises(
        ConfigError, match=r"maps\.yaml: maps\.tas: unknown axis 'tas_max_treshold'"
    ):
        plan()
