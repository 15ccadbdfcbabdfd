"""Effects of the values of an axis: statistics of the trials, with their errors."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import wilcoxon

from experiments.config import load, load_sweep
from experiments.sweep import run_sweeps
from studies.axes import Axis
from studies.order import orders
from studies.statistics import dependence
from studies.threshold_study.effects import EFFECTS, effects

from .conftest import SMALL

Tables = dict[str, pd.DataFrame]


def test_trials_are_those_of_the_experiment(tables: Tables) -> None:
    sweep = load_sweep(["experiment=maa_vs_pas_outliers", *SMALL[:5]])
    plain = run_sweeps([sweep], load(["n_jobs=1"])[1])
    pd.testing.assert_series_equal(tables["outliers"]["PAS"], plain["PAS"], check_exact=True)


def test_effects_are_the_statistics_of_the_trials(axes: list[Axis], tables: Tables) -> None:
    # One number of cameras, so that a group is what shares the number of outliers.
    tables["outliers"] = tables["outliers"][tables["outliers"]["n_cameras"] == 20]
    table = effects(axes, tables)
    assert len(table) == 18
    row = table[(table["axis"] == "tas_max_threshold") & (table["value"] == "0.5")].iloc[0]
    metric = "TAS(max_threshold=0.5)"
    outliers = tables["outliers"]
    noise = [100 * found.probability for found in orders(outliers, metric, "sigma_t")]
    assert row["noise_order"] == pytest.approx(np.mean(noise), abs=1e-6)
    lost = [100 * found.probability for found in orders(outliers, metric, "n_outliers")]
    assert row["outlier_order_smallest"] == pytest.approx(min(lost), abs=1e-6)
    most = [100 * found.probability for found in orders(tables["majority"], metric, "sigma_t")]
    assert row["majority_order"] == pytest.approx(np.mean(most), abs=1e-6)
    by_outliers = [group for _, group in outliers.groupby("n_outliers")]
    ranges = [np.ptp(group[metric]) for group in by_outliers]
    assert row["noise_range"] == pytest.approx(np.mean(ranges), abs=1e-6)
    ranges = [np.ptp(group.groupby("sigma_t")[metric].mean()) for group in by_outliers]
    assert row["noise_range_of_means"] == pytest.approx(np.mean(ranges), abs=1e-6)
    expected = dependence(tables["length"], metric, ["n_cameras"], "mean")
    assert row["camera_dependence"] == pytest.approx(expected, abs=1e-6)
    spread = [
        np.std([scene[f"TAS(max_threshold=0.5, seed={k})"] for k in range(10)], ddof=1)
        for _, scene in tables["seeds"].iterrows()
    ]
    assert row["seed_noise"] == pytest.approx(np.median(spread), abs=1e-6)
    assert (table.loc[table["metric"] == "RAS", "seed_noise"] == 0).all()


def test_the_papers_row_has_no_error_and_the_others_have(
    axes: list[Axis], table: pd.DataFrame, tables: Tables
) -> None:
    columns = [column for column in table if column.endswith(("_error", "_p"))]
    paper = table["paper"] == "yes"
    assert paper.sum() == 9
    assert table.loc[paper, columns].isna().all(axis=None)
    assert table.loc[~paper, columns].notna().all(axis=None)
    one = {name: part[part["trial"] == 0] for name, part in tables.items()}
    assert effects(axes, one)[columns].isna().all(axis=None)


def test_errors_are_those_of_the_difference_from_the_papers_value(axes: list[Axis]) -> None:
    """Trials are paired: what scatters alike with either value is no error."""
    axis = next(axis for axis in axes if axis.name == "tas_max_threshold")
    settings = {"experiment": "a", "geometry": "cube", "replicate": 0, "n_cameras": 20}
    cells = [(k, level, trial) for k in (0, 1) for level in (1, 2) for trial in range(40)]
    outliers = pd.DataFrame(cells, columns=["n_outliers", "sigma_t", "trial"]).assign(**settings)
    outliers["sigma_r_deg"] = outliers["sigma_t"]
    rng = np.random.default_rng(0)
    seeds = outliers[["trial"]].iloc[:40].copy()
    for k in range(5):
        seeds[f"TAS(seed={k})"] = rng.normal(size=40)
        seeds[f"TAS(max_threshold=0.5, seed={k})"] = 0.5 * seeds[f"TAS(seed={k})"]
    for other in (0.0, rng.normal(size=len(outliers))):
        outliers["TAS"] = outliers["sigma_t"] + rng.normal(size=len(outliers))
        outliers[axis.columns["0.5"]] = outliers["TAS"] + 0.1 + other
        parts = dict.fromkeys(("outliers", "majority", "length"), outliers) | {"seeds": seeds}
        row = effects([axis], parts).set_index("value").loc["0.5"]
        error, p = row[["noise_range_of_means_error", "noise_range_of_means_p"]]
        # Two groups, each the difference of two means of 40 with a standard deviation of 1.
        assert error == pytest.approx(
            np.sqrt(2 / 40 / 2) if np.any(other) else 0, rel=0.25, abs=1e-9
        )
        assert (p == 1) == (not np.any(other))
    ours, theirs = (seeds.filter(regex=name).std(axis=1) for name in (r"^TAS\(s", r"^TAS\(m"))
    assert row["seed_noise"] == pytest.approx(theirs.median(), abs=1e-6)
    alone = wilcoxon(theirs, ours).pvalue
    assert row["seed_noise_p"] == pytest.approx(5 * alone, abs=1e-6)  # the smallest of five


def test_a_score_that_rises_with_noise_is_wrong(axes: list[Axis], tables: Tables) -> None:
    outliers = tables["outliers"]
    tables["outliers"] = outliers.assign(TAS=outliers["sigma_t"] + outliers["n_outliers"])
    row = effects(axes[:1], tables).set_index(["axis", "value"]).loc["tas_max_threshold", "1"]
    found = [name for name in EFFECTS if "order" in name and "majority" not in name]
    assert (row[found] == 0).all()


def test_what_does_not_vary_has_no_effect(axes: list[Axis], tables: Tables) -> None:
    tables["outliers"] = tables["outliers"][tables["outliers"]["n_outliers"] == 0]
    tables["length"] = tables["length"][tables["length"]["n_cameras"] == 20]
    table = effects(axes[:2], tables)
    assert table[["outlier_order", "camera_dependence"]].isna().all(axis=None)
    assert table["noise_order"].notna().all()
