"""Settings are those of the paper, can all be overridden, and are refused in one line."""

import shutil
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments import config
from experiments.config import (
    EXECUTION,
    SETTINGS,
    ConfigError,
    Execution,
    Sweep,
    experiment_names,
    load,
    load_execution,
    load_sweep,
    read_yaml,
    to_overrides,
)
from experiments.grid import cells
from experiments.sweep import run_trials

TEN_LEVELS = [0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.1]


@pytest.mark.parametrize("name", experiment_names())
def test_what_all_experiments_of_the_paper_have_in_common(name: str) -> None:
    sweep, execution = load([f"experiment={name}"])
    assert (sweep.name, sweep.trials, sweep.seed, sweep.replicate) == (name, 50, 0, 0)
    assert (sweep.error, sweep.outliers, sweep.outlier_side) == ("gaussian", "uniform", 10.0)
    assert (sweep.changes, sweep.selections) == ("", [])
    assert execution == Execution(
        n_jobs=-1, backend="loky", dask_address=None, results_dir="results"
    )


def test_outlier_experiment_has_the_values_of_the_paper() -> None:
    sweep = load_sweep(["experiment=outliers"])
    assert (sweep.n_cameras, sweep.sigma_t, sweep.sigma_r_deg) == ([100], TEN_LEVELS, [3.0])
    assert sweep.metrics == ["ATE", "DTE", "mAA", "TAS"]


def test_a_setting_is_of_the_results_or_of_how_they_are_made() -> None:
    keys = [key.name for kind in (Sweep, Execution) for key in fields(kind)]
    made_by_a_study = {"name", "changes", "selections"}
    assert set(keys) == {*SETTINGS, *EXECUTION, *made_by_a_study}
    assert len(keys) == len(SETTINGS) + len(EXECUTION) + 3


def test_a_copied_experiment_needs_a_name_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else its results would take the place of the original's."""
    shutil.copytree(config.CONFIG_DIR, tmp_path / "configs")
    monkeypatch.setattr(config, "CONFIG_DIR", tmp_path / "configs")
    folder = tmp_path / "configs" / "experiment"
    text = (folder / "outliers.yaml").read_text()
    (folder / "mine.yaml").write_text(text)
    with pytest.raises(ConfigError, match="setting 'name' must be 'mine'"):
        load(["experiment=mine"])
    (folder / "mine.yaml").write_text(text.replace("name: outliers", "name: mine"))
    assert load_sweep(["experiment=mine"]).name == "mine"


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("trails=5", "unknown setting 'trails'; the settings are experiment, geometry, "),
        ("=5", "unknown setting ''; the settings are"),
        ("name=other", "unknown setting 'name'"),
        ("selections=[]", "unknown setting 'selections'"),
        ("trials", "'trials' is not a setting; write key=value"),
        ("experiment=oultiers", "unknown experiment 'oultiers'; the experiments are collinear, "),
        ("experiment=collinear", "'experiment' is given twice: outliers and collinear"),
        ("trials=five", "'trials': should be a valid integer, not 'five'"),
        ("trials=null", "'trials': should be a valid integer, not None"),
        ("trials=0", "'trials': should be greater than or equal to 1, not 0"),
        ("results_dir=", "'results_dir': String should have at least 1 character, not ''"),
        ("seed=-1", "'seed': should be greater than or equal to 0, not -1"),
        ("seed=${nothing}", "cannot read experiment=outliers seed=${nothing}: "),
        ("n_jobs=0", "'n_jobs' must be positive, or -1 for all"),
        ("backend=mpi", "'backend': should be 'loky', 'threading', 'sequential' or 'dask', not"),
        ("backend=dask", "'dask_address' must name a scheduler, such as tcp://127.0.0.1:8786"),
        ("geometry=sphere", "'geometry': must be one of cube, line, ray, x_axis, random_walk, "),
        ("error=none", "'error': must be one of gaussian, student_t, drift, "),
        ("outliers=many", "'outliers': must be one of uniform, cluster, frozen, "),
        ("outlier_side=0", "'outlier_side': should be greater than 0, not 0"),
        ("outlier_side=inf", "'outlier_side': should be a finite number, not inf"),
        ("outlier_side=1e308", "'outlier_side': should be at most 1e+100, not 1e+308"),
        ("noise=both", "'noise': should be 'product' or 'paired', not 'both'"),
        ("noise=paired", "'noise' is paired, so sigma_t and sigma_r_deg need the same number"),
        ("sigma_t=0.1", "'sigma_t': must be a list in brackets, for example [1, 2]"),
        ("sigma_t=[]", "'sigma_t': needs 1 or more entries, not []"),
        (
            "n_cameras=9,10",
            "n_cameras=9,10: that is several values: write a list as n_cameras=[1,2]",
        ),
        ("trials=range(1,3)", "that is several values"),
        ("sigma_t=[0.1", "cannot read experiment=outliers sigma_t=[0.1: "),
        ("sigma_t=[-0.1]", "'sigma_t': should be greater than or equal to 0, not -0.1"),
        ("sigma_t=[nan]", "'sigma_t': should be a finite number, not nan"),
        ("sigma_t=[1e308]", "'sigma_t': should be at most 1e+100, not 1e+308"),
        ("sigma_t=[true]", "'sigma_t': should be a valid number, not True"),
        ("sigma_t=[0.1,0.1]", "'sigma_t': has a value twice: [0.1, 0.1]"),
        ("n_outliers=[101]", "'n_outliers' has 101, more than the 100 cameras"),
        ("n_outliers=[-1]", "'n_outliers': should be greater than or equal to 0, not -1"),
        ("n_outliers=[1.5]", "'n_outliers': should be a valid integer, not 1.5"),
        ("n_cameras=[3]", "'n_cameras': should be greater than or equal to 4, not 3"),
        (f"n_cameras=[{10**18}]", f"'n_cameras': should be at most 1e+06, not {10**18}"),
        (f"trials={10**9}", f"'trials': should be at most 1e+06, not {10**9}"),
        (f"n_jobs={10**20}", f"'n_jobs': should be at most 1000, not {10**20}"),
        ("results_dir=null", "'results_dir': should be a valid string, not None"),
        ("results_dir=a{b}", "'results_dir': may not have braces, which are Snakemake's: 'a{b}'"),
        ("results_dir=~/a", "'results_dir': may not begin with ~: the shell "),
        ("results_dir=a\x07", "'results_dir': may not have line breaks or other control"),
        ("results_dir=${seed}", "'results_dir': may not have braces"),
        ("volume_per_camera=0", "'volume_per_camera': should be greater than 0, not 0"),
        ("every=0", "'every': should be greater than or equal to 1, not 0"),
        ("every=26", "'every' leaves fewer than 4 of the 100 cameras"),
        ("geometry=line", "'volume_per_camera' applies to the cube alone"),
        ("metrics=[]", "'metrics': needs 1 or more entries, not []"),
        ("metrics=[ATE,APE]", "'metrics': unknown metric 'APE'; close to it are ATE, "),
        ("metrics=[TAS,TAS]", "'metrics': has a value twice: ['TAS', 'TAS']"),
    ],
)
def test_wrong_settings_are_named_in_one_line(override: str, problem: str) -> None:
    volume = ["volume_per_camera=0.1"] if override == "geometry=line" else []
    with pytest.raises(ConfigError) as caught:
        load(["experiment=outliers", *volume, override])
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["größe", "a=b", "it's (1), [2]", "a b;#$*?\\", "5", "日本"])
def test_a_folder_of_results_is_taken_as_it_stands(name: str) -> None:
    for override in (f"results_dir={name}", *to_overrides({"results_dir": name})):
        assert load([override])[1].results_dir == name


@pytest.mark.parametrize("noise", ["sigma_t", "sigma_r_deg"])
def test_the_largest_noise_gives_numbers_without_a_warning(noise: str) -> None:
    settings = ["n_cameras=[20]", "n_outliers=[2]", "outlier_side=1e100", f"{noise}=[1e100]"]
    sweep = load_sweep([*settings, "volume_per_camera=1e100", "metrics=[TAS,DTE,mAA,DRE,ATE]"])
    (row,) = run_trials(sweep, cells(sweep)[0], [0], sweep.metrics)
    assert np.isfinite([row[metric] for metric in sweep.metrics]).all()


@pytest.mark.parametrize("kind", ["cluster", "frozen", "diverging", "missing"])
def test_outliers_that_leave_too_few_cameras_are_refused(kind: str) -> None:
    settings = ["experiment=outliers", f"outliers={kind}", "n_cameras=[20]"]
    assert load_sweep([*settings, "n_outliers=[16]"]).outliers == kind
    with pytest.raises(ConfigError, match=f"'n_outliers' must leave at least 4 .* outliers={kind}"):
        load([*settings, "n_outliers=[17]"])


@pytest.mark.parametrize(
    "overrides",
    [
        [],
        ["n_jobs=2", "backend='threading'", "dask_address=null"],
        ["backend=dask", "dask_address=tcp://127.0.0.1:8786", "results_dir=größe=1"],
        ["results_dir=5"],
    ],
)
def test_how_sweeps_are_run_is_the_same_without_hydra(overrides: list[str]) -> None:
    assert load_execution(overrides) == load(overrides)[1]


@pytest.mark.parametrize("override", ["n_jobs=[", "n_jobs=two", "backend=spark", "n_jobs=0"])
def test_how_sweeps_cannot_be_run_is_named_in_one_line(override: str) -> None:
    with pytest.raises(ConfigError, match=override.partition("=")[0]) as caught:
        load_execution([override])
    assert "\n" not in str(caught.value)


def test_snakemake_settings_reach_hydra() -> None:
    # Snakemake reads lists as strings and an empty value as None.
    fine = "TAS(max_threshold=0.5, n_thresholds=10)"
    settings = {"trials": 5, "sigma_t": ["0.05", "0.1"], "volume_per_camera": None}
    sweep = load_sweep(
        ["experiment=outliers", *to_overrides(settings | {"metrics": ["ATE", fine]})]
    )
    assert (sweep.trials, sweep.sigma_t, sweep.volume_per_camera) == (5, [0.05, 0.1], None)
    assert sweep.metrics == ["ATE", fine]


def test_overrides_win_over_a_study_and_a_study_over_the_experiment() -> None:
    sweep, _ = load(["trials=5"], {"experiment": "outliers", "trials": 9, "n_cameras": [80]})
    assert (sweep.name, sweep.trials, sweep.n_cameras) == ("outliers", 5, [80])


@pytest.mark.parametrize("text", [None, "[", "5", "- {}\n- []"])
def test_a_file_of_settings_that_is_none_is_named_in_one_line(
    tmp_path: Path, text: str | None
) -> None:
    path = tmp_path / "own.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(
        ConfigError, match=rf"(cannot read {path}: .)|({path}: needs key: value)"
    ) as caught:
        read_yaml(path, dict[str, Any])
    assert "\n" not in str(caught.value)
