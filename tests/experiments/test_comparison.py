"""Table 1 follows from the trials: other trials give another table."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.comparison import (
    COLLINEAR,
    EXPERIMENTS,
    LENGTH,
    OUTLIERS,
    PAPER,
    PROPERTIES,
    compare,
    main,
)
from experiments.config import Config, load
from experiments.statistics import SCORES
from experiments.sweep import Cell, cells
from experiments.tables import TableError, write_trials

LEVELS = {"sigma_t": "[0.02,0.06,0.1]", "n_outliers": "[0,1,10,50]"}

Where = Callable[[str, str, Cell], bool]  # of an experiment, a metric and a cell


def settings(name: str, results: Path) -> Config:
    overrides = [f"experiment={name}", f"results_dir={results}", "trials=3"]
    if name in ("outliers", "collinear"):
        overrides += [f"{key}={value}" for key, value in LEVELS.items()]
    if name == "combined":
        overrides += ["sigma_t=[0.05]", "sigma_r_deg=[3]"]
    return load(overrides)


def nowhere(experiment: str, metric: str, cell: Cell) -> bool:
    return False


def fabricate(
    config: Config, *, blind: Where = nowhere, turned: Where = nowhere, grows: Where = nowhere
) -> None:
    """Write trials whose metrics get worse with noise, but for cells where they do not.

    There they are blind, get better instead, or rise with the number of cameras.
    """
    rng = np.random.default_rng(0)
    rows = []
    for cell in cells(config):
        for trial in range(config.trials):
            row = {"experiment": config.name, "geometry": config.geometry, **vars(cell)}
            row |= {"replicate": 0, "trial": trial}
            for metric in config.metrics:
                where = config.name, metric, cell
                value = 10 * cell.sigma_t + cell.sigma_r_deg / 10 + 0.01 * rng.random()
                value *= -1 if (metric in SCORES) != turned(*where) else 1
                value = 0.5 if blind(*where) else value
                row[metric] = cell.n_cameras if grows(*where) else value
            rows.append(row)
    write_trials(config, pd.DataFrame(rows))


def table_of(tmp_path: Path, **spoiled: Where) -> pd.DataFrame:
    configs = {name: settings(name, tmp_path) for name in EXPERIMENTS}
    for config in configs.values():
        fabricate(config, **spoiled)
    return compare(configs).set_index(["metric", "property"])


OUTLIER, LINE, LONG = PROPERTIES[1:]


def test_metrics_that_get_worse_with_noise_pass(tmp_path: Path) -> None:
    table = table_of(tmp_path)
    assert (table.loc[(slice(None), [OUTLIER, LINE]), "ours"] != "no").all()
    assert table.loc[("ATE", OUTLIER), "agrees"] == "no"
    assert table.loc[("TAS", OUTLIER), "agrees"] == "yes"


def test_metrics_that_get_better_with_noise_fail(tmp_path: Path) -> None:
    table = table_of(tmp_path, turned=lambda experiment, metric, cell: metric in ("TAS", "DRE"))
    for metric in ("TAS", "DRE"):
        assert table.loc[(metric, OUTLIER), "ours"] == "no"
        assert table.loc[(metric, OUTLIER), "value"] < -0.5
    assert table.loc[("TAS", LINE), "ours"] == "no"
    assert table.loc[("RAS", OUTLIER), "ours"] == "yes"


@pytest.mark.parametrize(
    ("n_outliers", "with_outliers", "on_a_line"),
    [(0, "yes", "no"), (1, "no", "yes"), (10, "no", "yes"), (50, "yes", "yes")],
)
def test_one_number_of_outliers_is_enough_to_fail(
    tmp_path: Path, n_outliers: int, with_outliers: str, on_a_line: str
) -> None:
    """All from one to ten count against outliers, none alone on a line, more nowhere."""
    table = table_of(tmp_path, blind=lambda _, metric, cell: cell.n_outliers == n_outliers)
    for metric in PAPER:
        assert table.loc[(metric, OUTLIER), "ours"] == with_outliers
    for metric in COLLINEAR:
        assert table.loc[(metric, LINE), "ours"] == on_a_line


def test_dependence_on_the_length_is_that_at_half_of_the_noise_levels(tmp_path: Path) -> None:
    """There are ten."""
    for n, answer in ((0, "yes"), (4, "yes"), (6, "no"), (10, "no")):
        levels = [0.01 * level for level in range(1, n + 1)]
        table = table_of(
            tmp_path,
            grows=lambda experiment, metric, cell: (
                "length" in experiment and np.isclose(cell.sigma_t, levels).any()  # noqa: B023
            ),
        )
        for metric in LENGTH:  # an error that rises gets worse, a score gets better
            assert table.loc[(metric, LONG), "ours"] == answer


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
        fabricate(load([f"experiment={name}", *shared]))
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
        fabricate(config)
    one_level = load(["experiment=outliers", f"results_dir={tmp_path}", "sigma_t=[0.05]"])
    fabricate(one_level)
    with pytest.raises(TableError, match="one noise level"):
        compare(configs | {"outliers": one_level})


def test_every_metric_is_compared_where_the_paper_shows_it() -> None:
    for experiments in (OUTLIERS, COLLINEAR, LENGTH):
        for metric, name in experiments.items():
            assert metric in load([f"experiment={name}"]).metrics
