"""Table 1 follows from the trials: other trials give another table."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.comparison import COLLINEAR, EXPERIMENTS, LENGTH, OUTLIERS, compare, main
from experiments.config import Config, load
from experiments.sweep import cells
from experiments.tables import TableError, write_trials

NOISE, LEVELS = 0.01, {"sigma_t": "[0.02,0.06,0.1]", "n_outliers": "[0,10,50]"}


def settings(name: str, results: Path) -> Config:
    overrides = [f"experiment={name}", f"results_dir={results}", "trials=3"]
    if name in ("outliers", "collinear"):
        overrides += [f"{key}={value}" for key, value in LEVELS.items()]
    if name == "combined":
        overrides += ["sigma_t=[0.05]", "sigma_r_deg=[3]"]
    return load(overrides)


def fabricate(config: Config, *, blind: frozenset[str], grows: frozenset[str]) -> None:
    """Write trials whose metrics follow the noise, but for some: blind, or following n."""
    rng = np.random.default_rng(0)
    rows = []
    for cell in cells(config):
        for trial in range(config.trials):
            row = {"experiment": config.name, "geometry": config.geometry, **vars(cell)}
            row |= {"replicate": 0, "trial": trial}
            noise = 10 * cell.sigma_t + cell.sigma_r_deg / 10
            for metric in config.metrics:
                value = rng.random() if metric in blind else noise + NOISE * rng.random()
                row[metric] = cell.n_cameras if metric in grows else value
            rows.append(row)
    write_trials(config, pd.DataFrame(rows))


def table_of(
    tmp_path: Path, *, blind: frozenset[str] = frozenset(), grows: frozenset[str] = frozenset()
) -> pd.DataFrame:
    configs = {name: settings(name, tmp_path) for name in EXPERIMENTS}
    for config in configs.values():
        fabricate(config, blind=blind, grows=grows if "length" in config.name else frozenset())
    return compare(configs).set_index(["metric", "property"])


def test_discerning_metrics_pass_and_blind_ones_fail(tmp_path: Path) -> None:
    table = table_of(tmp_path, blind=frozenset({"TAS", "RAS"}))
    for metric in ("TAS", "RAS"):
        assert table.loc[(metric, "robust to outliers"), "ours"] == "no"
        assert table.loc[(metric, "robust to outliers"), "agrees"] == "no"
    assert table.loc[("TAS", "robust to collinearity"), "ours"] == "no"
    assert table.loc[("ATE", "robust to outliers"), "ours"] == "yes"
    assert table.loc[("ATE", "robust to outliers"), "agrees"] == "no"
    assert table.loc[("DRE", "robust to outliers"), "ours"] == "yes"


def test_a_metric_that_grows_with_the_trajectory_is_sensitive_to_its_length(tmp_path: Path) -> None:
    name = "insensitive to trajectory length"
    table = table_of(tmp_path, grows=frozenset({"TAS"}))
    assert table.loc[("TAS", name), "ours"] == "no"
    assert table.loc[("DTE", name), "ours"] == "yes"


def test_the_ate_alone_needs_metric_scale(tmp_path: Path) -> None:
    answers = table_of(tmp_path).xs("metric scale unnecessary", level="property")["ours"]
    assert answers.to_dict() == {
        metric: "no" if metric == "ATE" else "yes" for metric in answers.index
    }


def test_what_no_experiment_tells_is_not_claimed(tmp_path: Path) -> None:
    table = table_of(tmp_path)
    untested = table[table["ours"] == "not tested"].index.get_level_values("metric")
    assert set(untested) == {"DRE", "RAS"}
    assert table.loc["DRE", "agrees"].isna().sum() == 2


def test_command_line_writes_csv_and_markdown(tmp_path: Path) -> None:
    shared = ["trials=3", f"results_dir={tmp_path}"]
    for name in EXPERIMENTS:
        fabricate(load([f"experiment={name}", *shared]), blind=frozenset(), grows=frozenset())
    assert main(shared) == 0
    table = pd.read_csv(tmp_path / "tables" / "method_comparison.csv")
    assert len(table) == 7 * 4
    text = (tmp_path / "tables" / "method_comparison.md").read_text()
    assert text.count("\n| ") == 7
    assert "**✓**" in text  # the fabricated ATE is robust, which the paper denies


def test_a_missing_table_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([f"results_dir={tmp_path}"]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert str(tmp_path / "trials") in error


def test_trials_that_cannot_tell_are_refused(tmp_path: Path) -> None:
    configs = {name: settings(name, tmp_path) for name in EXPERIMENTS}
    for config in configs.values():
        fabricate(config, blind=frozenset(), grows=frozenset())
    one_level = load(["experiment=outliers", f"results_dir={tmp_path}", "sigma_t=[0.05]"])
    fabricate(one_level, blind=frozenset(), grows=frozenset())
    with pytest.raises(TableError, match="one noise level"):
        compare(configs)


def test_every_metric_is_compared_where_the_paper_shows_it() -> None:
    for experiments in (OUTLIERS, COLLINEAR, LENGTH):
        for metric, name in experiments.items():
            assert metric in load([f"experiment={name}"]).metrics
